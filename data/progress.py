"""Progress with the time that is left: a bar on a terminal, now and then a line in a file."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

LINE_EVERY = 60.0  # seconds, where there is no terminal

Advance = Callable[..., None]


@contextmanager
def bar(title: str, total: int, console: Console, done: int = 0) -> Iterator[Advance]:
    """Progress over `total` units of work; yields a function that counts one more and may show a note."""
    if not console.is_terminal:
        yield _lines(title, total, console, done)
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        TextColumn("{task.fields[note]}"),
    )
    with Progress(*columns, console=console) as progress:
        task = progress.add_task(title, total=total, completed=done, note="")

        def advance(note: str | None = None) -> None:
            progress.advance(task)
            if note is not None:
                progress.update(task, note=note)

        yield advance


def _lines(title: str, total: int, console: Console, done: int) -> Advance:
    """Prints a line a minute, and one at the end."""
    start = last = time.monotonic()
    count, latest = done, ""

    def advance(note: str | None = None) -> None:
        nonlocal count, last, latest
        count += 1
        latest = latest if note is None else note
        now = time.monotonic()
        if now - last >= LINE_EVERY or count == total:
            last = now
            left = (now - start) / (count - done) * (total - count)
            console.print(f"{title} {count}/{total}, {left / 60:.0f} min left {latest}", highlight=False)

    return advance
