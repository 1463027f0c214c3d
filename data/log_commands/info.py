"""`gi-log info`: what a log is, when it was made, what it holds and how its run ended."""

import argparse
import sys
from pathlib import Path

import msgspec
from rich.console import Console
from rich.table import Table
from rich.text import Text

from grasping_invisible.data.health_events import health_events
from grasping_invisible.data.log_commands import wording
from grasping_invisible.data.log_commands.output import console
from grasping_invisible.data.log_summary import LogSummary, summarise
from grasping_invisible.data.shown_name import shown

_READ_FOR_HEALTH = 200_000_000  # bytes: heartbeats are in every chunk, and the rest of a log is told by its index


def register(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the parser of `info`."""
    parser = commands.add_parser("info", help="what, when, how long, topics, models, outcome")
    parser.add_argument("file", type=Path, metavar="FILE")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Print what describes one log."""
    summary = summarise(arguments.file)
    health = health_events(arguments.file, summary.begun_ns) if summary.bytes <= _READ_FOR_HEALTH else None
    if arguments.json:
        found = {**msgspec.to_builtins(summary), "path": shown(summary.path), "health": health}
        sys.stdout.write(msgspec.json.encode(found).decode() + "\n")
    else:
        _print(summary, health, console())
    return 0


def _print(summary: LogSummary, health: list[str] | None, out: Console) -> None:
    facts = Table.grid(padding=(0, 2))
    for name, value in _facts(summary):
        facts.add_row(Text(name, "bold"), Text(value))
    out.print(facts)
    topics = Table("topic", "type", "messages", "dropped", "lost on the link")
    for topic, content in summary.topics.items():
        dropped, lost = summary.dropped.get(topic, 0), summary.lost.get(topic, 0)
        topics.add_row(Text(topic), Text(content.type), str(content.messages), str(dropped or ""), str(lost or ""))
    out.print(topics)
    for line in health if health is not None else ["for the health of so long a log, see gi-log check"]:
        out.print(Text(line, "yellow"))
    for line in summary.damage:
        out.print(Text(f"damage: {line}", "red"))


def _facts(summary: LogSummary) -> list[tuple[str, str]]:
    state = "being written" if summary.being_written else "complete" if summary.complete else "not complete"
    parts = f" in {summary.parts} parts" if summary.parts > 1 else ""
    facts = [
        ("log", summary.path),
        ("state", f"{state}, {wording.size(summary.bytes)}{parts}"),
        ("begun", f"{wording.when(summary.begun_ns)} UTC"),
        ("length", wording.duration(summary.ended_ns - summary.begun_ns)),
        ("outcome", summary.outcome),
    ]
    if summary.run is not None:
        run = summary.run
        facts += [
            ("run", run.run_id),
            ("version", run.project_version),
            ("bundle", run.bundle_sha256),
            ("target", run.target),
            ("scene", f"{run.scene}, seed {run.seed}"),
            ("robot", run.robot),
        ]
    if summary.end is not None:
        end = summary.end
        facts += [
            ("motions", f"{end.motions}, target {'found' if end.found else 'not found'}"),
            ("decisions", f"p50 {end.decision_ms_p50:.1f} ms, p99 {end.decision_ms_p99:.1f} ms"),
        ]
    return facts
