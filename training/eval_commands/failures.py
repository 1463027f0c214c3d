"""`gi-eval failures`: why runs failed, counted from their logs."""

import argparse
from dataclasses import replace
from pathlib import Path

from rich.console import Console

from grasping_invisible.data.errors import BadLog, BadMessage
from grasping_invisible.data.log_files import logs_at
from grasping_invisible.data.progress import bar
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.training.failed_runs import Failure, Run, failure_of, read_runs


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
    """Write the tables and the pictures. Raises `BadInput` or `BadRequest`."""
    write_failures(options.logs, options.out, Console(stderr=True))


def write_failures(logs: list[Path], out: Path, console: Console) -> None:
    """Read logs, and folders of them, and write why their runs failed. Raises `BadInput` or `BadRequest`."""
    # It takes a second to import, which other commands need not wait for.
    from grasping_invisible.training.failure_report import draw_failures, failure_tables

    complaints: list[str] = []
    runs = _read(logs_at(logs), complaints, console)
    for line in complaints:
        console.print(line, highlight=False, markup=False)
    if not runs:
        raise BadInput("these logs hold no run")
    text = failure_tables(runs)
    out.mkdir(parents=True, exist_ok=True)
    (out / "failures.md").write_text(text, encoding="utf-8")
    draw_failures([failure for _, failure in runs if failure is not None], out / "failures.png")
    print(text)


def _read(files: list[Path], complaints: list[str], console: Console) -> list[tuple[Run, Failure | None]]:
    """Each run once, however many copies of it there are, with its failure; of one that did not fail, nothing else.

    `complaints` takes a line for each log that cannot be read or is damaged, whose runs ahead of the damage count.
    """
    found: dict[tuple[str, int], tuple[tuple[bool, bool, int], Run, Failure | None]] = {}
    with bar("reading logs", len(files), console) as advance:
        for file in files:
            damage: list[str] = []
            try:
                for run in read_runs(file, damage):
                    if run.key not in found or run.wholeness > found[run.key][0]:
                        failure = failure_of(run)
                        kept = replace(run, steps=()) if failure is None else run
                        found[run.key] = run.wholeness, kept, failure
            except BadLog as error:
                complaints.append(f"left out: {error}")
            except (BadMessage, BadInput) as error:
                damage.insert(0, str(error))
            if damage:
                complaints.append(f"damaged: {file}: {damage[0]}")
            advance()
    return [(run, failure) for _, run, failure in found.values()]
