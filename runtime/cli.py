"""`gi-runtime`: find a hidden object and grasp it."""

import argparse
import sys
from pathlib import Path

from grasping_invisible.data.classes import TARGET_COLORS
from grasping_invisible.runtime.command import run_command
from grasping_invisible.runtime.config import Config, load_config
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.runtime.run import RunRequest, carry_out_run
from grasping_invisible.runtime.zenoh_session import LOCATOR_FORM, check_locator

SIM = "sim"
DEFAULT_SCENE = "exploration-00"


def main(arguments: list[str] | None = None) -> int:
    """Run the command; its exit code is documented in its help."""
    options = _parser().parse_args(arguments)
    return run_command("gi-runtime", lambda: carry_out_run(_request(options)))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="gi-runtime",
        description="Find a hidden object by pushing clutter apart, and grasp it. Everything is logged.",
        epilog="Exit codes: 0 the target is grasped; 1 it is not, within the motions allowed; 2 bad usage or bad "
        "input; 3 the robot or the link to it failed; 130 interrupted.",
    )
    parser.add_argument(
        "--robot",
        default=SIM,
        help=f"'{SIM}' starts the simulator (the default); a zenoh locator such as {LOCATOR_FORM} uses a robot there",
    )
    parser.add_argument("--scene", metavar="NAME|FILE", help=f"simulated scene (default: {DEFAULT_SCENE})")
    parser.add_argument(
        "--target", metavar="COLOR", help=f"one of {', '.join(TARGET_COLORS)} (default: the simulated scene's)"
    )
    parser.add_argument("--seed", type=int, default=0, help="of the scene's variation and of ties (default: 0)")
    parser.add_argument("--max-motions", type=int, metavar="N", help="pushes and grasps (default: the scene's, or 15)")
    parser.add_argument("--models", type=Path, metavar="DIR", help="a model bundle (default: the shipped one)")
    parser.add_argument("--log-dir", type=Path, default=Path("runs"), metavar="DIR", help="default: ./runs")
    parser.add_argument("--config", type=Path, metavar="FILE", help="TOML; docs/configuration.md lists the keys")
    parser.add_argument("--json", action="store_true", help="print a summary object, last on stdout")
    return parser


def _request(options: argparse.Namespace) -> RunRequest:
    """The options as a request. Raises `BadInput` with what there is to choose from."""
    if options.robot != SIM:
        try:
            check_locator(options.robot)
        except BadInput:
            raise BadInput(
                f"unknown robot {options.robot!r}; known: {SIM}, or a zenoh locator such as {LOCATOR_FORM}"
            ) from None
        if options.scene is not None:
            raise BadInput(f"--scene chooses what is simulated; it goes with --robot {SIM} only")
        if options.target is None:
            raise BadInput(f"--target is needed with a robot on the link; known: {', '.join(TARGET_COLORS)}")
    if options.target is not None and options.target not in TARGET_COLORS:
        raise BadInput(f"unknown target {options.target!r}; known: {', '.join(TARGET_COLORS)}")
    if options.max_motions is not None and options.max_motions < 1:
        raise BadInput(f"--max-motions must be at least 1, not {options.max_motions}")
    if not 0 <= options.seed < 2**63:
        raise BadInput(f"--seed must be 0 or more, and below 2^63, not {options.seed}")
    return RunRequest(
        locator=None if options.robot == SIM else options.robot,
        scene=options.scene or DEFAULT_SCENE,
        target=options.target,
        seed=options.seed,
        max_motions=options.max_motions,
        models=options.models,
        log_dir=options.log_dir,
        config=Config() if options.config is None else load_config(options.config),
        json=options.json,
    )


if __name__ == "__main__":
    sys.exit(main())
