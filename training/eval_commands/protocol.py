"""`gi-eval protocol`: every method on every suite, and all tables from it."""

import argparse
from pathlib import Path

from rich.console import Console

from grasping_invisible.training.eval_commands.failures import write_failures
from grasping_invisible.training.eval_commands.options import add_models, add_workers
from grasping_invisible.training.eval_commands.tables import write_tables
from grasping_invisible.training.evaluate import evaluate
from grasping_invisible.training.protocol import Protocol


def register(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the parser of `protocol`."""
    parser = commands.add_parser(
        "protocol",
        help="every method on every suite, and all tables",
        description="Run every method of the paper's comparison on its suites and make the tables and charts. "
        "What is done is kept in OUT/results: the same command goes on from there.",
    )
    add_models(parser)
    parser.add_argument("--depth-mask-models", type=Path, metavar="DIR", help="a bundle whose critic sees no colour")
    parser.add_argument("--color-models", type=Path, metavar="DIR", help="one made alike whose critic sees colour too")
    parser.add_argument("--agnostic-models", type=Path, metavar="DIR", help="a bundle for vpg and mask-vpg")
    parser.add_argument("--runs", type=int, help="of each scene (default: the full 50, 30 and 20)")
    parser.add_argument("--seed", type=int, default=0, help="another one gives other variations of the scenes")
    parser.add_argument("--log-dir", type=Path, metavar="DIR", help="keep our own runs' logs, say why they fail")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="for results, tables and charts")
    add_workers(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    """Measure what is left to measure, then write everything. Raises `GraspingError`."""
    console = Console(stderr=True)
    protocol = Protocol(
        out=options.out,
        models=options.models,
        depth_mask_models=options.depth_mask_models,
        color_models=options.color_models,
        agnostic_models=options.agnostic_models,
        runs=options.runs,
        seed=options.seed,
        log_dir=options.log_dir,
    )
    evaluations = list(protocol.evaluations())
    for evaluation in evaluations:  # nothing is run before all of it can be
        evaluation.measured()
    for evaluation in evaluations:
        evaluate(evaluation, options.workers, console)
    write_tables([options.out / "results"], options.out)
    if options.log_dir is not None:
        write_failures([options.log_dir], options.out, console)
