"""`gi-log recover`: a truncated or damaged log to a valid one."""

import argparse
from pathlib import Path

from rich.text import Text

from grasping_invisible.data.log_commands.output import console
from grasping_invisible.data.log_recovery import recover


def register(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the parser of `recover`."""
    parser = commands.add_parser("recover", help="a truncated or damaged log to a valid one")
    parser.add_argument("file", type=Path, metavar="FILE")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="the new log; must not exist")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Write the new log and say what was saved and what was lost."""
    recovery = recover(arguments.file, arguments.out)
    out = console()
    out.print(Text(f"{recovery.messages} messages written to {arguments.out}"))
    for line in recovery.lost:
        out.print(Text(f"lost: {line}"))
    if not recovery.lost:
        out.print("nothing was lost: the log was complete")
    return 0
