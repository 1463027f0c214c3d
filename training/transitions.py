"""Logged steps as what the critic learns from: state, executed action, reward, next state, for a goal.

Each step gives a transition for the run's target, and further ones for other colours (hindsight): a grasp aimed at
another colour, or a push past it, teaches what it would have been worth had that colour been the target. Whether
such a transition is made depends on where the motion was aimed and never on how it ended, so values stay unbiased.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import PUSH_LENGTH, feasible_grasps, heightmap_cell, rotation_angle
from grasping_invisible.data.classes import CLASSES
from grasping_invisible.data.heightmap_message import decode_heightmaps
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.rewards import grasp_reward, push_passes, push_reward
from grasping_invisible.data.steps import LoggedStep, steps
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.workspace import Workspace

FEWEST_CELLS = 12  # of a colour in view, for it to be a goal
NEAR_PUSH = 0.02  # metres beside a push within which it teaches about another colour
GONE = 0.7  # share of a colour's cells around a grasp that must vanish for it to be what was grasped
GRASP_SURROUNDINGS = 0.06  # metres

_USABLE = (gi.COMPLETED, gi.BLOCKED)


@dataclass(frozen=True)
class Transition:
    """One action and what it was worth for one goal.

    `goal`: class index of the target. `row`, `column`: on the action grid. `reward`: see `data.rewards`.
    `success`: the goal was grasped, which ends the episode. `after`: the state that followed, None at an end.
    `hindsight`: the goal was not what the robot was after. `run`: which log it is from.
    `consecutive_grasp_failures`: c_g when it was decided on.
    """

    before: Heightmaps
    goal: int
    kind: gi.MotionKind
    rotation: int
    row: int
    column: int
    reward: float
    success: bool
    after: Heightmaps | None
    hindsight: bool
    run: str
    consecutive_grasp_failures: int

    @property
    def mask(self) -> NDArray[np.bool_]:
        """The goal's cells before the action, (N, N)."""
        return self.before.labels == self.goal

    @property
    def aimed(self) -> bool:
        """Whether a grasp was aimed at the goal."""
        allowed = feasible_grasps(self.mask, self.before.workspace.resolution)
        return self.kind == gi.GRASP and bool(allowed[self.rotation, self.row, self.column])


def read_transitions(path: Path) -> Iterator[Transition]:
    """The transitions of a log, in order. Raises `BadLog` for a file that is none."""
    previous: Heightmaps | None = None
    for step in steps(path):
        before, after = _maps(step.heightmaps, previous), _maps(step.next_heightmaps)
        previous = after
        if before is not None:
            yield from transitions_of(step, before, after, path.stem)


def transitions_of(step: LoggedStep, before: Heightmaps, after: Heightmaps | None, run: str) -> Iterator[Transition]:
    """What one step teaches, for the run's target and for others."""
    decision, outcome, result = step.decision, step.outcome, step.result
    if step.start is None or outcome is None or result is None or outcome.status not in _USABLE:
        return
    target = CLASSES.index(step.start.target_color)
    grasped = None
    if decision.kind == gi.GRASP and result.object_grasped:
        grasped = target if result.target_grasped else grasped_class(before, after, decision)
    for goal in range(1, len(CLASSES)):
        mask = before.labels == goal
        if np.count_nonzero(mask) < FEWEST_CELLS:
            continue
        if goal != target and not _concerns(mask, before.workspace.resolution, decision):
            continue
        if decision.kind == gi.PUSH and after is None:
            continue
        success = grasped == goal
        yield Transition(
            before=before,
            goal=goal,
            kind=decision.kind,
            rotation=decision.rotation,
            row=decision.row,
            column=decision.column,
            reward=_reward(before, after, goal, decision, success),
            success=success,
            after=None if success else after,
            hindsight=goal != target,
            run=run,
            consecutive_grasp_failures=decision.memory.consecutive_grasp_failures,
        )


def grasped_class(before: Heightmaps, after: Heightmaps | None, decision: gi.Decision) -> int | None:
    """Which colour a successful grasp took: that under its cell, if it vanished from there; None when unsure."""
    if after is None:
        return None
    row, column = (round(value) for value in heightmap_cell(decision.row, decision.column, before.workspace.cells))
    near = round(GRASP_SURROUNDINGS / before.workspace.resolution / 2)
    window = (slice(max(0, row - near), row + near + 1), slice(max(0, column - near), column + near + 1))
    candidates = np.bincount(
        before.labels[max(0, row - 2) : row + 3, max(0, column - 2) : column + 3].ravel(), minlength=1
    )
    index = int(candidates.argmax())
    if index == 0:
        return None
    was, left = (np.count_nonzero(maps.labels[window] == index) for maps in (before, after))
    return index if left <= (1.0 - GONE) * was else None


def _reward(before: Heightmaps, after: Heightmaps | None, goal: int, decision: gi.Decision, success: bool) -> float:
    mask = before.labels == goal
    start = heightmap_cell(decision.row, decision.column, before.workspace.cells)
    if decision.kind == gi.GRASP or after is None:
        return grasp_reward(mask, *start, success)
    return push_reward(
        before.height,
        mask,
        after.height,
        after.labels == goal,
        start,
        float(rotation_angle(decision.rotation)),
        PUSH_LENGTH,
        before.workspace.resolution,
    )


def _concerns(mask: NDArray[np.bool_], resolution: float, decision: gi.Decision) -> bool:
    """Whether an action was aimed at a colour, whose mask this is, or near it."""
    if decision.kind == gi.GRASP:
        return bool(feasible_grasps(mask, resolution)[decision.rotation, decision.row, decision.column])
    reach = math.ceil(NEAR_PUSH / resolution)
    near = cv2.dilate(mask.astype(np.uint8), cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1,) * 2))
    start = heightmap_cell(decision.row, decision.column, len(mask))
    return push_passes(near > 0, start, float(rotation_angle(decision.rotation)), PUSH_LENGTH / resolution)


def _maps(message: gi.Heightmaps | None, known: Heightmaps | None = None) -> Heightmaps | None:
    """Decode a message, or hand back the maps of the same frame that are decoded already."""
    if message is None:
        return None
    if known is not None and known.stamp_ns == message.stamp.ToNanoseconds():
        return known
    maps = decode_heightmaps(message)
    size = maps.resolution * message.rows
    return Heightmaps(
        maps.stamp_ns, maps.color, maps.height, maps.labels, Workspace(maps.center, size, maps.resolution)
    )
