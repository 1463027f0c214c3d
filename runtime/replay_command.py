"""`gi-log replay`: would the robot decide the same again?"""

import argparse
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import Progress
from rich.table import Table
from rich.text import Text

from grasping_invisible.data.errors import BadRequest
from grasping_invisible.data.log_commands import wording
from grasping_invisible.data.log_commands.output import console
from grasping_invisible.runtime.errors import GraspingError

if TYPE_CHECKING:
    from grasping_invisible.runtime.replay import Difference, ReplayedDecision, ReplayResult

IDENTICAL, DIFFERENT = 0, 1
_SHOWN = 4  # differing fields of one decision


def register(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the parser of `replay`."""
    parser = commands.add_parser(
        "replay",
        help="recompute every decision from the logged inputs and compare",
        description="Recompute every decision from the logged camera frame, memory, seed and settings, and compare "
        "every field with the logged one. Without a tolerance they must be equal to the last bit, which holds for the "
        "same ONNX Runtime on the same kind of processor.",
        epilog="exit codes: 0 identical, 1 different, 2 bad usage or input, or nothing to compare, 130 interrupted",
    )
    parser.add_argument("file", type=Path, metavar="FILE")
    parser.add_argument("--models", type=Path, metavar="DIR", help="a model bundle (default: the shipped one)")
    parser.add_argument("--force", action="store_true", help="also with other models than those of the log")
    parser.add_argument(
        "--tolerance",
        type=_tolerance,
        default=0.0,
        metavar="X",
        help="how far numbers that are not whole may be off (default: 0; the largest Q values are about 1)",
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Replay, print a table, and say whether all is as logged. Raises `DataError`."""
    # These take a second to import, which other commands need not wait for.
    from grasping_invisible.runtime.bundle import load_bundle
    from grasping_invisible.runtime.replay import OtherModels, read_decisions, replay_log

    logged = read_decisions(arguments.file)
    if not logged.decisions:
        raise BadRequest(f"{arguments.file} holds no decision to replay")
    try:
        bundle = load_bundle(arguments.models)
        with Progress(console=Console(stderr=True), transient=True, disable=not sys.stderr.isatty()) as progress:
            task = progress.add_task("deciding again", total=len(logged.decisions))
            result = replay_log(
                arguments.file,
                bundle,
                tolerance=arguments.tolerance,
                bundle_sha256=None if arguments.force else bundle.sha256,
                on_decision=lambda _: progress.advance(task),
            )
    except GraspingError as error:
        hint = "; name those with --models, or compare all the same with --force"
        raise BadRequest(f"{error}{hint if isinstance(error, OtherModels) else ''}") from error
    out = console()
    out.print(_table(result))
    for line in result.damage:
        out.print(Text(f"damage: {line}", "yellow"))
    for version in sorted({start.onnxruntime_version for start in logged.starts} - {bundle.onnxruntime_version}):
        out.print(
            Text(
                f"logged with ONNX Runtime {version or 'unknown'}, replayed with {bundle.onnxruntime_version}", "yellow"
            )
        )
    if not result.checked:
        raise BadRequest(f"no decision of {arguments.file} could be checked: {result.decisions[0].unchecked}")
    out.print(_verdict(result, arguments.tolerance))
    return IDENTICAL if result.identical else DIFFERENT


def _table(result: "ReplayResult") -> Table:
    table = Table("step", "policy", "motion", "value", "replayed", "what differs: logged, recomputed", box=None)
    for replayed in result.decisions:
        decision = replayed.logged
        table.add_row(
            str(decision.step),
            Text(decision.policy),
            wording.kind(decision.kind),
            f"{decision.value:.4f}",
            _result(replayed),
            Text(replayed.unchecked or "; ".join(_different(replayed))),
        )
    return table


def _result(replayed: "ReplayedDecision") -> Text:
    if replayed.unchecked:
        return Text("not checked", "yellow")
    return Text("different", "red") if replayed.differences else Text("identical", "green")


def _different(replayed: "ReplayedDecision") -> list[str]:
    shown = [_line(difference) for difference in replayed.differences[:_SHOWN]]
    rest = len(replayed.differences) - len(shown)
    return [*shown, f"and {rest} more"] if rest else shown


def _line(difference: "Difference") -> str:
    return f"{difference.field} {_value(difference.logged)}, {_value(difference.recomputed)}"


def _value(value: object) -> str:
    if isinstance(value, str):
        return repr(value if len(value) <= 40 else f"{value[:39]}…")
    return "nothing" if value is None else f"{value!r}"


def _verdict(result: "ReplayResult", tolerance: float) -> Text:
    checked, total = result.checked, len(result.decisions)
    decisions = f"decision{'' if total == 1 else 's'}"
    left = f"{decisions} that could be read" if result.damage else decisions
    counted = f"{total} {left}" if checked == total else f"{checked} of {total} {left} could be checked"
    how = f"within {tolerance:g}" if tolerance else "exactly"
    if result.identical:
        return Text(f"{counted}: all as logged, {how}", "bold green")
    return Text(f"{counted}: {result.different} not as logged, compared {how}", "bold red")


def _tolerance(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value >= 0):
        raise argparse.ArgumentTypeError(f"{text!r} is not a number from 0 on")
    return value
