"""`gi-log ls`: the logs of a folder as a table."""

import argparse
from datetime import UTC, datetime
from pathlib import Path

from rich.table import Column, Table
from rich.text import Text

from grasping_invisible.data.errors import BadLog, BadRequest
from grasping_invisible.data.log_commands import wording
from grasping_invisible.data.log_commands.output import console, progress
from grasping_invisible.data.log_files import logs_in
from grasping_invisible.data.log_summary import LogSummary, summarise
from grasping_invisible.data.shown_name import shown


def register(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the parser of `ls`."""
    parser = commands.add_parser("ls", help="a table of the logs in a folder and below")
    parser.add_argument("folder", type=Path, metavar="DIR")
    parser.add_argument("--outcome", help="only runs that ended so: grasped, budget, unfinished, ...")
    parser.add_argument("--target", help="only runs with this target colour")
    parser.add_argument("--since", type=_moment, metavar="DATE", help="only logs begun at or after, ISO 8601, UTC")
    parser.add_argument("--until", type=_moment, metavar="DATE", help="only logs begun before, ISO 8601, UTC")
    parser.add_argument("--bundle", metavar="SHA", help="only runs whose bundle hash begins so")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Print a table of the logs that pass the filters, oldest first; unreadable files are named below it."""
    folder: Path = arguments.folder
    if not folder.is_dir():
        raise BadRequest(f"{folder} is not a folder")
    found: list[LogSummary] = []
    unreadable: list[str] = []
    logs = logs_in(folder)
    with progress("looking at logs", logs) as told:
        for number, path in enumerate(logs, 1):
            try:
                summary = summarise(path)
            except BadLog as error:
                unreadable.append(str(error))
                continue
            if _passes(summary, arguments):
                found.append(summary)
            told(number, len(logs))
    out = console()
    if found:
        out.print(_table(sorted(found, key=lambda summary: summary.begun_ns), folder))
    out.print(f"{len(found)} logs, {wording.size(sum(summary.bytes for summary in found))}")
    for line in unreadable:
        out.print(Text(line, "red"))
    return 0


def _passes(summary: LogSummary, wanted: argparse.Namespace) -> bool:
    if wanted.outcome is not None and summary.outcome != wanted.outcome:
        return False
    if wanted.since is not None and summary.begun_ns < wanted.since:
        return False
    if wanted.until is not None and summary.begun_ns >= wanted.until:
        return False
    if wanted.target is not None and (summary.run is None or summary.run.target != wanted.target):
        return False
    return wanted.bundle is None or (summary.run is not None and summary.run.bundle_sha256.startswith(wanted.bundle))


def _table(summaries: list[LogSummary], folder: Path) -> Table:
    table = Table(
        Column("log", overflow="fold"),
        "begun (UTC)",
        "length",
        "scene",
        "seed",
        "target",
        "bundle",
        "outcome",
        "motions",
        "size",
    )
    for summary in summaries:
        run, end = summary.run, summary.end
        table.add_row(
            Text(shown(str(Path(summary.path).relative_to(folder)))),
            wording.when(summary.begun_ns),
            wording.duration(summary.ended_ns - summary.begun_ns),
            Text(run.scene if run else "-"),
            str(run.seed) if run else "-",
            Text(run.target if run else "-"),
            Text(run.bundle_sha256[:8] if run else "-"),
            Text("being written" if summary.being_written else summary.outcome),
            str(end.motions) if end else "-",
            wording.size(summary.bytes) + ("" if summary.complete else " !"),
        )
    return table


def _moment(text: str) -> int:
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a date such as 2025-01-31 or 2025-01-31T12:00") from None
    if moment.tzinfo is None:
        moment = moment.replace(tzinfo=UTC)
    return int(moment.timestamp()) * 1_000_000_000
