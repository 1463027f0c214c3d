"""The logs of a rebuild: which are known, what the others hold, and which copy of a run counts."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import msgspec
from rich.console import Console

from grasping_invisible.data.corrections import Corrections
from grasping_invisible.data.dataset.ingest import ingest, log_sha256
from grasping_invisible.data.dataset.known_files import KnownFiles
from grasping_invisible.data.dataset.manifest import LeftOut, LogEntry, RunEntry
from grasping_invisible.data.errors import DataError
from grasping_invisible.data.log_storage import parts_of
from grasping_invisible.data.progress import bar
from grasping_invisible.data.shown_name import shown
from grasping_invisible.data.worker import RunAll, worker_pool

Key = tuple[str, str]  # what the rows of a log depend on: its hash and that of its corrections


class Read(msgspec.Struct, frozen=True):
    """What became of one log: its rows wait (`entry`), or are known from before (`entry` None), or `failure`."""

    log: Path
    sha256: str = ""
    corrections_sha256: str = ""
    entry: LogEntry | None = None
    failure: str = ""
    bytes: int = 0

    @property
    def key(self) -> Key:
        """What its rows depend on."""
        return self.sha256, self.corrections_sha256


class Sources(msgspec.Struct):
    """All logs of a rebuild. `entries`: those that can be used. `places`: where each of them lies."""

    reads: list[Read]
    entries: dict[Key, LogEntry]
    places: dict[Key, Path]

    @property
    def left_out(self) -> list[LeftOut]:
        """The logs that cannot be used, and why."""
        return [LeftOut(shown(read.log.name), shown(read.failure)) for read in self.reads if read.failure]

    def runs(self) -> list[tuple[RunEntry, LogEntry]]:
        """Each run once, in the order of rows, with the log it is taken from.

        Of copies that one counts which a person corrected, then which holds most; the hash decides the rest.
        """
        best: dict[tuple[str, int], tuple[RunEntry, LogEntry]] = {}
        for log in self.entries.values():
            for run in log.runs:
                if run.key not in best or _rank(run, log) > _rank(*best[run.key]):
                    best[run.key] = run, log
        return [best[key] for key in sorted(best)]

    @property
    def copies(self) -> int:
        """How often a run was met again, in whatever file."""
        met = sum(len(self.entries[read.key].runs) for read in self.reads if not read.failure)
        return met - len({run.key for log in self.entries.values() for run in log.runs})


def read_logs(
    logs: Sequence[Path],
    known: dict[Key, LogEntry],
    files: KnownFiles,
    waiting: Path,
    run_all: RunAll,
    console: Console,
) -> Sources:
    """Read what is not known: the rows of each other log wait in `waiting` afterwards."""
    reads, jobs = [], []
    for log in logs:
        sha256 = files.sha256(log)
        read = None if sha256 is None else _known_read(log, sha256, known)
        if read is None:
            jobs.append((log, sha256))
        else:
            reads.append(read)
    jobs.sort(key=lambda job: -_bytes(job[0]))  # the last ones to be done should be small
    taken = 0
    with bar("reading logs", len(jobs), console) as advance:
        try:
            for read in run_all(partial(_read, known=known, waiting=waiting), jobs):
                reads.append(read)
                taken += read.bytes
                if read.sha256:
                    files.note(read.log, read.sha256)
                advance(f"{taken / 1e6:.0f} MB")
        finally:
            files.save()
    return _sources(reads, known)


def read_again(keys: Sequence[Key], sources: Sources, waiting: Path, run_all: RunAll, console: Console) -> None:
    """Let the rows of logs wait that are known but whose rows are nowhere; raises `DataError` where that fails."""
    with bar("reading logs again", len(keys), console) as advance:
        for read in run_all(partial(_read, known={}, waiting=waiting), [(sources.places[key], key[0]) for key in keys]):
            if read.failure:
                raise DataError(f"{read.log}: {read.failure}")
            advance()


@contextmanager
def working(workers: int) -> Iterator[RunAll]:
    """A map as of `worker_pool`, but in this process where one is all."""
    if workers == 1:
        yield map
        return
    with worker_pool(workers) as run_all:
        yield run_all


def _read(job: tuple[Path, str | None], known: dict[Key, LogEntry], waiting: Path) -> Read:
    log, sha256 = job
    try:
        sha256 = sha256 or log_sha256(parts_of(log))
        read = _known_read(log, sha256, known)
        if read is None:
            entry = ingest(log, sha256, waiting)
            read = Read(log, *entry.key, entry, bytes=entry.bytes)
        return read
    except DataError as error:
        return Read(log, failure=str(error))
    except OSError as error:
        return Read(log, failure=f"it cannot be read: {error.strerror}")


def _known_read(log: Path, sha256: str, known: dict[Key, LogEntry]) -> Read | None:
    try:
        key = sha256, Corrections(log).sha256
    except (DataError, OSError):  # said when the log is read
        return None
    return Read(log, *key) if key in known else None


def _sources(reads: list[Read], known: dict[Key, LogEntry]) -> Sources:
    entries: dict[Key, LogEntry] = {}
    places: dict[Key, Path] = {}
    for read in sorted((read for read in reads if not read.failure), key=lambda read: (read.log.name, read.log)):
        entry = read.entry or known[read.key]
        if read.key not in entries:  # of equal files the first by name
            entries[read.key] = msgspec.structs.replace(entry, name=shown(read.log.name))
            places[read.key] = read.log
    return Sources(reads, entries, places)


def _rank(run: RunEntry, log: LogEntry) -> tuple[bool, int, Key]:
    return bool(log.corrections_sha256), run.rows, log.key


def _bytes(log: Path) -> int:
    return sum(part.stat().st_size for part in parts_of(log) if part.exists())
