"""`gi-eval compare`: is a bundle or a method better than another?"""

import argparse
from pathlib import Path

import msgspec
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.training.comparison import Comparison, Pairs, compare
from grasping_invisible.training.eval_commands.options import add_workers, number, share, success, table_console
from grasping_invisible.training.evaluate import Evaluation, evaluate
from grasping_invisible.training.evaluation import TrialResult
from grasping_invisible.training.evaluation_methods import OURS
from grasping_invisible.training.stored_results import Measured, check_counted_once, check_one_task, read_results


def register(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the parser of `compare`."""
    parser = commands.add_parser(
        "compare",
        help="two bundles on the same runs, or two files of results",
        description="Compare two bundles on the same scenes and seeds, or two files that gi-eval run --results made. "
        "Runs are compared in pairs of one scene and seed; differences are second less first.",
    )
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE", help="two files of results, instead of --models")
    parser.add_argument("--models", type=Path, action="append", metavar="DIR", default=[], help="a bundle; give two")
    parser.add_argument("--suite", help="with --models: exploration, coordination, invisible, or scene files")
    parser.add_argument("--method", default=OURS, help="with --models: what both decide by")
    parser.add_argument("--runs", type=int, default=10, help="with --models: of each scene")
    parser.add_argument("--seed", type=int, default=0, help="with --models: another one varies the scenes otherwise")
    parser.add_argument("--results", type=Path, metavar="DIR", help="with --models: keep results, go on from them")
    parser.add_argument("--json", action="store_true", help="end stdout with one object")
    add_workers(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    """Compare and print a table. Raises `GraspingError`."""
    console = table_console(options.json)
    if (len(options.files), len(options.models)) not in ((2, 0), (0, 2)):
        raise BadInput("compare needs two files of results, or --models twice")
    sides = _stored(options.files) if options.files else _measured(options, console)
    (first, ones), (second, others) = sides
    comparison = compare(first.suite, (str(first), str(second)), ones, others)
    console.print(_table(comparison))
    if options.json:
        print(msgspec.json.encode(comparison).decode())


def _stored(files: list[Path]) -> list[tuple[Measured, list[TrialResult]]]:
    sides, both = [], []
    for file in files:
        stored = read_results(file)
        both += stored
        measured = {item.measured for item in stored}
        if len(measured) != 1:
            raise BadInput(f"{file} holds results of {len(measured)} evaluations, not of one")
        check_counted_once(stored, str(file))
        sides.append((measured.pop(), [item.result for item in stored]))
    (first, _), (second, _) = sides
    if first.suite != second.suite:
        raise BadInput(f"the files hold results of different suites: {first.suite} and {second.suite}")
    check_one_task(both, "the two files")
    return sides


def _measured(options: argparse.Namespace, console: Console) -> list[tuple[Measured, list[TrialResult]]]:
    if options.suite is None:
        raise BadInput("--models needs --suite")
    sides = []
    for models in options.models:
        evaluation = Evaluation(options.suite, options.method, options.runs, options.seed, models)
        measured = evaluation.measured()
        if options.results is not None:
            file = options.results / f"{Path(options.suite).stem}-{options.method}-{measured.bundle_sha256[:12]}.jsonl"
            evaluation = Evaluation(options.suite, options.method, options.runs, options.seed, models, results=file)
        sides.append((measured, evaluate(evaluation, options.workers, console)))
    return sides


def _table(comparison: Comparison) -> Table:
    table = Table(
        title=escape(f"1: {comparison.first}\n2: {comparison.second}"),
        caption=f"{comparison.overall.pairs} pairs of runs: {comparison.verdict}"
        + (f"; {comparison.unpaired} runs have no counterpart" if comparison.unpaired else ""),
    )
    for name in ("scene", "pairs", "success 1", "success 2", "difference, 95 %", "motions 1", "2", "difference, 95 %"):
        table.add_column(name, justify="left" if name == "scene" else "right")
    for scene, pairs in comparison.scenes.items():
        table.add_row(escape(scene), *_cells(pairs))
    table.add_section()
    table.add_row("all", *_cells(comparison.overall))
    return table


def _cells(pairs: Pairs) -> list[str]:
    return [
        str(pairs.pairs),
        success(pairs.first),
        success(pairs.second),
        share(pairs.success_difference, pairs.success_interval),
        f"{pairs.first.motions_mean:.2f}",
        f"{pairs.second.motions_mean:.2f}",
        number(pairs.motions_difference, pairs.motions_interval),
    ]
