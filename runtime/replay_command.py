"""`gi-log replay`: would the robot decide the same again?"""

import argparse
import math
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import Progress, TaskID
from rich.table import Table
from rich.text import Text

from grasping_invisible.data.errors import BadRequest, DataError
from grasping_invisible.data.log_commands import wording
from grasping_invisible.data.log_commands.output import console
from grasping_invisible.data.log_files import logs_at
from grasping_invisible.runtime.errors import GraspingError

if TYPE_CHECKING:
    from grasping_invisible.runtime.bundle import ModelBundle
    from grasping_invisible.runtime.replay import Difference, ReplayedDecision, ReplayResult

IDENTICAL, DIFFERENT, NOT_COMPARED = 0, 1, 2
_SHOWN = 4  # differing fields of one decision


def register(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the parser of `replay`."""
    parser = commands.add_parser(
        "replay",
        help="recompute every decision from the logged inputs and compare",
        description="Recompute every decision from the logged camera frame, memory, seed and settings, and compare "
        "every field with the logged one. Without a tolerance they must be equal to the last bit, which holds for the "
        "same ONNX Runtime on the same kind of processor.",
        epilog="exit codes: 0 identical, 1 different, 2 bad usage or input, or a log that cannot be compared, "
        "130 interrupted",
    )
    parser.add_argument("paths", type=Path, nargs="+", metavar="PATH", help="logs, or folders of them")
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
    # This takes a second to import, which other commands need not wait for.
    from grasping_invisible.runtime.bundle import load_bundle

    logs = logs_at(arguments.paths)
    try:
        bundle = load_bundle(arguments.models)
    except GraspingError as error:
        raise BadRequest(str(error)) from error
    with Progress(console=Console(stderr=True), transient=True, disable=not sys.stderr.isatty()) as progress:
        task = progress.add_task("deciding again", total=None)
        replay = partial(_replay, bundle=bundle, arguments=arguments, progress=progress, task=task)
        if len(logs) > 1 or arguments.paths[0].is_dir():
            return _many(logs, replay, arguments.tolerance)
        result = replay(logs[0])
    out = console()
    out.print(_table(result))
    for line in result.damage:
        out.print(Text(f"damage: {line}", "yellow"))
    for version in sorted(set(result.onnxruntime_versions) - {bundle.onnxruntime_version}):
        out.print(
            Text(
                f"logged with ONNX Runtime {version or 'unknown'}, replayed with {bundle.onnxruntime_version}", "yellow"
            )
        )
    out.print(_verdict(result, arguments.tolerance))
    return IDENTICAL if result.identical else DIFFERENT


def _replay(
    log: Path, bundle: "ModelBundle", arguments: argparse.Namespace, progress: Progress, task: TaskID
) -> "ReplayResult":
    """Replay one log. Raises `DataError`, also where nothing can be compared."""
    from grasping_invisible.runtime.replay import OtherModels, replay_log

    progress.reset(task, description=f"deciding {log.name} again", total=None)
    try:
        result = replay_log(
            log,
            bundle,
            tolerance=arguments.tolerance,
            bundle_sha256=None if arguments.force else bundle.sha256,
            on_decision=lambda done, total: progress.update(task, completed=done, total=total),
        )
    except GraspingError as error:
        hint = "; name those with --models, or compare all the same with --force"
        raise BadRequest(f"{error}{hint if isinstance(error, OtherModels) else ''}") from error
    if not result.decisions:
        raise BadRequest(f"{log} holds no decision to replay")
    if not result.checked:
        raise BadRequest(f"no decision of {log} could be checked: {result.decisions[0].unchecked}")
    return result


def _many(logs: list[Path], replay: Callable[[Path], "ReplayResult"], tolerance: float) -> int:
    """A line for each log and one for all."""
    table = Table("log", "decisions", "as logged", "different", "not checked", "", box=None)
    results: list[ReplayResult] = []
    for log in logs:
        try:
            result = replay(log)
        except DataError as error:
            table.add_row(Text(log.name), "-", "-", "-", "-", Text(str(error), "red"))
            continue
        results.append(result)
        total, checked = len(result.decisions), result.checked
        damage = Text(f"{len(result.damage)} damaged places" if result.damage else "", "yellow")
        different = Text(str(result.different), "red" if result.different else "")
        counts = str(total), str(checked - result.different), different, str(total - checked)
        table.add_row(Text(log.name), *counts, damage)
    out = console()
    out.print(table)
    out.print(_total(results, len(logs), tolerance))
    if not all(result.identical for result in results):
        return DIFFERENT
    return IDENTICAL if len(results) == len(logs) else NOT_COMPARED


def _total(results: "list[ReplayResult]", logs: int, tolerance: float) -> Text:
    decisions = sum(len(result.decisions) for result in results)
    checked = sum(result.checked for result in results)
    different = sum(result.different for result in results)
    counted = f"{len(results)} of {logs} logs, {checked} of {decisions} decisions compared {_how(tolerance)}"
    if different:
        return Text(f"{counted}: {different} not as logged", "bold red")
    return Text(f"{counted}: all as logged", "bold green" if len(results) == logs else "bold yellow")


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
    if result.identical:
        return Text(f"{counted}: all as logged, {_how(tolerance)}", "bold green")
    return Text(f"{counted}: {result.different} not as logged, compared {_how(tolerance)}", "bold red")


def _how(tolerance: float) -> str:
    return f"within {tolerance:g}" if tolerance else "exactly"


def _tolerance(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value >= 0):
        raise argparse.ArgumentTypeError(f"{text!r} is not a number from 0 on")
    return value
