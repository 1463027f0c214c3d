"""Lines for a person, who may have left: a reader that has gone is no reason to end anything."""

import os
from contextlib import suppress
from typing import TextIO


def write_line(line: str, stream: TextIO) -> None:
    """Write and flush one line. Never raises on a stream whose reader has gone."""
    try:
        print(line, file=stream, flush=True)
    except OSError:
        let_go(stream)


def let_go(stream: TextIO) -> None:
    """Have all that is still written to `stream` go nowhere, also what it flushes when the process ends."""
    with suppress(OSError):  # also a stream that is no file
        nowhere = os.open(os.devnull, os.O_WRONLY)
        try:
            os.dup2(nowhere, stream.fileno())
        finally:
            os.close(nowhere)
