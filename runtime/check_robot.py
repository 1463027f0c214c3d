"""`gi-robot`: does a robot keep the protocol?"""

import argparse
import sys
from pathlib import Path

from grasping_invisible.data.command import run_command
from grasping_invisible.runtime.errors import GraspingError
from grasping_invisible.runtime.interruption import bounded, exit_at_once_on_signals


def main(arguments: list[str] | None = None) -> int:
    """Run the command; its exit code is documented in its help."""
    exit_at_once_on_signals()
    options = _parser().parse_args(arguments)
    return run_command("gi-robot", lambda: _check(options), (GraspingError,), signals=bounded)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="gi-robot",
        description="Look at a robot on the link before trusting it with a run.",
        epilog="Exit codes: 0 all checks passed; 1 at least one failed; 2 bad usage or bad input; "
        "3 no robot is reached; 70 a fault of this program; 130 interrupted.",
    )
    verbs = parser.add_subparsers(required=True, metavar="VERB")
    check = verbs.add_parser("check", help="whether a robot keeps the protocol; it does not move unless told to")
    check.add_argument("locator", help="where the robot is, such as tcp/127.0.0.1:7447")
    check.add_argument("--move", action="store_true", help="also send the arm home, and ask for a push out of bounds")
    check.add_argument("--models", type=Path, metavar="DIR", help="whose segmenter looks (default: the shipped ones)")
    check.add_argument("--config", type=Path, metavar="FILE", help="TOML; the workspace and the link's deadlines")
    return parser


def _check(options: argparse.Namespace) -> int:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from grasping_invisible.runtime.bundle import load_bundle
    from grasping_invisible.runtime.config import Config, load_config
    from grasping_invisible.runtime.robot_checks import check_robot

    config = Config() if options.config is None else load_config(options.config)
    bundle = load_bundle(options.models, config.models.threads)
    checks = check_robot(options.locator, config.link, config.workspace.workspace(), bundle, move=options.move)
    table = Table("check", "result", "detail")
    for check in checks:
        result = {True: "[green]passed", False: "[red]failed", None: "[yellow]note"}[check.passed]
        table.add_row(check.name, result, Text(check.detail))  # a robot's own words are no markup
    Console(soft_wrap=False).print(table)
    return 1 if any(check.passed is False for check in checks) else 0


if __name__ == "__main__":
    sys.exit(main())
