"""`gi-log relabel`: rewards, hindsight goals, classifier labels and success by today's rules and corrections."""

import argparse
from pathlib import Path

from rich.markup import escape
from rich.text import Text

from grasping_invisible.data.errors import DataError
from grasping_invisible.data.label_file import Relabelling, relabel
from grasping_invisible.data.labels import RULES
from grasping_invisible.data.log_commands.output import console
from grasping_invisible.data.log_files import logs_at
from grasping_invisible.data.progress import bar


def register(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the parser of `relabel`."""
    parser = commands.add_parser("relabel", help="write labels beside logs, by today's rules and corrections")
    parser.add_argument("paths", type=Path, nargs="+", metavar="PATH", help="logs, or folders of them")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Label every log; 1 where one could not be, after the others are done."""
    out = console()
    done: list[Relabelling] = []
    failed: list[str] = []
    logs = logs_at(arguments.paths)
    with bar("relabelling", len(logs), out) as advance:
        for log in logs:
            try:
                one = relabel(log)
            except DataError as error:
                failed.append(str(error))
            except OSError as error:
                failed.append(f"{error.filename or log}: {error.strerror}")
            else:
                done.append(one)
                _tell(one)
            advance()
    steps, usable = sum(one.steps for one in done), sum(one.usable for one in done)
    rules = ", ".join(f"{name} {version}" for name, version in RULES.items())
    out.print(f"{len(done)} logs, {steps} steps, {usable} of them teach; by the rules {rules}")
    out.print(f"{sum(one.corrected for one in done)} steps by people's corrections")
    for line in failed:
        out.print(Text(line, "red"))
    return 1 if failed else 0


def _tell(one: Relabelling) -> None:
    """What is worth a line; a log that is labelled as before is not."""
    out = console()
    name = escape(str(one.path))
    for line in one.judged_otherwise:
        out.print(f"{name}: {escape(line)}")
    if one.changed:
        changes = ", ".join(f"{what} in {count}" for what, count in sorted(one.changed.items()))
        out.print(f"{name}: other labels than before: {escape(changes)}")
    for line in one.damage:
        out.print(f"{name}: damaged: {escape(line)}")
