"""One shard of a dataset, merged run by run from its predecessor and from rows that wait."""

from collections.abc import Hashable, Iterator, Sequence
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
    old = None
    if plan.before is not None:
        old = _RunRows(dataset / plan.before.path, [(run, run.rows) for run in plan.before.runs])
    waits: tuple[LogEntry, _RunRows] | None = None  # of the log read last: the runs of a log mostly follow each other
    for run in plan.runs:
        if old is not None and run in old:
            yield from old.of(run, run.rows)
            continue
        log = logs[run.log_sha256, run.corrections_sha256]
        if waits is None or waits[0] is not log:
            waits = log, _RunRows(waiting_path(waiting, log.key), [(entry.key, entry.rows) for entry in log.runs])
        yield from waits[1].of((run.run_id, run.started_ns), run.rows)


class _RunRows:
    """The rows of a Parquet file by run. `runs`: a key of each and how many rows it has, in their order in the file."""

    def __init__(self, path: Path, runs: Sequence[tuple[Hashable, int]]) -> None:
        self._path = path
        self._group: tuple[int, pa.Table] | None = None  # the one read last: runs are shorter than row groups
        self._starts: dict[Hashable, int] = {}
        start = 0
        for key, rows in runs:
            self._starts[key] = start
            start += rows

    def __contains__(self, run: Hashable) -> bool:
        return run in self._starts

    def of(self, run: Hashable, rows: int) -> Iterator[pa.Table]:
        """The rows of one run, group by group."""
        first, end = self._starts[run], self._starts[run] + rows
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
