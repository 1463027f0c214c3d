"""From one log to its rows, in a Parquet file of their own that waits to be merged into shards."""

import hashlib
import os
from pathlib import Path
from typing import Any

import msgspec
import pyarrow as pa
import pyarrow.parquet as pq

from grasping_invisible.data.corrections import Corrections
from grasping_invisible.data.dataset.manifest import LogEntry, RunEntry
from grasping_invisible.data.dataset.placement import group_of, shard_of
from grasping_invisible.data.dataset.rows import row_of
from grasping_invisible.data.dataset.schema import FORMAT, GROUP_ROWS, WRITER, open_writer, table_of
from grasping_invisible.data.errors import DataError
from grasping_invisible.data.file_hash import file_sha256
from grasping_invisible.data.labelled_steps import labelled_steps
from grasping_invisible.data.labels import RULES
from grasping_invisible.data.log_file import is_being_written
from grasping_invisible.data.log_storage import parts_of
from grasping_invisible.data.shown_name import shown


class Unusable(DataError):
    """A log that nothing is taken from, and why."""


def log_sha256(parts: list[Path]) -> str:
    """The hash of a log: its file's, or where it has several parts, of the list of theirs."""
    hashes = [file_sha256(part) for part in parts]
    return hashes[0] if len(hashes) == 1 else hashlib.sha256("\n".join(hashes).encode()).hexdigest()


def waiting_path(waiting: Path, key: tuple[str, str]) -> Path:
    """Where the rows of a log wait, by what they depend on."""
    depends_on = repr((key, FORMAT, sorted(RULES.items()), WRITER))
    return waiting / f"{hashlib.sha256(depends_on.encode()).hexdigest()[:32]}.rows"


def waiting_entry(waiting: Path, key: tuple[str, str]) -> LogEntry | None:
    """The log whose rows wait already, or None; what a killed process left half done does not count."""
    path = waiting_path(waiting, key)
    try:
        return msgspec.json.decode(path.with_suffix(".json").read_bytes(), type=LogEntry)
    except (FileNotFoundError, msgspec.DecodeError):
        return None


def ingest(log: Path, sha256: str, waiting: Path) -> LogEntry:
    """Put the rows of a log into `waiting`, run by run; raises `Unusable`.

    A damaged log is not taken in part: what was lost could be what a motion led to.
    """
    parts = parts_of(log)
    if is_being_written(parts[-1]):
        raise Unusable("it is being written")
    key = sha256, Corrections(log).sha256
    known = waiting_entry(waiting, key)
    if known is not None:
        return msgspec.structs.replace(known, name=shown(log.name))
    path = waiting_path(waiting, key)
    unfinished = path.with_suffix(f".{os.getpid()}")
    try:
        with _RowFile(unfinished, key) as rows:
            damage: list[str] = []
            for labelled in labelled_steps(log, damage):
                rows.add(row_of(labelled), shard=_shard(labelled.step.start))
            if damage:
                more = f", and {len(damage) - 1} more" if len(damage) > 1 else ""
                raise Unusable(f"{damage[0]}{more}; gi-log recover makes a whole log of the rest")
        entry = LogEntry(*key, shown(log.name), sum(part.stat().st_size for part in parts), rows.runs, rows.left_out)
        os.replace(unfinished, path)
    finally:
        unfinished.unlink(missing_ok=True)
    path.with_suffix(".json").write_bytes(msgspec.json.encode(entry))  # last: now the rows count
    return entry


def _shard(start: Any) -> str:
    return "" if start is None else shard_of(group_of(start))


class _RowFile:
    """Rows on their way into a Parquet file, `GROUP_ROWS` to a row group, those of a run one behind the other."""

    def __init__(self, path: Path, key: tuple[str, str]) -> None:
        self._writer: pq.ParquetWriter = open_writer(path)
        self._hashes = {"log_sha256": key[0], "corrections_sha256": key[1] or None}
        self._runs: dict[tuple[str, int], RunEntry] = {}
        self._current: tuple[str, int] | None = None
        self._rows: list[dict[str, Any]] = []
        self.left_out = 0

    @property
    def runs(self) -> tuple[RunEntry, ...]:
        return tuple(self._runs.values())

    def add(self, row: dict[str, Any] | None, shard: str) -> None:
        """Add a row of the run that goes on, or of one that begins; a run met again is a copy and passed over."""
        if row is None:
            self.left_out += 1
            return
        key = row["run_id"], row["run_started_ns"]
        if key != self._current:
            if key in self._runs:
                return
            self._current = key
            self._runs[key] = RunEntry(*key, shard, 0)
        self._runs[key] = msgspec.structs.replace(self._runs[key], rows=self._runs[key].rows + 1)
        self._rows.append(row | self._hashes)
        if len(self._rows) == GROUP_ROWS:
            self._flush()

    def __enter__(self) -> "_RowFile":
        return self

    def __exit__(self, *_: object) -> None:
        self._flush()
        self._writer.close()

    def _flush(self) -> None:
        if not self._rows:
            return
        rows, self._rows = self._rows, []
        try:
            table = table_of(rows)
        except (OverflowError, pa.ArrowInvalid) as error:  # such as a time in another age
            raise Unusable(f"a number in it is out of all range: {error}") from error
        self._writer.write_table(table, row_group_size=GROUP_ROWS)
