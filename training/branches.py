"""Branching: from each state of a scene many motions are tried, and after each the world is put back.

A state is dear (a pile to settle, an image to render) and a motion from it is cheap, so trying dozens of grasps and
pushes from one costs little more than a few, and tells the critic which of them tell apart. Some of the motions are
drawn at random, the others are what the models think best, which is where they must be right. Greedy grasps follow each
push: what a push is worth is how well the target can be grasped after it. Pushes are tried where they are needed: many
while the target is hidden or none of its grasps takes it, hardly any where one does.
"""

import time
from dataclasses import dataclass, field, replace
from enum import Enum
from importlib.metadata import version

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.classes import CLASSES
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.run_names import EXPLORER
from grasping_invisible.runtime.config import Config, to_toml
from grasping_invisible.runtime.critic import QMaps
from grasping_invisible.runtime.decision import DecisionSettings, deliberate
from grasping_invisible.runtime.frame import RgbdFrame
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.judge import Judgement, judge
from grasping_invisible.runtime.loop import RunProgress
from grasping_invisible.runtime.memory import FruitlessAction, Memory
from grasping_invisible.runtime.perception import MIN_TARGET_PIXELS, Perception, perceive
from grasping_invisible.runtime.run_log import RunFacts, RunLog
from grasping_invisible.runtime.situation import Models
from grasping_invisible.sim_robot.branching import BranchingRobot
from grasping_invisible.sim_robot.generate import Style, generate_scene
from grasping_invisible.sim_robot.scene import Scene
from grasping_invisible.training.behaviour import noisy, random_maps
from grasping_invisible.training.experience_log import ExperienceLog, SpokenRobot

STYLES: dict[Style, float] = {"packed": 0.35, "stacked": 0.1, "scattered": 0.05, "covered": 0.5}
GREY = (2, 8)  # blocks in a scene, at least and at most
GREY_COVERED = (6, 21)
TARGETS = (3, 6)  # candidates, at least and at most
TARGETS_COVERED = (1, 3)
STATES = 5  # of a scene that are branched from, each after a push from the one before
MOST_STATES = 10  # where a target is still stuck for the models after so many: what frees those is rare
GRASPS = 4  # from a state, half of them at random
GRASPS_AFTER = 2  # after a push, the best ones
TARGETS_TRIED = 2  # in a state


class Standing(Enum):
    """How a target stands in a state, by what its grasps did there."""

    HIDDEN = "hidden"
    STUCK = "in view, and none of its grasps takes it"
    FREE = "one of its grasps takes it"


PUSHES = {Standing.HIDDEN: 24, Standing.STUCK: 24, Standing.FREE: 1}
RANDOM_PUSHES = 3  # one in so many is drawn at random, and the first


@dataclass(frozen=True)
class Reached:
    """A saved state that a push led to, and how its target stands there."""

    state: int
    standing: Standing


@dataclass
class BranchCounts:
    """How many motions were tried in a scene, and how many grasps brought up what they were for."""

    grasps: int = 0
    pushes: int = 0
    grasped: int = 0


def draw_branched_scene(number: int) -> Scene:
    """The scene of a number."""
    rng = np.random.default_rng((3, number))
    style = list(STYLES)[rng.choice(len(STYLES), p=list(STYLES.values()))]
    fewest, most = TARGETS_COVERED if style == "covered" else TARGETS
    least, greatest = GREY_COVERED if style == "covered" else GREY
    targets, basics = int(rng.integers(fewest, most + 1)), int(rng.integers(least, greatest + 1))
    return generate_scene(number, style=style, targets=targets, basics=basics)


def branch(
    scene: Scene, number: int, models: Models | None, bundle_sha256: str, log: ExperienceLog, counts: BranchCounts
) -> None:
    """Try motions from some states of a scene; each is logged as a run of one step, run id `branch-NUMBER/COUNT`.

    Without `models` all motions are drawn at random. `counts` is kept up to date throughout. Raises `RobotError` when
    the simulation breaks down.
    """
    robot = BranchingRobot(scene, number)
    try:
        session = _Session(robot, models, bundle_sha256, log, counts, number)
        rng = np.random.default_rng((3, number, 1))
        for count in range(1, MOST_STATES + 1):
            reached = session.branch_from_here(rng)
            going_on = _worth_going_on(reached, count, stay=models is not None)
            if going_on:
                robot.restore(going_on[rng.integers(len(going_on))].state)
            for led in reached:
                robot.forget(led.state)
            if not going_on:
                break
    finally:
        robot.close()


def _worth_going_on(reached: list[Reached], count: int, stay: bool) -> list[Reached]:
    """Of the states that `count` branchings led to: where a target is still to be freed or found, if there are any.

    After `STATES` only where it is stuck, and only with the leave to `stay`.
    """
    if count >= STATES:
        return [led for led in reached if stay and led.standing is Standing.STUCK]
    return [led for led in reached if led.standing is not Standing.FREE] or reached


@dataclass
class _Chooser:
    """Stands in for the models of a decision: labels are the simulator's, and the kind of motion is given."""

    robot: BranchingRobot
    models: Models | None
    rng: np.random.Generator
    kind: gi.MotionKind = gi.GRASP
    greedy: bool = False
    _known: dict[tuple[int, bytes], QMaps] = field(default_factory=dict)

    def segment(self, color: NDArray[np.uint8]) -> NDArray[np.uint8]:
        return self.robot.truth_labels()

    def q_maps(self, maps: Heightmaps, mask: NDArray[np.bool_]) -> QMaps:
        if self.models is None or not self.greedy:
            return random_maps(mask, maps.workspace, self.rng)
        key = maps.stamp_ns, mask.tobytes()
        if key not in self._known:
            self._known = {key: self.models.q_maps(maps, mask)}
        return noisy(self._known[key], self.rng)

    def grasp_probability(self, features: NDArray[np.float32]) -> float:
        return float(self.kind == gi.GRASP)


class _Session:
    """Tries motions with one robot and logs them."""

    def __init__(
        self,
        robot: BranchingRobot,
        models: Models | None,
        bundle_sha256: str,
        log: ExperienceLog,
        counts: BranchCounts,
        number: int,
    ) -> None:
        self._robot = robot
        self._spoken = SpokenRobot(robot, log.bus)
        self._bus = log.bus
        self._chooser = _Chooser(robot, models, np.random.default_rng((3, number, 2)))
        self._counts = counts
        self._runs = 0
        self._facts = RunFacts(
            run_id=f"branch-{number}",
            project_version=version("grasping-invisible"),
            bundle_sha256=bundle_sha256,
            onnxruntime_version="",
            target=robot.scene.target,
            scene=robot.scene.name,
            seed=number,
            max_motions=1,
            config_toml=to_toml(Config()),
            robot="simulated in this process, branching",
        )

    def branch_from_here(self, rng: np.random.Generator) -> list[Reached]:
        """Try grasps and pushes from the state that the world is in; the states that pushes led to."""
        here = self._robot.save()
        frame = self._spoken.observe()
        # All at once: the simulator's labels are those of the frame that was observed last.
        workspace = self._robot.workspace
        seen = {target: perceive(frame, self._chooser, target, workspace) for target in self._targets(rng)}
        led_to: list[Reached] = []
        for target, perception in seen.items():
            standing = self._try_grasps(perception, frame, target, here, GRASPS // 2, GRASPS - GRASPS // 2)
            led_to += self._try_pushes(perception, frame, target, here, PUSHES[standing])
        self._robot.forget(here)
        return led_to

    def _targets(self, rng: np.random.Generator) -> list[str]:
        """Visible candidates in the workspace; the scene's target first, which is looked for where it is hidden."""
        scene = self._robot.scene
        pixels = np.bincount(self._robot.truth_labels().ravel(), minlength=len(CLASSES))
        inside = {
            item.color
            for item in self._robot.world.object_states()
            if self._robot.workspace.contains(*item.position[:2]) and item.color in CLASSES[1:]
        }
        visible = sorted(color for color in inside if pixels[CLASSES.index(color)] >= MIN_TARGET_PIXELS)
        first = [scene.target] if scene.target in inside and (scene.target in visible or scene.task != "free") else []
        others = [color for color in rng.permutation(visible).tolist() if color not in first]
        return (first + others)[:TARGETS_TRIED]

    def _try_grasps(
        self, perception: Perception, frame: RgbdFrame, target: str, state: int, random: int, greedy: int
    ) -> Standing:
        if not perception.target_seen:
            return Standing.HIDDEN
        tried: list[FruitlessAction] = []
        standing, failures = Standing.STUCK, 0
        for index in range(random + greedy):
            self._chooser.kind, self._chooser.greedy = gi.GRASP, index >= random
            before = self._counts.grasped
            self._attempt(perception, frame, target, tried, failures)
            self._robot.restore(state)
            taken = self._counts.grasped > before
            standing = Standing.FREE if taken else standing
            if self._chooser.greedy:
                # As on a robot whose best grasps failed one after the other.
                failures = 0 if taken else failures + 1
            elif taken:
                tried.pop()  # the best grasps may well be like it
        return standing

    def _try_pushes(
        self, perception: Perception, frame: RgbdFrame, target: str, state: int, pushes: int
    ) -> list[Reached]:
        led_to: list[Reached] = []
        tried: list[FruitlessAction] = []
        for index in range(pushes):
            self._chooser.kind, self._chooser.greedy = gi.PUSH, index > pushes // RANDOM_PUSHES
            after = self._attempt(perception, frame, target, tried)
            if after is not None:
                reached = self._robot.save()
                standing = self._try_grasps(*after, target, reached, random=0, greedy=GRASPS_AFTER)
                led_to.append(Reached(reached, standing))
            self._robot.restore(state)
        return led_to

    def _attempt(
        self, before: Perception, frame: RgbdFrame, target: str, tried: list[FruitlessAction], failures: int = 0
    ) -> tuple[Perception, RgbdFrame] | None:
        """Decide and act once; what was seen after a push, None after a grasp or where nothing was reached."""
        # What was tried from this state counts as fruitless, so that greedy motions are not all one.
        memory = Memory((), failures, fruitless=tuple(tried)) if self._chooser.greedy else Memory()
        facts, watcher = self._started(target)
        watcher.perceived(frame, before, 0)
        # A search at random is not led by the clutter prior alone: half of it starts wherever something can be pushed.
        exploration = "agnostic-push" if self._runs % 2 else EXPLORER
        settings = DecisionSettings(target, self._robot.workspace, exploration)
        deliberation = deliberate(before, memory, self._chooser, settings, facts.seed + self._runs)
        decision = deliberation.decision
        watcher.decided(frame, deliberation)
        outcome = self._spoken.execute(decision.command(1, time.time_ns()))
        tried.append(FruitlessAction(decision.kind, *decision.position[:2], decision.yaw, decision.level))
        after = None
        if decision.kind == gi.PUSH and outcome.status != gi.UNREACHABLE:
            after_frame = self._spoken.observe()
            after = perceive(after_frame, self._chooser, target, self._robot.workspace), after_frame
            watcher.perceived(after_frame, after[0], 1)
            judgement = judge(before, decision, outcome, after[0])
        else:
            judgement = self._felt(target, before, outcome)
        watcher.judged(deliberation, outcome, judgement)
        progress = RunProgress(
            before.target_seen, judgement.target_grasped, motions=1, ended_because="one motion tried"
        )
        watcher.ended(facts.run_id, progress, 0)
        self._count(decision.kind, judgement.target_grasped)
        return after

    def _felt(self, target: str, before: Perception, outcome: gi.MotionOutcome) -> Judgement:
        """What came of a grasp, by what the simulator knows to be held: no image is made for it."""
        held = self._robot.truth().held_object if outcome.holding else ""
        color = next((item.color for item in self._robot.world.object_states() if item.name == held), None)
        return Judgement(
            scene_changed=outcome.holding,
            target_visible=before.target_seen,
            object_grasped=outcome.holding,
            target_grasped=outcome.holding and color == target,
            target_left=False,
            border_decrease=0.0,
            detail=f"{outcome.detail}; put back",
        )

    def _started(self, target: str) -> tuple[RunFacts, RunLog]:
        self._runs += 1
        facts = replace(self._facts, run_id=f"{self._facts.run_id}/{self._runs}", target=target)
        watcher = RunLog(self._bus, target, pictures=False)
        watcher.started(facts)
        return facts, watcher

    def _count(self, kind: gi.MotionKind, grasped: bool) -> None:
        self._counts.grasps += kind == gi.GRASP
        self._counts.pushes += kind == gi.PUSH
        self._counts.grasped += grasped
