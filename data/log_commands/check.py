"""`gi-log check`: is a log complete and consistent?"""

import argparse
from pathlib import Path

from rich.text import Text

from grasping_invisible.data.log_check import check_log
from grasping_invisible.data.log_commands.output import console, progress


def register(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the parser of `check`."""
    parser = commands.add_parser("check", help="complete? consistent? exit code 0 or 1")
    parser.add_argument("file", type=Path, metavar="FILE")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Print every problem; 0 when there is none, else 1."""
    out = console()
    with progress("checking", [arguments.file]) as told:
        checkup = check_log(arguments.file, told)
    for line in checkup.events:
        out.print(Text(line, "dim"))
    for line in (*checkup.problems, *checkup.losses):
        out.print(Text(line))
    if checkup.problems:
        return 1
    if checkup.losses:
        out.print(Text(f"{arguments.file}: sound, and as whole as its recovery could make it"))
    else:
        out.print(Text(f"{arguments.file}: complete and consistent"))
    return 0
