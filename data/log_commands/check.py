"""`gi-log check`: is a log complete and consistent?"""

import argparse
from pathlib import Path

from rich.text import Text

from grasping_invisible.data.log_check import problems_of
from grasping_invisible.data.log_commands.output import console


def register(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the parser of `check`."""
    parser = commands.add_parser("check", help="complete? consistent? exit code 0 or 1")
    parser.add_argument("file", type=Path, metavar="FILE")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Print every problem; 0 when there is none, else 1."""
    out = console()
    problems = problems_of(arguments.file)
    for problem in problems:
        out.print(Text(problem))
    if problems:
        return 1
    out.print(Text(f"{arguments.file}: complete and consistent"))
    return 0
