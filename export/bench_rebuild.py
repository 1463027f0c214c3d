"""`gi-bench rebuild`: how fast `gi-dataset rebuild` reads logs, and how it grows with their number."""

import argparse
import os
import tempfile
import time
from pathlib import Path

import msgspec
from rich.console import Console
from rich.table import Table

from grasping_invisible.data.dataset.rebuild import Rebuild, rebuild
from grasping_invisible.data.log_commands import wording
from grasping_invisible.data.progress import bar
from grasping_invisible.export.bench_arguments import seed_number
from grasping_invisible.export.bench_logs import LogMaker
from grasping_invisible.export.bench_output import say
from grasping_invisible.export.machine import machine

SIZES = (10, 100, 1000)
MOST = 100  # generated logs for the first table, which takes no more than the smallest size of the second


class RebuildTime(msgspec.Struct, frozen=True):
    """One rebuild. `kind`: of all logs into a new dataset, of one log more into the one before, or of no change."""

    kind: str
    logs: int
    workers: int
    seconds: float
    read_bytes: int
    transitions: int
    shards_written: int

    @property
    def megabytes_per_second(self) -> float:
        """Of log read."""
        return self.read_bytes / 1e6 / self.seconds


class RebuildFigures(msgspec.Struct, frozen=True):
    """What `gi-bench rebuild` found: `speed` on one lot of logs, `growth` on ever more generated ones."""

    logs: str
    speed: list[RebuildTime]
    growth: list[RebuildTime]


def register(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> argparse.ArgumentParser:
    """Add the parser of `rebuild`."""
    parser = commands.add_parser(
        "rebuild",
        help="MB and transitions a second, on one and all cores, and how it grows",
        description="Time gi-dataset rebuild on logs of yours, or on generated ones, with one worker and on all cores; "
        "then on 10, 100 and 1,000 generated logs, in full, with one log more, and without any change. Logs that were "
        "just written lie in memory: what is measured is not the disk.",
    )
    parser.add_argument(
        "--logs",
        type=Path,
        metavar="DIR",
        help=f"logs for the first table (default: generated ones, as many as the smallest size, at most {MOST})",
    )
    parser.add_argument(
        "--sizes", type=int, nargs="*", default=SIZES, metavar="N", help="of the second (default: 10 100 1000)"
    )
    parser.add_argument("--seed", type=seed_number, default=0, metavar="N", help="of generated logs (default: 0)")
    parser.set_defaults(run=run)
    return parser


def run(options: argparse.Namespace) -> int:
    """Rebuild again and again into temporary folders, and print the times."""
    computer = machine()
    console = Console(stderr=True)
    sizes = sorted(set(options.sizes))
    with tempfile.TemporaryDirectory(prefix="gi-bench-") as name:
        folder = Path(name)
        logs = folder / "logs"
        logs.mkdir()
        maker = LogMaker(options.seed)
        speed = []
        if options.logs is None:
            _write(maker, logs, min([MOST, *sizes]), console)
        for workers in sorted({1, os.cpu_count() or 1}):
            speed.append(_timed("all", options.logs or logs, folder / f"speed-{workers}", workers, console))
        growth = []
        for size in sizes:
            growth += _grow(maker, logs, folder / f"growth-{size}", size, console)
    said = str(options.logs) if options.logs else f"generated, seed {options.seed}"
    figures = RebuildFigures(said, speed, growth)
    tables = [_table(f"Rebuilding a dataset of logs: {said}", speed)]
    if growth:
        tables.append(_table("How it grows, on generated logs", growth))
    say("rebuild", computer, figures, tables, as_json=options.json)
    return 0


def _grow(maker: LogMaker, logs: Path, out: Path, size: int, console: Console) -> list[RebuildTime]:
    """All of `size` logs, one more, and once more without a change."""
    workers = os.cpu_count() or 1
    _write(maker, logs, size, console)
    times = [_timed("all", logs, out, workers, console)]
    _write(maker, logs, size + 1, console)
    times.append(_timed("one more", logs, out, workers, console))
    times.append(_timed("no change", logs, out, workers, console))
    return times


def _write(maker: LogMaker, logs: Path, count: int, console: Console) -> None:
    there = len(list(logs.iterdir()))
    with bar("writing logs", count, console, min(there, count)) as advance:
        for number in range(there, count):
            maker.write(logs, number)
            advance()


def _timed(kind: str, logs: Path, out: Path, workers: int, console: Console) -> RebuildTime:
    began = time.perf_counter()
    done: Rebuild = rebuild([logs], out, workers, console)
    return RebuildTime(
        kind=kind,
        logs=len(done.manifest.logs),
        workers=workers,
        seconds=round(time.perf_counter() - began, 3),
        read_bytes=done.read_bytes,
        transitions=done.manifest.rows,
        shards_written=done.written,
    )


def _table(title: str, times: list[RebuildTime]) -> Table:
    table = Table(title=title, title_justify="left")
    for name in (
        "what",
        "logs",
        "workers",
        "seconds",
        "read",
        "MB/s",
        "transitions",
        "transitions/s",
        "shards written",
    ):
        table.add_column(name, justify="left" if name == "what" else "right")
    for it in times:
        table.add_row(
            it.kind,
            f"{it.logs:,}",
            str(it.workers),
            f"{it.seconds:.2f}",
            wording.size(it.read_bytes),
            f"{it.megabytes_per_second:.0f}",
            f"{it.transitions:,}",
            f"{it.transitions / it.seconds:,.0f}",
            str(it.shards_written),
        )
    return table
