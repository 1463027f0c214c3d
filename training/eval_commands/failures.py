"""`gi-eval failures`: why runs failed, counted from their logs."""

import argparse
from dataclasses import replace
from pathlib import Path

from rich.console import Console

from grasping_invisible.data.errors import BadLog
from grasping_invisible.data.progress import bar
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.training.failed_runs import Failure, Run, failure_of, read_runs
from grasping_invisible.training.given_files import files_at


def register(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the parser of `failures`."""
    parser = commands.add_parser(
        "failures",
        help="why runs failed, counted from their logs",
        description="Give every failed run one cause, from its log and ground truth, and show a picture of each.",
    )
    parser.add_argument("logs", nargs="+", type=Path, metavar="LOG", help="logs, or folders of them")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="for failures.md and failures.png")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    """Write the tables and the pictures. Raises `BadInput`."""
    write_failures(options.logs, options.out, Console(stderr=True))


def write_failures(logs: list[Path], out: Path, console: Console) -> None:
    """Read logs, and folders of them, and write why their runs failed. Raises `BadInput`."""
    # It takes a second to import, which other commands need not wait for.
    from grasping_invisible.training.failure_report import draw_failures, failure_tables

    runs: list[tuple[Run, Failure | None]] = []
    unreadable: list[str] = []
    files = files_at(logs, "logs", "**/*.mcap")
    with bar("reading logs", len(files), console) as advance:
        for file in files:
            try:
                runs += [_looked_into(one) for one in read_runs(file)]
            except BadLog as error:
                unreadable.append(str(error))
            advance()
    for line in unreadable:
        console.print(f"left out: {line}", highlight=False)
    if not runs:
        raise BadInput("these logs hold no run with a decision")
    text = failure_tables(runs)
    out.mkdir(parents=True, exist_ok=True)
    (out / "failures.md").write_text(text, encoding="utf-8")
    draw_failures([failure for _, failure in runs if failure is not None], out / "failures.png")
    print(text)


def _looked_into(run: Run) -> tuple[Run, Failure | None]:
    """A run and its failure; of one that did not fail, nothing else is wanted."""
    failure = failure_of(run)
    return (replace(run, steps=()) if failure is None else run), failure
