"""What a dataset holds, counted."""

from collections import Counter
from typing import Any

import msgspec

from grasping_invisible.data.dataset.manifest import LeftOut
from grasping_invisible.data.dataset.placement import SHARDS, split_of
from grasping_invisible.data.dataset.reader import Dataset
from grasping_invisible.data.shown_name import shown

_COUNTED = ["kind", "usable", "success", "reward", "status", "label_source", "goals"]


class SplitInfo(msgspec.Struct, frozen=True):
    """One side of the split. `goals`: labels for the run's target and in hindsight."""

    shards: int
    bytes: int
    runs: int
    rows: int
    usable: int
    goals: int
    hindsight_goals: int
    outcomes: dict[str, dict[str, int]]  # of each kind of motion: how many ended how, were rewarded how
    label_sources: dict[str, int]


class DatasetInfo(msgspec.Struct, frozen=True):
    """A dataset. `logs`: how many it was made from. `motions_left_out`: without heightmaps or the run's start."""

    path: str
    sha256: str
    format: int
    rules: dict[str, int]
    rows: int
    runs: int
    logs: int
    copies: int
    motions_left_out: int
    left_out: tuple[LeftOut, ...]
    splits: dict[str, SplitInfo]


def info_of(dataset: Dataset) -> DatasetInfo:
    """Count what a dataset holds; reads all but the pictures. Raises `BadDataset`."""
    manifest = dataset.manifest
    return DatasetInfo(
        path=shown(str(dataset.folder)),
        sha256=manifest.sha256,
        format=manifest.format,
        rules=manifest.rules,
        rows=manifest.rows,
        runs=sum(len(shard.runs) for shard in manifest.shards),
        logs=len(manifest.logs),
        copies=manifest.copies,
        motions_left_out=sum(log.left_out for log in manifest.logs),
        left_out=manifest.left_out,
        splits={split: _split_info(dataset, split) for split in SHARDS},
    )


def _split_info(dataset: Dataset, split: str) -> SplitInfo:
    shards = [shard for shard in dataset.manifest.shards if split_of(shard.path) == split]
    outcomes: dict[str, Counter[str]] = {}
    sources: Counter[str] = Counter()
    usable = goals = hindsight = 0
    for row in dataset.rows(split, _COUNTED):
        outcomes.setdefault(row["kind"], Counter()).update(_said(row))
        sources[row["label_source"]] += 1
        usable += row["usable"]
        goals += len(row["goals"])
        hindsight += sum(goal["hindsight"] for goal in row["goals"])
    return SplitInfo(
        shards=len(shards),
        bytes=sum(shard.bytes for shard in shards),
        runs=sum(len(shard.runs) for shard in shards),
        rows=sum(shard.rows for shard in shards),
        usable=usable,
        goals=goals - hindsight,
        hindsight_goals=hindsight,
        outcomes={kind: dict(sorted(counts.items())) for kind, counts in sorted(outcomes.items())},
        label_sources=dict(sorted(sources.items())),
    )


def _said(row: dict[str, Any]) -> list[str]:
    """The counts that a row adds to."""
    said = ["motions", row["status"] or "no outcome"]
    if row["reward"] is not None:
        said.append(f"reward {row['reward']:g}")
    if row["success"]:
        said.append("target grasped")
    return said
