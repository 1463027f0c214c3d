"""Where commands print: a terminal as wide as it is, a pipe wide enough that no table is cut."""

import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from grasping_invisible.data.log_storage import parts_of

_PIPE_WIDTH = 240
_LONG_BYTES = 200_000_000  # to read; less is done before one has looked

Told = Callable[[int, int], None]  # how much is done of how much


def console() -> Console:
    """A console on standard output that leaves numbers and paths uncoloured."""
    return Console(highlight=False, width=None if sys.stdout.isatty() else _PIPE_WIDTH)


@contextmanager
def progress(title: str, logs: Iterable[Path]) -> Iterator[Told]:
    """How far a command is and what time is left, on a terminal and where there is much to read."""
    shown = sys.stderr.isatty() and sum(_size(log) for log in logs) >= _LONG_BYTES
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True, disable=not shown) as bar:
        task = bar.add_task(title, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def _size(log: Path) -> int:
    return sum(part.stat().st_size for part in parts_of(log) if part.exists())
