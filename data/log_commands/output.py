"""Where commands print: a terminal as wide as it is, a pipe wide enough that no table is cut."""

import sys

from rich.console import Console

_PIPE_WIDTH = 240


def console() -> Console:
    """A console on standard output that leaves numbers and paths uncoloured."""
    return Console(highlight=False, width=None if sys.stdout.isatty() else _PIPE_WIDTH)
