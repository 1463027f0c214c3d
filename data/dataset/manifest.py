"""What a dataset says about itself: `manifest.json`, written last. Without one a folder is no dataset."""

import hashlib
import os
from collections.abc import Sequence
from pathlib import Path

import msgspec

from grasping_invisible.data.dataset.placement import SHARDS, VALIDATION_PERCENT
from grasping_invisible.data.dataset.schema import FORMAT, WRITER
from grasping_invisible.data.errors import DataError
from grasping_invisible.data.labels import RULES

FILE_NAME = "manifest.json"


class BadDataset(DataError):
    """A folder that is no dataset, or one that cannot be used."""


class RunEntry(msgspec.Struct, frozen=True, order=True):
    """A run in a log: which, in which shard it belongs, and how many rows it has. Sorts as rows do."""

    run_id: str
    started_ns: int
    shard: str
    rows: int

    @property
    def key(self) -> tuple[str, int]:
        """What makes it this run, in whatever file: an id alone is taken again when a collection is repeated."""
        return self.run_id, self.started_ns


class LogEntry(msgspec.Struct, frozen=True):
    """A log that was read. `sha256`: of its file, or over those of all its parts. `bytes`: of all parts.

    `left_out`: motions without the run's start or without heightmaps, of which no row can be made.
    """

    sha256: str
    corrections_sha256: str
    name: str
    bytes: int
    runs: tuple[RunEntry, ...]
    left_out: int

    @property
    def key(self) -> tuple[str, str]:
        """What its rows depend on, beside the rules."""
        return self.sha256, self.corrections_sha256


class ShardRun(msgspec.Struct, frozen=True):
    """Rows of a shard that follow one another: a run, and the log it was taken from."""

    run_id: str
    started_ns: int
    rows: int
    log_sha256: str
    corrections_sha256: str


class ShardEntry(msgspec.Struct, frozen=True):
    """A Parquet file of the dataset, and where each of its rows is from, in their order."""

    path: str
    sha256: str
    bytes: int
    rows: int
    runs: tuple[ShardRun, ...]


class LeftOut(msgspec.Struct, frozen=True, order=True):
    """A log of which nothing was taken, and why."""

    name: str
    reason: str


class Manifest(msgspec.Struct, frozen=True, kw_only=True):
    """A whole dataset. `sha256` names its content: a hash over the shards' paths and hashes."""

    format: int = FORMAT
    sha256: str
    rows: int
    rules: dict[str, int] = msgspec.field(default_factory=lambda: dict(RULES))
    writer: str = WRITER
    validation_percent: int = VALIDATION_PERCENT
    shards_of_splits: dict[str, int] = msgspec.field(default_factory=lambda: dict(SHARDS))
    shards: tuple[ShardEntry, ...]
    logs: tuple[LogEntry, ...]
    copies: int = 0
    left_out: tuple[LeftOut, ...] = ()


def manifest_of(
    shards: Sequence[ShardEntry], logs: Sequence[LogEntry], copies: int, left_out: Sequence[LeftOut]
) -> Manifest:
    """The manifest of a dataset; the order of what is given makes no difference."""
    ordered = tuple(sorted(shards, key=lambda shard: shard.path))
    return Manifest(
        sha256=content_sha256(ordered),
        rows=sum(shard.rows for shard in ordered),
        shards=ordered,
        logs=tuple(sorted(logs, key=lambda log: (log.name, *log.key))),
        copies=copies,
        left_out=tuple(sorted(left_out)),
    )


def content_sha256(shards: Sequence[ShardEntry]) -> str:
    """The hash of a dataset with these shards, in the order of their paths."""
    lines = "".join(f"{shard.sha256}  {shard.path}\n" for shard in shards)
    return hashlib.sha256(lines.encode()).hexdigest()


def read_manifest(folder: Path) -> Manifest:
    """The manifest of the dataset in a folder; raises `BadDataset`."""
    path = folder / FILE_NAME
    if not folder.is_dir():
        raise BadDataset(f"no dataset at {folder}: there is no such folder")
    try:
        manifest = msgspec.json.decode(path.read_bytes(), type=Manifest)
    except FileNotFoundError:
        raise BadDataset(f"no dataset in {folder}: it holds no {FILE_NAME}; make one with gi-dataset rebuild") from None
    except msgspec.DecodeError as error:
        raise BadDataset(f"dataset {folder}: {FILE_NAME} is not valid: {error}") from None
    if manifest.format != FORMAT:
        raise BadDataset(f"dataset {folder} has format {manifest.format}, this version reads {FORMAT}: rebuild it")
    return manifest


def write_manifest(folder: Path, manifest: Manifest) -> None:
    """Write `manifest.json`; there is an old one, a new one or none, never half of one."""
    text = msgspec.json.format(msgspec.json.encode(manifest, order="sorted"), indent=1)
    unfinished = folder / f".{FILE_NAME}.unfinished"
    unfinished.write_bytes(text + b"\n")
    os.replace(unfinished, folder / FILE_NAME)
