"""`gi-eval`: how often a bundle succeeds, on which scenes, in how many motions, and why it fails."""

import argparse
import sys

from grasping_invisible.data.command import run_command
from grasping_invisible.runtime.errors import EXPECTED
from grasping_invisible.training.eval_commands import compare, failures, note, protocol, run, tables


def main(arguments: list[str] | None = None) -> int:
    """Run `gi-eval`; its exit code: 0, 2 bad input, 3 simulator, 70 a fault of ours, 130 interrupted.

    With --results the same command goes on after 3 and 130.
    """
    options = _parser().parse_args(arguments)

    def body() -> int:
        options.run(options)
        return 0

    return run_command("gi-eval", body, EXPECTED, "interrupted")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="gi-eval", description="Measure how often a model bundle succeeds, and why not."
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for command in (run, compare, protocol, tables, note, failures):
        command.register(commands)
    return parser


if __name__ == "__main__":
    sys.exit(main())
