"""Self-supervised collection: the robot acts in random clutter and logs what comes of it (paper, section VI-B).

Each scene makes one log, which depends on its seed and the models alone. In a scene the robot is after one visible
target candidate; once that is grasped, has left the workspace, or its motions are spent, after another, until none is
in view.
"""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path

import numpy as np

from grasping_invisible.data.classes import CLASSES
from grasping_invisible.runtime.bundle import load_bundle
from grasping_invisible.runtime.config import Config, to_toml
from grasping_invisible.runtime.decision import DecisionSettings
from grasping_invisible.runtime.errors import RobotError
from grasping_invisible.runtime.loop import RunPlan, RunProgress, run_loop
from grasping_invisible.runtime.perception import MIN_TARGET_PIXELS
from grasping_invisible.runtime.run_log import RunFacts, RunLog
from grasping_invisible.sim_robot.generate import Style, generate_scene
from grasping_invisible.sim_robot.robot import SimRobot
from grasping_invisible.sim_robot.scene import Scene
from grasping_invisible.training.behaviour import Behaviour
from grasping_invisible.training.branches import BranchCounts, branch, draw_branched_scene
from grasping_invisible.training.collection_settings import CollectionSettings, keep_settings
from grasping_invisible.training.experience_log import ExperienceLog, SpokenRobot
from grasping_invisible.training.worker import loaded_bundle, simulating

# Style and share of the scenes of each stage, and how many grey blocks they hold (paper: 3, then 8).
STAGES: dict[int, tuple[dict[Style, float], tuple[int, int]]] = {
    1: ({"scattered": 0.7, "packed": 0.3}, (2, 5)),
    2: ({"scattered": 0.35, "packed": 0.45, "stacked": 0.2}, (5, 9)),
}
TARGETS = 3  # candidates in a scene, at most


@dataclass(frozen=True)
class Collection:
    """What to collect. `scenes`: how many, numbered from `seed` x 1,000,000 on: below are those that people generate.

    `models`: folder of a bundle for the greedy part; None acts at random. `epsilon`: share of random actions.
    `on_policy`: the bundle's classifier chooses between push and grasp. `motions`: spent on one target at most.
    `branch`: try many motions from each state instead (`training.branches`); of the rest only `models` counts then.
    """

    out: Path
    scenes: int
    stage: int = 1
    seed: int = 1
    models: Path | None = None
    epsilon: float = 1.0
    on_policy: bool = False
    motions: int = 8
    branch: bool = False

    @property
    def numbers(self) -> range:
        """The scenes' numbers, each also its seed."""
        first = self.seed * 1_000_000
        return range(first, first + self.scenes)

    @property
    def missing(self) -> list[int]:
        """The scenes' numbers that have no complete log yet."""
        return [number for number in self.numbers if not self.log_path(number).is_file()]

    def log_path(self, number: int) -> Path:
        """The log of a scene; it is there only when it is complete."""
        return self.out / f"scene-{number:09d}.mcap"


@dataclass(frozen=True)
class SceneCounts:
    """What happened in one scene. `grasps`: how many took their target, of the `targets` gone after, or, where many
    were tried from the same states, of so many grasps. `failure`: why it was given up, if it was.
    """

    motions: int
    grasps: int
    targets: int
    failure: str | None = None


def collect(collection: Collection, workers: int) -> Iterator[SceneCounts]:
    """Make the logs that are missing, in `workers` processes; yields as each is done.

    An interrupted collection goes on where it stopped when started again. Raises `BadInput` at once where the folder
    was collected with other settings or the bundle cannot be used, and `RobotError` where a process dies.
    """
    settings = CollectionSettings(
        stage=collection.stage,
        branch=collection.branch,
        epsilon=collection.epsilon,
        on_policy=collection.on_policy,
        motions=collection.motions,
        bundle_sha256=None if collection.models is None else load_bundle(collection.models).sha256,
    )
    collection.out.mkdir(parents=True, exist_ok=True)
    keep_settings(collection.out, settings)
    return _make_missing(collection, workers)


def _make_missing(collection: Collection, workers: int) -> Iterator[SceneCounts]:
    with simulating(workers) as run_all:
        yield from run_all(partial(collect_scene, collection), collection.missing)


def collect_scene(collection: Collection, number: int) -> SceneCounts:
    """Act in one scene and leave its log behind."""
    path = collection.log_path(number)
    unfinished = path.with_suffix(".partial")
    unfinished.unlink(missing_ok=True)
    log = ExperienceLog(unfinished)
    try:
        counts = (_branch if collection.branch else _act)(collection, number, log)
    finally:
        log.close()
    os.replace(unfinished, path)
    return counts


def draw_scene(stage: int, number: int) -> Scene:
    """The scene of a number: style, candidates and grey blocks drawn for the stage."""
    styles, (fewest, most) = STAGES[stage]
    rng = np.random.default_rng((stage, number))
    style = list(styles)[rng.choice(len(styles), p=list(styles.values()))]
    return generate_scene(
        number, style=style, targets=int(rng.integers(1, TARGETS + 1)), basics=int(rng.integers(fewest, most + 1))
    )


def _act(collection: Collection, number: int, log: ExperienceLog) -> SceneCounts:
    rng = np.random.default_rng((collection.stage, number, 1))
    models = None if collection.models is None else loaded_bundle(collection.models)
    runs: list[RunProgress] = []
    try:
        scene = draw_scene(collection.stage, number)
        robot = SimRobot(scene, number)
    except RobotError as error:
        return _counts(runs, str(error))
    behaviour = Behaviour(robot, models, collection.epsilon, collection.on_policy, number)
    spoken = SpokenRobot(robot, log.bus)
    tried: set[str] = set()
    try:
        while (target := _visible_candidate(robot, tried, rng)) is not None:
            tried.add(target)
            runs.append(RunProgress(ended_because="robot"))
            facts = RunFacts(
                run_id=f"scene-{number}/{target}",
                project_version=version("grasping-invisible"),
                bundle_sha256="" if models is None else models.sha256,
                onnxruntime_version="" if models is None else models.onnxruntime_version,
                target=target,
                scene=scene.name,
                seed=number,
                max_motions=collection.motions,
                config_toml=to_toml(Config()),
                robot=f"simulated in this process, stage {collection.stage}, epsilon {collection.epsilon:g}",
            )
            watcher = RunLog(log.bus, target, pictures=False)
            watcher.started(facts)
            plan = RunPlan(seed=number, max_motions=collection.motions)
            try:
                run_loop(spoken, behaviour, DecisionSettings(target, robot.workspace), plan, (watcher,), runs[-1])
            finally:
                watcher.ended(facts.run_id, runs[-1], 0)
    except RobotError as error:
        return _counts(runs, str(error))
    finally:
        robot.close()
    return _counts(runs)


def _branch(collection: Collection, number: int, log: ExperienceLog) -> SceneCounts:
    models = None if collection.models is None else loaded_bundle(collection.models)
    counts, failure = BranchCounts(), None
    try:
        branch(draw_branched_scene(number), number, models, "" if models is None else models.sha256, log, counts)
    except RobotError as error:
        failure = str(error)
    return SceneCounts(counts.grasps + counts.pushes, counts.grasped, counts.grasps, failure)


def _visible_candidate(robot: SimRobot, tried: set[str], rng: np.random.Generator) -> str | None:
    """One of the target colours in view of the camera and in the workspace that were not tried yet."""
    robot.observe()
    pixels = np.bincount(robot.truth_labels().ravel(), minlength=len(CLASSES))
    inside = {item.color for item in robot.world.object_states() if robot.workspace.contains(*item.position[:2])}
    candidates = [
        color
        for color, count in zip(CLASSES[1:], pixels[1:], strict=True)
        if count >= MIN_TARGET_PIXELS and color in inside and color not in tried
    ]
    return str(rng.choice(candidates)) if candidates else None


def _counts(runs: list[RunProgress], failure: str | None = None) -> SceneCounts:
    return SceneCounts(sum(run.motions for run in runs), sum(run.grasped for run in runs), len(runs), failure)
