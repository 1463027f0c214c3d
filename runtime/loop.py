"""The loop (paper, algorithm 1): observe, decide, act, judge, until the target is in the gripper, or out of reach.

It works with any robot and any models, in this process or across the link. Whoever shows or keeps what happens is a
watcher: the loop tells it and does not wait.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from itertools import count
from typing import Protocol

from grasping_invisible.data.clock import to_timestamp
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.run_names import BUDGET, FOUND, GRASPED, OUTSIDE
from grasping_invisible.runtime.decision import DecisionSettings, Deliberation, deliberate
from grasping_invisible.runtime.errors import RobotError
from grasping_invisible.runtime.frame import RgbdFrame
from grasping_invisible.runtime.judge import Judgement, judge, remember
from grasping_invisible.runtime.memory import Memory
from grasping_invisible.runtime.perception import Perception, perceive
from grasping_invisible.runtime.robot import Robot, motion_name
from grasping_invisible.runtime.safety import SafetyLimits, check_command
from grasping_invisible.runtime.situation import Models
from grasping_invisible.runtime.view import check_view


class Goal(Enum):
    """What a run is for, and therefore when it ends."""

    GRASP = "grasp"  # the target is in the gripper
    FIND = "find"  # the segmenter sees the target


@dataclass(frozen=True)
class RunPlan:
    """What a run may take. `max_motions` counts pushes and grasps; going home and putting down are free."""

    seed: int = 0
    max_motions: int = 15
    goal: Goal = Goal.GRASP
    limits: SafetyLimits = field(default_factory=SafetyLimits)


class Watcher(Protocol):
    """Who is told what happens. Must be quick; whatever takes long belongs in a thread of its own."""

    def perceived(self, frame: RgbdFrame, perception: Perception, step: int) -> None:
        """`frame` is what step `step` starts from; the last step's is followed by no decision."""
        ...

    def decided(self, frame: RgbdFrame, deliberation: Deliberation) -> None:
        """The next motion is chosen and about to be sent."""
        ...

    def judged(self, deliberation: Deliberation, outcome: gi.MotionOutcome, judgement: Judgement) -> None:
        """The motion has ended and is judged."""
        ...


@dataclass
class RunProgress:
    """How far a run has come; it stays valid when the run is cut short by an error or a person."""

    found: bool = False
    grasped: bool = False
    target_left: bool = False  # it was taken out of the workspace, from where no motion brings it back
    motions: int = 0
    decision_ms: list[float] = field(default_factory=list)
    ended_because: str = "failed"  # as logs call it, once it has ended: `run_loop` says so, or who cut it short


def run_loop(
    robot: Robot,
    models: Models,
    settings: DecisionSettings,
    plan: RunPlan,
    watchers: Sequence[Watcher] = (),
    progress: RunProgress | None = None,
) -> RunProgress:
    """Pursue the plan's goal within its motions. Raises `RobotError` when the robot cannot go on.

    `progress`, if given, is kept up to date throughout, for a caller who must know after an interruption.
    """
    progress = progress or RunProgress()
    actor = _Actor(robot, plan.limits, settings)
    actor.make_ready()
    memory = Memory()
    frame = _look(robot, settings)
    perception = perceive(frame, models, settings.target, settings.workspace)
    while True:
        for watcher in watchers:
            watcher.perceived(frame, perception, memory.step)
        progress.found = progress.found or perception.target_found
        end = _end_of(progress, plan)
        if end is not None:
            progress.ended_because = end
            return progress

        memory = replace(memory, last_motion=progress.motions + 1 == plan.max_motions)
        deliberation = deliberate(perception, memory, models, settings, plan.seed)
        progress.decision_ms.append(sum(deliberation.stage_ms.values()))
        for watcher in watchers:
            watcher.decided(frame, deliberation)

        progress.motions += 1
        outcome = actor.act(deliberation)

        frame = _look(robot, settings)
        after = perceive(frame, models, settings.target, settings.workspace)
        judgement = judge(perception, deliberation.decision, outcome, after)
        progress.grasped, progress.target_left = judgement.target_grasped, judgement.target_left
        for watcher in watchers:
            watcher.judged(deliberation, outcome, judgement)

        memory = remember(memory, deliberation.perception, deliberation.decision, outcome, judgement)
        perception = after
        if judgement.object_grasped and not judgement.target_grasped:
            actor.put_down()
            frame = _look(robot, settings)
            perception = perceive(frame, models, settings.target, settings.workspace)


def _look(robot: Robot, settings: DecisionSettings) -> RgbdFrame:
    """What the camera sees. Raises `RobotError` where that is too little to decide or judge by."""
    frame = robot.observe()
    check_view(frame, settings.workspace)
    return frame


def _end_of(progress: RunProgress, plan: RunPlan) -> str | None:
    """Why a run ends here; None: it goes on."""
    if progress.grasped:
        return GRASPED
    if plan.goal is Goal.FIND and progress.found:
        return FOUND
    if progress.target_left:
        return OUTSIDE
    return BUDGET if progress.motions >= plan.max_motions else None


class _Actor:
    """Sends commands, each within the limits and with a new number, and insists that the robot can go on."""

    def __init__(self, robot: Robot, limits: SafetyLimits, settings: DecisionSettings) -> None:
        self._robot = robot
        self._limits = limits
        self._workspace = settings.workspace
        self._numbers = count(1)

    def make_ready(self) -> None:
        """Out of the camera's view, after whatever was before, and with an empty gripper."""
        if self._complete(gi.HOME).holding:
            self.put_down()

    def act(self, deliberation: Deliberation) -> gi.MotionOutcome:
        """Carry out a decision."""
        return self._carry_out(deliberation.decision.command(next(self._numbers), time.time_ns()))

    def put_down(self) -> None:
        """Put what is held in the discard bin."""
        if self._complete(gi.PLACE).holding:
            raise RobotError("PLACE ended with something still in the gripper")

    def _complete(self, kind: gi.MotionKind) -> gi.MotionOutcome:
        """A motion without which the next picture or the next grasp would be worth nothing."""
        command = gi.MotionCommand(id=next(self._numbers), stamp=to_timestamp(time.time_ns()), kind=kind)
        outcome = self._carry_out(command)
        if outcome.status != gi.COMPLETED:
            raise RobotError(f"{motion_name(command)} ended {gi.MotionStatus.Name(outcome.status)}: {outcome.detail}")
        return outcome

    def _carry_out(self, command: gi.MotionCommand) -> gi.MotionOutcome:
        check_command(command, self._limits, self._workspace)
        outcome = self._robot.execute(command)
        if outcome.status in (gi.STOPPED, gi.FAULT):
            how = "was stopped" if outcome.status == gi.STOPPED else "ended in a fault"
            raise RobotError(f"{motion_name(command)} {how}: {outcome.detail}")
        return outcome
