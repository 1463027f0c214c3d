"""Logs to a dataset: what is known already is kept, and the same logs, corrections and rules give the same bytes."""

import fcntl
import os
import shutil
import signal
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import msgspec
from rich.console import Console

from grasping_invisible.data.dataset.ingest import waiting_entry
from grasping_invisible.data.dataset.known_files import KnownFiles
from grasping_invisible.data.dataset.manifest import (
    FILE_NAME,
    BadDataset,
    LogEntry,
    Manifest,
    ShardEntry,
    ShardRun,
    manifest_of,
    read_manifest,
    write_manifest,
)
from grasping_invisible.data.dataset.placement import SHARDS
from grasping_invisible.data.dataset.schema import WRITER
from grasping_invisible.data.dataset.shard import ShardPlan, write_shard
from grasping_invisible.data.dataset.sources import Key, Sources, read_again, read_logs, working
from grasping_invisible.data.errors import BadRequest
from grasping_invisible.data.file_hash import file_sha256
from grasping_invisible.data.labels import RULES
from grasping_invisible.data.log_files import logs_at
from grasping_invisible.data.progress import bar
from grasping_invisible.data.shown_name import shown
from grasping_invisible.data.worker import RunAll

WORK = ".rebuild"  # inside the dataset: rows and shards on their way, and what is known of files
NEW_SHARDS = "shards"


class Rebuild(msgspec.Struct, frozen=True):
    """What a rebuild did. `written`: shards. `given`, `read`, `gone`: logs; gone is one of before not given again."""

    manifest: Manifest
    written: int
    given: int
    read: int
    read_bytes: int
    gone: int


def rebuild(paths: Sequence[Path], out: Path, workers: int, console: Console) -> Rebuild:
    """Make `out` the dataset of the logs at `paths`. Raises `DataError`, `OSError`.

    Interrupted at any moment it leaves the dataset that was there before, or none yet; the same call then goes on.
    """
    logs = logs_at(paths)
    before = _known_dataset(out)
    with _work_folder(out) as work, working(workers) as run_all:
        waiting = work / "rows"
        waiting.mkdir(exist_ok=True)
        known = {log.key: log for log in before.logs} if before else {}
        sources = read_logs(logs, known, KnownFiles(work / "files.json"), waiting, run_all, console)
        if not sources.entries:
            raise BadRequest(f"no log can be used; {sources.left_out[0].name}: {sources.left_out[0].reason}")
        plans = _plans(sources, before)
        changed = [_without_damaged(plan, out) for plan in plans if not _is_there(plan, out)]
        nowhere = [key for key in _needed(changed) if waiting_entry(waiting, key) is None]
        read_again(nowhere, sources, waiting, run_all, console)
        new = _write_shards(changed, out, work, list(sources.entries.values()), run_all, console)
        kept = [plan.before for plan in plans if plan.before is not None and _is_there(plan, out)]
        manifest = manifest_of([*kept, *new], list(sources.entries.values()), sources.copies, sources.left_out)
        if new or manifest != before:
            _swap(out, work, new, manifest)
        shutil.rmtree(waiting)
        shutil.rmtree(work / NEW_SHARDS, ignore_errors=True)
    read = [read for read in sources.reads if read.entry is not None]
    gone = len(known.keys() - sources.entries.keys())
    return Rebuild(manifest, len(new), len(logs), len(read), sum(one.bytes for one in read), gone)


def _known_dataset(out: Path) -> Manifest | None:
    """The dataset that is there, if its rows can be used; raises `BadRequest` where something else is there."""
    if out.exists() and not out.is_dir():
        raise BadRequest(f"{out} is a file; the dataset needs a folder")
    if shown(str(out)) != str(out):
        raise BadRequest(f"{shown(str(out))} is no text; Parquet files need a folder whose name is")
    ours = (FILE_NAME, WORK, *SHARDS)
    foreign = (
        sorted(path.name for path in out.iterdir() if path.name not in ours and path.name[0] != ".")
        if out.exists()
        else []
    )
    if foreign:
        raise BadRequest(f"{out} holds {foreign[0]}, which is no part of a dataset; give --out another folder")
    try:
        manifest = read_manifest(out)
    except BadDataset:
        return None
    return manifest if (manifest.rules, manifest.writer) == (RULES, WRITER) else None


@contextmanager
def _work_folder(out: Path) -> Iterator[Path]:
    """The folder of what is on its way, held by one rebuild at a time."""
    work = out / WORK
    work.mkdir(parents=True, exist_ok=True)
    with (work / "lock").open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise BadRequest(f"another gi-dataset rebuild is at work on {out}") from None
        yield work


def _plans(sources: Sources, before: Manifest | None) -> list[ShardPlan]:
    """What each shard is to hold."""
    runs: dict[str, list[ShardRun]] = {}
    for run, log in sources.runs():
        runs.setdefault(run.shard, []).append(ShardRun(*run.key, run.rows, *log.key))
    old = {shard.path: shard for shard in before.shards} if before else {}
    return [ShardPlan(path, tuple(runs[path]), old.get(path)) for path in sorted(runs)]


def _is_there(plan: ShardPlan, out: Path) -> bool:
    if plan.before is None or plan.before.runs != plan.runs:
        return False
    path = out / plan.path
    return path.is_file() and path.stat().st_size == plan.before.bytes


def _without_damaged(plan: ShardPlan, out: Path) -> ShardPlan:
    """The plan without its predecessor, if that is not what the manifest says."""
    path = None if plan.before is None else out / plan.path
    if path is not None and plan.before is not None and path.is_file() and file_sha256(path) == plan.before.sha256:
        return plan
    return msgspec.structs.replace(plan, before=None)


def _needed(changed: list[ShardPlan]) -> list[Key]:
    """The logs whose rows must wait: all that are not in a shard's predecessor."""
    keys: dict[Key, None] = {}
    for plan in changed:
        there = set(plan.before.runs) if plan.before is not None else set()
        keys.update({(run.log_sha256, run.corrections_sha256): None for run in plan.runs if run not in there})
    return list(keys)


def _write_shards(
    changed: list[ShardPlan], out: Path, work: Path, logs: list[LogEntry], run_all: RunAll, console: Console
) -> list[ShardEntry]:
    new = []
    write = partial(_write_shard, out=out, work=work, logs=logs)
    with bar("writing shards", len(changed), console) as advance:
        for shard in run_all(write, changed):
            new.append(shard)
            advance()
    return new


def _write_shard(plan: ShardPlan, out: Path, work: Path, logs: list[LogEntry]) -> ShardEntry:
    return write_shard(plan, out, work / "rows", logs, _new_path(work, plan.path))


def _new_path(work: Path, shard: str) -> Path:
    """Where a shard is written; nobody who looks for Parquet files below the dataset shall find it there."""
    return work / NEW_SHARDS / f"{shard}.new"


def _swap(out: Path, work: Path, new: list[ShardEntry], manifest: Manifest) -> None:
    """Put new shards into their places. No manifest is better than a wrong one: it goes first and comes last."""
    held = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM, signal.SIGHUP})
    try:
        (out / FILE_NAME).unlink(missing_ok=True)
        for shard in new:
            (out / shard.path).parent.mkdir(exist_ok=True)
            os.replace(_new_path(work, shard.path), out / shard.path)
        wanted = {shard.path for shard in manifest.shards}
        for path in [path for split in SHARDS for path in (out / split).glob("*.parquet")]:
            if path.relative_to(out).as_posix() not in wanted:
                path.unlink()
        write_manifest(out, manifest)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, held)
