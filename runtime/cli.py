"""`gi-runtime`: find a hidden object and grasp it."""

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
    # These take a second to import, during which Ctrl-C must be answered.
    from grasping_invisible.runtime.request import request_of
    from grasping_invisible.runtime.run import carry_out_run

    return run_command("gi-runtime", lambda: carry_out_run(request_of(options)), (GraspingError,), signals=bounded)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="gi-runtime",
        description="Find a hidden object by pushing clutter apart, and grasp it. Everything is logged.",
        epilog="Exit codes: 0 the target is grasped; 1 it is not, within the motions allowed, or it left the "
        "workspace; 2 bad usage or bad input; 3 robot or link failed; 70 a fault of this program; 130 interrupted.",
    )
    parser.add_argument(
        "--robot",
        default="sim",
        help="'sim' starts the simulator (the default); a zenoh locator such as tcp/127.0.0.1:7447 uses a robot there",
    )
    parser.add_argument("--scene", metavar="NAME|FILE", help="what is simulated (default: exploration-02)")
    parser.add_argument("--target", metavar="COLOR", help="what to find (default: the simulated scene's target)")
    parser.add_argument("--seed", type=int, default=0, help="of the scene's variation and of ties (default: 0)")
    parser.add_argument(
        "--max-motions", type=int, metavar="N", help="pushes and grasps (default: the scene's; 15 to find and grasp)"
    )
    parser.add_argument("--models", type=Path, metavar="DIR", help="a model bundle (default: the shipped one)")
    parser.add_argument("--log-dir", type=Path, default=Path("runs"), metavar="DIR", help="default: ./runs")
    parser.add_argument("--config", type=Path, metavar="FILE", help="TOML; docs/configuration.md lists the keys")
    parser.add_argument("--json", action="store_true", help="print a summary object, last on stdout")
    return parser


if __name__ == "__main__":
    sys.exit(main())
