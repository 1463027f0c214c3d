"""Options that several subcommands share, and how rates are written."""

import argparse
import os
import sys
from pathlib import Path

from rich.console import Console

from grasping_invisible.training.evaluation_methods import OURS
from grasping_invisible.training.evaluation_summary import Averages

_PIPE_WIDTH = 180


def table_console(stderr: bool) -> Console:
    """A terminal as wide as it is, a pipe wide enough that no table is cut."""
    stream = sys.stderr if stderr else sys.stdout
    return Console(stderr=stderr, highlight=False, width=None if stream.isatty() else _PIPE_WIDTH)


def add_run_options(parser: argparse.ArgumentParser) -> None:
    """What to run, how often, and with how many processes."""
    parser.add_argument("--suite", required=True, help="exploration, coordination, invisible, or scene files")
    parser.add_argument("--method", default=OURS, help="the paper's, or one of its variants or baselines")
    parser.add_argument("--runs", type=int, default=10, help="of each scene")
    parser.add_argument("--seed", type=int, default=0, help="another seed gives other variations of the scenes")
    add_workers(parser)


def add_workers(parser: argparse.ArgumentParser) -> None:
    """How many processes, by default one for each core."""
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="processes (default: one a core)")


def add_models(parser: argparse.ArgumentParser) -> None:
    """Which bundle."""
    parser.add_argument("--models", type=Path, metavar="DIR", help="bundle to measure; the shipped one without")


def share(value: float, interval: tuple[float, float]) -> str:
    """A rate or a difference of rates with its interval, in percent."""
    low, high = interval
    return f"{value:.1%} ({low:.1%} to {high:.1%})"


def number(value: float, interval: tuple[float, float]) -> str:
    """A mean or a difference of means with its interval."""
    low, high = interval
    return f"{value:.2f} ({low:.2f} to {high:.2f})"


def success(averages: Averages) -> str:
    """How often a group of runs succeeded."""
    return share(averages.success_rate, averages.success_interval)
