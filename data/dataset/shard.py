"""One shard of a dataset, merged run by run from its predecessor and from rows that wait."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import msgspec
import pyarrow as pa
import pyarrow.parquet as pq

from grasping_invisible.data.dataset.ingest import waiting_path
from grasping_invisible.data.dataset.manifest import LogEntry, ShardEntry, ShardRun
from grasping_invisible.data.dataset.schema import GROUP_ROWS, SCHEMA, open_writer
from grasping_invisible.data.file_hash import file_sha256


class ShardPlan(msgspec.Struct, frozen=True):
    """What a shard is to hold. `path`: its name in the dataset. `runs`: in the order of its rows.

    `before`: the shard that is there now, from which rows are taken where it has them.
    """

    path: str
    runs: tuple[ShardRun, ...]
    before: ShardEntry | None


def write_shard(plan: ShardPlan, dataset: Path, waiting: Path, logs: Sequence[LogEntry], out: Path) -> ShardEntry:
    """Write the shard to `out`, holding some `GROUP_ROWS` rows at a time.

    `logs`: those whose rows wait in `waiting`. The same rows give the same bytes, wherever they are taken from.
    """
    out.parent.mkdir(parents=True, exist_ok=True)
    pending: list[pa.Table] = []
    with open_writer(out) as writer:
        for table in _rows(plan, dataset, waiting, {log.key: log for log in logs}):
            pending.append(table)
            while sum(map(len, pending)) >= GROUP_ROWS:
                together = pa.concat_tables(pending)
                _write_group(writer, together.slice(0, GROUP_ROWS))
                pending = [together.slice(GROUP_ROWS)]
        if sum(map(len, pending)):
            _write_group(writer, pa.concat_tables(pending))
    rows = sum(run.rows for run in plan.runs)
    return ShardEntry(plan.path, file_sha256(out), out.stat().st_size, rows, plan.runs)


def _write_group(writer: pq.ParquetWriter, table: pa.Table) -> None:
    # How a table is cut into chunks in memory would otherwise show in the file's pages.
    writer.write_table(table.combine_chunks(), row_group_size=GROUP_ROWS)


def _rows(plan: ShardPlan, dataset: Path, waiting: Path, logs: dict[tuple[str, str], LogEntry]) -> Iterator[pa.Table]:
    old = _OldRows(dataset / plan.before.path, plan.before.runs) if plan.before is not None else None
    for run in plan.runs:
        if old is not None and old.has(run):
            yield from old.rows_of(run)
        else:
            log = logs[run.log_sha256, run.corrections_sha256]
            yield from _waiting_rows(waiting_path(waiting, log.key), log, run)


def _waiting_rows(path: Path, log: LogEntry, wanted: ShardRun) -> Iterator[pa.Table]:
    """The row groups of one run, which lie one behind the other."""
    group = 0
    with pq.ParquetFile(path) as file:
        for run in log.runs:
            groups = -(-run.rows // GROUP_ROWS)
            if run.key == (wanted.run_id, wanted.started_ns):
                for index in range(group, group + groups):
                    yield file.read_row_group(index, use_threads=False).cast(SCHEMA)
            group += groups


class _OldRows:
    """The rows of a shard that is there, some of whose runs are wanted, in their order."""

    def __init__(self, path: Path, runs: Sequence[ShardRun]) -> None:
        self._path = path
        self._group: tuple[int, pa.Table] | None = None  # the one read last: runs are shorter than row groups
        self._starts: dict[ShardRun, int] = {}
        start = 0
        for run in runs:
            self._starts[run] = start
            start += run.rows

    def has(self, run: ShardRun) -> bool:
        return run in self._starts

    def rows_of(self, run: ShardRun) -> Iterator[pa.Table]:
        """The rows of one run, group by group."""
        first, end = self._starts[run], self._starts[run] + run.rows
        for group in range(first // GROUP_ROWS, -(-end // GROUP_ROWS)):
            begins = group * GROUP_ROWS
            table = self._read(group)
            low, high = max(first - begins, 0), min(end - begins, len(table))
            yield table.slice(low, high - low)

    def _read(self, group: int) -> pa.Table:
        if self._group is None or self._group[0] != group:
            with pq.ParquetFile(self._path) as file:
                self._group = group, file.read_row_group(group, use_threads=False).cast(SCHEMA)
        return self._group[1]
