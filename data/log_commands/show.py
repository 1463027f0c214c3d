"""`gi-log show`: the decisions of a run as a readable story."""

import argparse
import math
from pathlib import Path

from rich.text import Text

from grasping_invisible.data.log_commands import wording
from grasping_invisible.data.log_commands.output import console
from grasping_invisible.data.log_summary import LogSummary, summarise
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.steps import steps


def register(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the parser of `show`."""
    parser = commands.add_parser("show", help="the decisions of a run as a readable story")
    parser.add_argument("file", type=Path, metavar="FILE")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Print what was seen, decided and achieved, step by step."""
    out = console()
    summary = summarise(arguments.file)
    out.print(Text(_opening(summary), "bold"))
    for step in steps(arguments.file):
        out.print(_decided(step.decision))
        out.print(Text(f"     {wording.came_of(step)}", "dim"))
    out.print(Text(_ending(summary), "bold"))
    return 0


def _opening(summary: LogSummary) -> str:
    if summary.run is None:
        return f"{summary.path}: the start of the run is not in the log"
    run = summary.run
    return (
        f"{wording.when(summary.begun_ns)} UTC: find and grasp {run.target or 'the target'} in "
        f"{run.scene or 'an unnamed scene'}, seed {run.seed}, bundle {run.bundle_sha256[:8] or '-'}"
    )


def _decided(decision: gi.Decision) -> Text:
    seen = f"target seen, {decision.target_pixels} pixels" if decision.target_pixels else "target not seen"
    place = f"({decision.position.x:.3f}, {decision.position.y:.3f}) m at {wording.degrees(decision.yaw)}"
    taken = sum(stage.milliseconds for stage in decision.stages)
    line = Text(f"{decision.step + 1:3}. ")
    line.append(f"{decision.policy or 'unknown policy'}: {wording.kind(decision.kind)}", "bold")
    line.append(f" at {place}, value {decision.value:.2f}; {seen}")
    if not math.isnan(decision.grasp_probability) and decision.target_pixels:
        line.append(f"; grasp now {decision.grasp_probability:.0%}")
    line.append(f"; {taken:.0f} ms")
    if decision.why:
        line.append(f"\n     {decision.why}")
    return line


def _ending(summary: LogSummary) -> str:
    if summary.end is None:
        return "the log ends before the run does" + (": it is being written" if summary.being_written else "")
    end = summary.end
    how = "target grasped" if end.grasped else f"target not grasped ({end.ended_because})"
    return f"{how} after {end.motions} motion{'' if end.motions == 1 else 's'}"
