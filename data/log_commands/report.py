"""`gi-log report`: a run as one HTML file."""

import argparse
from pathlib import Path

from rich.text import Text

from grasping_invisible.data.errors import BadRequest
from grasping_invisible.data.log_commands import wording
from grasping_invisible.data.log_commands.output import console, progress
from grasping_invisible.data.log_storage import parts_of


def register(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the parser of `report`."""
    parser = commands.add_parser("report", help="the run as one HTML file, with pictures")
    parser.add_argument("file", type=Path, metavar="FILE")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE.html", help="written over if it is there")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Write the report; it opens in a browser without a network."""
    from grasping_invisible.data.report import write_report  # its libraries are for no other command

    out: Path = arguments.out
    if out.exists() and any(part.exists() and part.samefile(out) for part in parts_of(arguments.file)):
        raise BadRequest(f"{out} is the log itself; name another file for the report")
    with progress("reading and drawing", [arguments.file]) as told:
        count = write_report(arguments.file, out, told)
    console().print(Text(f"{count} step{'' if count == 1 else 's'}, {wording.size(out.stat().st_size)}: {out}"))
    return 0
