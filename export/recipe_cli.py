"""`gi-recipe`: make the models from nothing, by the commands that one could give one after another."""

import argparse
import os
import sys
from pathlib import Path

from rich.console import Console

from grasping_invisible.data.command import run_command
from grasping_invisible.export.recipe import FINAL, load_recipe, stages_of
from grasping_invisible.export.recipe_run import RECORD, carry_out, summary
from grasping_invisible.runtime.errors import EXPECTED, BadInput


def main(arguments: list[str] | None = None) -> int:
    """Run `gi-recipe`; returns its exit code: 0, that of the command that failed, 130 interrupted (goes on again)."""
    options = _parser().parse_args(arguments)
    return run_command("gi-recipe", lambda: _run(options), EXPECTED, "interrupted; the same command goes on from here")


def _run(options: argparse.Namespace) -> int:
    if options.workers < 1:
        raise BadInput(f"--workers must be at least 1, not {options.workers}")
    console = Console()
    code = carry_out(stages_of(load_recipe(options.scale, options.recipe)), options.out, options.workers, console)
    if code == 0:
        for line in summary(options.out):
            console.print(line, highlight=False)
        console.print(f"bundle in {options.out / FINAL}, times in {options.out / RECORD}", highlight=False)
    return code


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="gi-recipe",
        description="Make the models from nothing by the project's other commands: renders, collections, datasets, "
        "trainings, exports. Started again it goes on where it stopped.",
    )
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder of everything that is made")
    parser.add_argument("--scale", default="full", help="full: makes models from nothing; tiny: to see that it works")
    parser.add_argument("--recipe", type=Path, metavar="FILE", help="numbers of your own, in the form of recipe.toml")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="processes of parallel stages")
    return parser


if __name__ == "__main__":
    sys.exit(main())
