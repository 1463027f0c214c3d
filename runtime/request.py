"""What `gi-runtime` was asked for, checked as far as it can be before anything is started."""

import argparse
from dataclasses import dataclass
from pathlib import Path

from grasping_invisible.data.classes import TARGET_COLORS
from grasping_invisible.runtime.config import Config, load_config
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.runtime.safety import MAX_MOTIONS
from grasping_invisible.runtime.seed import check_seed
from grasping_invisible.runtime.sim_process import DEFAULT_SCENE
from grasping_invisible.runtime.zenoh_session import LOCATOR_FORM, check_locator

SIM = "sim"


@dataclass(frozen=True)
class RunRequest:
    """A run to be carried out. `locator`: None starts the simulator; None elsewhere stands for the default."""

    locator: str | None
    scene: str
    target: str | None
    seed: int
    max_motions: int | None
    models: Path | None
    log_dir: Path
    config: Config
    json: bool


def request_of(options: argparse.Namespace) -> RunRequest:
    """The command line's options as a request. Raises `BadInput` with what there is to choose from."""
    colors = ", ".join(TARGET_COLORS)
    if options.target is not None and options.target not in TARGET_COLORS:
        raise BadInput(f"unknown target {options.target!r}; known: {colors}")
    if options.robot != SIM:
        _check_robot(options.robot)
        if options.scene is not None:
            raise BadInput(f"--scene chooses what is simulated; it goes with --robot {SIM} only")
        if options.target is None:
            raise BadInput(f"--target is needed with a robot on the link; known: {colors}")
    if options.max_motions is not None and not 1 <= options.max_motions <= MAX_MOTIONS:
        raise BadInput(f"--max-motions must be 1 to {MAX_MOTIONS}, not {options.max_motions}")
    check_seed(options.seed)
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


def _check_robot(robot: str) -> None:
    try:
        check_locator(robot)
    except BadInput as error:
        raise BadInput(f"unknown robot {robot!r}; known: {SIM}, or a zenoh locator such as {LOCATOR_FORM}") from error
