"""`gi-log recover`: a truncated or damaged log to a valid one."""

import argparse
from pathlib import Path

from rich.text import Text

from grasping_invisible.data.log_commands.output import console, progress
from grasping_invisible.data.log_recovery import recover


def register(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the parser of `recover`."""
    parser = commands.add_parser("recover", help="a truncated or damaged log, and all its parts, to one valid file")
    parser.add_argument("file", type=Path, metavar="FILE")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="the new log; must not exist")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Write the new log and say what was saved and what was lost."""
    with progress("recovering", [arguments.file]) as told:
        recovery = recover(arguments.file, arguments.out, told)
    out = console()
    parts = f" of {recovery.parts} parts" if recovery.parts > 1 else ""
    out.print(Text(f"{recovery.messages} messages{parts} written to {arguments.out}"))
    for line in recovery.lost:
        out.print(Text(f"lost: {line}"))
    if not recovery.lost:
        out.print("nothing was lost: the log was complete")
    return 0
