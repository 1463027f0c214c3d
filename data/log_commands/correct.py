"""`gi-log correct`: say what came of a motion, where the rules have it wrong."""

import argparse
import getpass
from pathlib import Path

from rich.text import Text

from grasping_invisible.data.corrections import FIELDS, Correction, append_correction, check_step, value_of
from grasping_invisible.data.log_commands import wording
from grasping_invisible.data.log_commands.output import console
from grasping_invisible.data.log_storage import first_part
from grasping_invisible.data.steps import LABELLED_FROM, steps


def register(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the parser of `correct`."""
    parser = commands.add_parser("correct", help="note beside a log what really came of a motion")
    parser.add_argument("file", type=Path, metavar="FILE")
    parser.add_argument("--step", type=int, required=True, metavar="N", help="counted from 0, as in the log")
    parser.add_argument("--field", required=True, help=", ".join(FIELDS))
    parser.add_argument("--value", required=True, help="true or false, or a colour, grey or nothing")
    parser.add_argument("--run", dest="run_id", default="", metavar="ID", help="where the log holds several runs")
    parser.add_argument("--by", default=None, metavar="NAME", help="who says so; default: your user name")
    parser.add_argument("--note", default="", metavar="TEXT", help="why")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Check the correction against the log and add it to those beside it."""
    value_of(arguments.field, arguments.value)
    log = first_part(arguments.file)
    item = Correction(
        run_id=arguments.run_id,
        step=arguments.step,
        field=arguments.field,
        value=arguments.value,
        by=_user() if arguments.by is None else arguments.by,
        note=arguments.note,
    )
    kinds = {
        (step.start.run_id if step.start else "", step.decision.step): wording.kind(step.decision.kind)
        for step in steps(log, LABELLED_FROM)
    }
    check_step(item, kinds)
    path = append_correction(log, item)
    console().print(Text(f"step {item.step}: {item.field} is {item.value}; kept in {path}"))
    return 0


def _user() -> str:
    try:
        return getpass.getuser()
    except (KeyError, OSError):  # a process without a name, as in a bare container
        return ""
