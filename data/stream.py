"""Lines for a person, who may have left: a reader that has gone is no reason to end anything."""

import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from typing import IO, Any, TextIO


@contextmanager
def readers_may_leave() -> Iterator[None]:
    """Inside, what is printed to stdout or stderr after its reader has gone goes nowhere, and raises nothing.

    Whoever prints would otherwise end there with the work half done: `print` by `BrokenPipeError`, rich by an exit code
    of its own. Other errors of writing are raised, at the latest at the end of the block.
    """
    with redirect_stdout(_lasting(sys.stdout)), redirect_stderr(_lasting(sys.stderr)):
        try:
            yield
        finally:
            print(end="", flush=True)


def write_line(line: str, stream: IO[Any]) -> None:
    """Write and flush one line. Never raises on a stream whose reader has gone."""
    try:
        print(line, file=stream, flush=True)
    except OSError:
        let_go(stream)


def let_go(stream: IO[Any]) -> None:
    """Have all that is still written to `stream` go nowhere, also what it flushes when the process ends."""
    with suppress(OSError):  # also a stream that is no file
        nowhere = os.open(os.devnull, os.O_WRONLY)
        try:
            os.dup2(nowhere, stream.fileno())
        finally:
            os.close(nowhere)


def _lasting(stream: TextIO) -> TextIO:
    """A standard stream that outlives its reader; any other, such as a test's, as it is."""
    if not isinstance(stream, io.TextIOWrapper) or stream not in (sys.__stdout__, sys.__stderr__):
        return stream
    output = _Output(stream.fileno(), "w", closefd=False)
    return io.TextIOWrapper(
        output if stream.write_through else io.BufferedWriter(output),
        stream.encoding,
        stream.errors,
        line_buffering=stream.line_buffering,
        write_through=stream.write_through,
    )


class _Output(io.FileIO):
    """A file that is let go of when its reader has gone."""

    def write(self, data: Any, /) -> int:
        try:
            return super().write(data)
        except BrokenPipeError:
            let_go(self)
            return super().write(data)
