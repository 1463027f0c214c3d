"""Where a little of the target shows: too little to act on it, enough to know where to look for it."""

import math

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.runtime.failures import ACTS_AHEAD, REMEMBERED
from grasping_invisible.runtime.memory import Memory
from grasping_invisible.runtime.motion import PUSH_NEARNESS, RAISED_TIPS
from grasping_invisible.runtime.perception import Perception

TIPS_ABOVE = 0.004  # metres between what shows of the target and the fingertips that take away what lies on it


def hint_to_follow(perception: Perception, memory: Memory) -> NDArray[np.bool_]:
    """The cells over which a little of the target shows, (N, N) bool; all false without any.

    A few pixels that the latest pushes all acted near in vain may be no target, and are left aside.
    """
    hint = perception.hint
    if not hint.any() or perception.target_glimpsed or len(memory.failed_pushes) < REMEMBERED:
        return hint
    row, column = np.argwhere(hint).mean(axis=0)
    middle = perception.maps.workspace.cell_center(float(row), float(column))
    near = [math.dist(push, middle) <= ACTS_AHEAD + PUSH_NEARNESS for push in memory.failed_pushes]
    return np.zeros_like(hint) if all(near) else hint


def raised_tips(perception: Perception, hint: NDArray[np.bool_]) -> float:
    """Height above the table, metres, of the fingertips of a raised push.

    `RAISED_TIPS`, or just above what shows of the target where that is a hint alone: such a push takes off what lies on
    it and leaves it where it is, while a low one moves both.
    """
    return min(RAISED_TIPS, perception.hint_height + TIPS_ABOVE) if hint.any() else RAISED_TIPS
