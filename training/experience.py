"""Datasets as what critic and classifier are trained on and scored with."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from grasping_invisible.data.dataset.placement import TRAIN, VALIDATION, group_of
from grasping_invisible.data.dataset.reader import Dataset
from grasping_invisible.data.labels import RULES
from grasping_invisible.data.progress import bar
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.training.transitions import Transition, TransitionReader


@dataclass(frozen=True)
class Experience:
    """Transitions to train on and to score with, each in the order of time; no scene is in both.

    `datasets`: the content hashes of what they are from. `rules`: by which they are labelled. `scenes`,
    `held_out_scenes`: how many scenes each part is from, see `read_experience`. `agnostic`: any object counts as the
    goal.
    """

    taught: list[Transition]
    held_out: list[Transition]
    datasets: tuple[str, ...]
    rules: dict[str, int]
    scenes: int
    held_out_scenes: int
    agnostic: bool = False

    @property
    def origin(self) -> dict[str, str | int | float]:
        """What a checkpoint says of its data."""
        return {
            "dataset_sha256": " ".join(self.datasets),
            "label_rules": ", ".join(f"{name} {version}" for name, version in sorted(self.rules.items())),
            **({"goal": "any object"} if self.agnostic else {}),
            "scenes": self.scenes,
            "held_out_scenes": self.held_out_scenes,
        }


def read_experience(folders: Sequence[Path], console: Console, *, agnostic: bool = False) -> Experience:
    """All that some datasets teach, or all that they teach of any object. A motion that several hold counts once.

    All split scenes alike. One scene with one seed is one scene however many runs it saw, as what is learned in one run
    holds in the next: collections that branch try each motion in a run of its own. A run on a robot, whose scene nobody
    knows, counts as one. Heightmaps stay compressed: some 100 kB a motion. Raises `BadDataset` and `BadInput`.
    """
    datasets = [Dataset(folder) for folder in folders]
    for dataset in datasets:
        if dataset.manifest.rules != RULES:
            raise BadInput(f"dataset {dataset.folder} is labelled by other rules than this version's: rebuild it")
    met: set[tuple[str, int, int]] = set()
    found: dict[str, list[tuple[tuple[int, str, int], Transition]]] = {TRAIN: [], VALIDATION: []}
    scenes: dict[str, set[str]] = {TRAIN: set(), VALIDATION: set()}
    with bar("reading datasets", sum(dataset.manifest.rows for dataset in datasets), console) as advance:
        for dataset in datasets:
            for split, items in found.items():
                reader = TransitionReader()
                for row in dataset.rows(split):
                    key = row["run_id"], row["run_started_ns"], row["step"]
                    if key not in met:
                        met.add(key)
                        when = row["run_started_ns"], row["run_id"], row["step"]
                        taught_by_row = list(reader.of_any_object(row) if agnostic else reader.of(row))
                        items += [(when, transition) for transition in taught_by_row]
                        if taught_by_row:
                            start = gi.RunStart(run_id=row["run_id"], scene=row["scene"], seed=row["seed"])
                            scenes[split].add(group_of(start))
                    advance()
    taught, held_out = ([item for _, item in sorted(found[side], key=lambda it: it[0])] for side in (TRAIN, VALIDATION))
    if not taught or not held_out:
        raise BadInput(
            f"{len(taught)} transitions to train on and {len(held_out)} to score with are too few; runs in one scene "
            "with one seed stay on one side, so vary them"
        )
    return Experience(
        taught,
        held_out,
        datasets=tuple(sorted({dataset.manifest.sha256 for dataset in datasets})),
        rules=dict(RULES),
        scenes=len(scenes[TRAIN]),
        held_out_scenes=len(scenes[VALIDATION]),
        agnostic=agnostic,
    )
