"""What a decision knows of its run; bounded and logged, so that the decision can be made again."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import ACTION_CELLS, LOW, PUSH_LEVELS, ROTATIONS
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.rotation import ANGLES, action_grid
from grasping_invisible.runtime.workspace import Workspace

FRUITLESS_REMEMBERED = 8
PUSHES_REMEMBERED = 3  # of the fruitless, whatever they changed
FRUITLESS_RADIUS = 0.015  # metres around a fruitless action in which it is not tried again
FRUITLESS_TURN = 1.5 * 2 * math.pi / ROTATIONS  # radians: the same rotation and the ones beside it


@dataclass(frozen=True)
class FruitlessAction:
    """An action that would bring nothing new: after it the scene was as before, or it is a push that was just made.

    `kind`: gi.PUSH or gi.GRASP; metres, radians, base frame. `level`: of a push. `unchanged`: the scene was as before.
    """

    kind: gi.MotionKind
    x: float
    y: float
    yaw: float
    level: int = LOW
    unchanged: bool = False


@dataclass(frozen=True)
class Memory:
    """All that a decision knows of its run.

    `failed_pushes`: where explorational pushes acted that changed the scene and did not bring the target to light,
    (x, y) in the base frame, most recent last, at most three. `consecutive_grasp_failures`: c_g. `step`: 0-based
    within the run. `fruitless`: actions since the scene last changed, and the latest pushes, most recent last.
    `consecutive_pushes`: pushes since the last grasp. `last_seen`: where the target may be, should nothing of it show,
    (x, y) in the base frame. `last_motion`: the run allows none after this one.
    """

    failed_pushes: tuple[tuple[float, float], ...] = ()
    consecutive_grasp_failures: int = 0
    step: int = 0
    fruitless: tuple[FruitlessAction, ...] = ()
    consecutive_pushes: int = 0
    last_seen: tuple[tuple[float, float], ...] = ()
    last_motion: bool = False


def untried(kind: gi.MotionKind, memory: Memory, workspace: Workspace) -> NDArray[np.bool_]:
    """Which actions of a kind repeat no fruitless one: (16, 112, 112) bool, of pushes (2, 16, 112, 112).

    The same image brings the same choice: without this a blocked or unreachable motion would be tried for
    ever.
    """
    allowed = np.ones((len(PUSH_LEVELS), ROTATIONS, ACTION_CELLS, ACTION_CELLS), np.bool_)
    x, y = action_grid(workspace).cell_centers()
    period = math.pi if kind == gi.GRASP else 2 * math.pi  # a grasp turned by half a turn is the same grasp
    for action in memory.fruitless:
        if action.kind != kind:
            continue
        near = (x - action.x) ** 2 + (y - action.y) ** 2 <= FRUITLESS_RADIUS**2
        turn = np.abs((ANGLES - action.yaw + period / 2) % period - period / 2)
        allowed[action.level] &= ~(near & (turn < FRUITLESS_TURN)[:, None, None])
    return allowed if kind == gi.PUSH else allowed[LOW]


def memory_message(memory: Memory) -> gi.DecisionMemory:
    """The memory as it is logged."""
    return gi.DecisionMemory(
        failed_pushes=[gi.Place(x=x, y=y) for x, y in memory.failed_pushes],
        consecutive_grasp_failures=memory.consecutive_grasp_failures,
        step=memory.step,
        fruitless=[
            gi.FruitlessAction(
                kind=act.kind, x=act.x, y=act.y, yaw=act.yaw, push_level=act.level, unchanged=act.unchanged
            )
            for act in memory.fruitless
        ],
        consecutive_pushes=memory.consecutive_pushes,
        last_seen=[gi.Place(x=x, y=y) for x, y in memory.last_seen],
        last_motion=memory.last_motion,
    )


def memory_from_message(message: gi.DecisionMemory) -> Memory:
    """The memory that a logged decision was made with."""
    return Memory(
        failed_pushes=tuple((push.x, push.y) for push in message.failed_pushes),
        consecutive_grasp_failures=message.consecutive_grasp_failures,
        step=message.step,
        fruitless=tuple(
            FruitlessAction(act.kind, act.x, act.y, act.yaw, act.push_level, act.unchanged) for act in message.fruitless
        ),
        consecutive_pushes=message.consecutive_pushes,
        last_seen=tuple((place.x, place.y) for place in message.last_seen),
        last_motion=message.last_motion,
    )
