"""`gi-eval`: how often a bundle succeeds, on which scenes, in how many motions."""

import argparse
import sys
from pathlib import Path

import msgspec
from rich.console import Console
from rich.table import Table

from grasping_invisible.data.progress import bar
from grasping_invisible.runtime.bundle import load_bundle
from grasping_invisible.runtime.coordinator import COORDINATORS
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.runtime.explorer import EXPLORERS
from grasping_invisible.training.command import run_command
from grasping_invisible.training.evaluation import Trial, TrialResult, run_trials, trials_of
from grasping_invisible.training.evaluation_summary import Summary, summarise

DEFAULT_METHOD = "ours"


def main(arguments: list[str] | None = None) -> int:
    """Run `gi-eval`; its exit code: 0, 2 bad input, 130 interrupted (with --results the same command goes on)."""
    options = _parser().parse_args(arguments)
    return run_command("gi-eval", lambda: _run(options), "interrupted")


def _run(options: argparse.Namespace) -> None:
    console = Console(stderr=options.json)
    summary = _evaluate(options, console)
    console.print(_table(summary))
    if options.json:
        print(msgspec.json.encode(summary).decode())


def _evaluate(options: argparse.Namespace, console: Console) -> Summary:
    if options.runs < 1 or options.workers < 1 or options.seed < 0:
        raise BadInput("--runs and --workers must be at least 1, --seed at least 0")
    exploration, coordination = _methods(options.method)
    bundle = load_bundle(options.models).sha256
    trials = trials_of(options.suite, options.runs, options.seed)
    done = _stored(options.results, trials)
    left = [trial for trial in trials if (trial.name, trial.seed) not in done]
    with bar(f"{options.suite}, {options.method}", len(trials), console, len(done)) as advance:
        for result in run_trials(left, options.models, exploration, coordination, options.workers):
            done[result.scene, result.seed] = result
            _store(options.results, result)
            advance(f"{sum(item.success for item in done.values())} of {len(done)}")
    return summarise(list(done.values()), options.suite, options.method, options.runs, options.seed, bundle)


def _methods(method: str) -> tuple[str, str]:
    """Names of the exploration and the coordination method that a method stands for."""
    if method == DEFAULT_METHOD:
        return "explorer", "coordinator"
    if method in EXPLORERS:
        return method, "coordinator"
    if method in COORDINATORS:
        return "explorer", method
    raise BadInput(f"unknown method {method!r}; known: {', '.join((DEFAULT_METHOD, *EXPLORERS, *COORDINATORS))}")


def _stored(path: Path | None, trials: list[Trial]) -> dict[tuple[str, int], TrialResult]:
    """Results of these trials that an earlier, interrupted evaluation left."""
    if path is None or not path.is_file():
        return {}
    wanted = {(trial.name, trial.seed) for trial in trials}
    try:
        results = [msgspec.json.decode(line, type=TrialResult) for line in path.read_bytes().splitlines()]
    except msgspec.DecodeError as error:
        raise BadInput(f"{path} does not hold results: {error}") from None
    return {(item.scene, item.seed): item for item in results if (item.scene, item.seed) in wanted}


def _store(path: Path | None, result: TrialResult) -> None:
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("ab") as file:
            file.write(msgspec.json.encode(result) + b"\n")


def _table(summary: Summary) -> Table:
    low, high = summary.success_interval
    table = Table(
        title=f"{summary.suite}, {summary.method}: {summary.success_rate:.1%} ({low:.1%} to {high:.1%}), "
        f"{summary.motions_mean:.2f} motions"
    )
    for name in ("scene", "runs", "success", "95 % interval", "motions"):
        table.add_column(name, justify="left" if name == "scene" else "right")
    for scene, rates in summary.scenes.items():
        low, high = rates.success_interval
        table.add_row(
            scene,
            str(rates.runs),
            f"{rates.success_rate:.1%}",
            f"{low:.1%} to {high:.1%}",
            f"{rates.motions_mean:.2f} ± {rates.motions_std:.2f}",
        )
    for failure, count in summary.failures.items():
        table.caption = f"{table.caption or ''}{count} cut short: {failure}\n"
    return table


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="gi-eval", description="Measure how often a model bundle succeeds.")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    run = commands.add_parser("run", help="run a suite of scenes many times")
    run.add_argument("--suite", required=True, help="exploration, coordination, invisible, or scene files")
    run.add_argument("--method", default=DEFAULT_METHOD, help="the paper's, or one of its variants")
    run.add_argument("--models", type=Path, metavar="DIR", help="bundle to measure; the shipped one without")
    run.add_argument("--runs", type=int, default=10, help="of each scene")
    run.add_argument("--seed", type=int, default=0, help="another seed gives other variations of the scenes")
    run.add_argument("--workers", type=int, default=1, help="processes")
    run.add_argument("--results", type=Path, metavar="FILE", help="keep each run's result here, and go on from it")
    run.add_argument("--json", action="store_true", help="end stdout with one summary object")
    return parser


if __name__ == "__main__":
    sys.exit(main())
