"""`gi-eval note`: stored results, summed up in the manifest of the bundle that they were measured with."""

import argparse
from pathlib import Path

from grasping_invisible.runtime.bundle import shipped_models
from grasping_invisible.training.bundle_evaluations import note_evaluations
from grasping_invisible.training.eval_commands.options import add_models
from grasping_invisible.training.stored_results import read_all_results


def register(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the parser of `note`."""
    parser = commands.add_parser("note", help="write what was measured with a bundle into its manifest")
    parser.add_argument("results", nargs="+", type=Path, metavar="RESULTS", help="files of results, or folders of them")
    add_models(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    """Note the results of the bundle. Raises `BadInput` or `BundleError`."""
    folder = shipped_models() if options.models is None else options.models
    for item in note_evaluations(folder, read_all_results(options.results)):
        print(
            f"{item.suite}, {item.method}: {item.success_rate:.1%} of {item.runs} runs"
            f" in {item.motions_mean:.2f} motions on average"
        )
