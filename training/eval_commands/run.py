"""`gi-eval run`: a suite of scenes many times."""

import argparse
from pathlib import Path

import msgspec
from rich.markup import escape
from rich.table import Table

from grasping_invisible.training.eval_commands.options import (
    add_models,
    add_run_options,
    number,
    success,
    table_console,
)
from grasping_invisible.training.evaluate import Evaluation, evaluate
from grasping_invisible.training.evaluation_summary import Summary, summarise


def register(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the parser of `run`."""
    parser = commands.add_parser("run", help="run a suite of scenes many times")
    add_run_options(parser)
    add_models(parser)
    parser.add_argument("--name", help="what tables call it (default: as the method)")
    parser.add_argument("--results", type=Path, metavar="FILE", help="keep each run's result here, and go on from it")
    parser.add_argument("--log-dir", type=Path, metavar="DIR", help="keep each run's log below this folder")
    parser.add_argument("--json", action="store_true", help="end stdout with one summary object")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    """Evaluate and print a table. Raises `GraspingError`."""
    console = table_console(options.json)
    evaluation = Evaluation(
        options.suite,
        options.method,
        options.runs,
        options.seed,
        options.models,
        options.name,
        options.results,
        options.log_dir,
    )
    results = evaluate(evaluation, options.workers, console)
    summary = summarise(results, evaluation.measured(), options.runs, options.seed)
    console.print(_table(summary))
    if options.json:
        print(msgspec.json.encode(summary).decode())


def _table(summary: Summary) -> Table:
    table = Table(
        title=f"{escape(f'{summary.suite}, {summary.name}')}: {success(summary)}, "
        f"{number(summary.motions_mean, summary.motions_interval)} motions"
    )
    for name in ("scene", "runs", "success, 95 %", "motions, 95 %", "confirmed by ground truth"):
        table.add_column(name, justify="left" if name == "scene" else "right")
    for scene, rates in summary.scenes.items():
        table.add_row(
            escape(scene),
            str(rates.runs),
            success(rates),
            number(rates.motions_mean, rates.motions_interval),
            f"{rates.confirmed_rate:.0%}",
        )
    for failure, count in summary.failures.items():
        table.caption = f"{table.caption or ''}{count} cut short: {escape(failure)}\n"
    return table
