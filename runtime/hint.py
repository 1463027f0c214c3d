"""Where to look for a target that is not seen: a little of it shows there, or did before it was pushed."""

import math

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.runtime.failures import ACTS_AHEAD, REMEMBERED
from grasping_invisible.runtime.last_seen import cells_around
from grasping_invisible.runtime.memory import Memory
from grasping_invisible.runtime.motion import PUSH_NEARNESS, RAISED_TIPS, tips_above, top_of
from grasping_invisible.runtime.perception import Perception


def hint_to_follow(perception: Perception, memory: Memory) -> NDArray[np.bool_]:
    """The cells in which to look for a target that is not seen, (N, N) bool; all false where nothing says so.

    Those over which a little of it shows, otherwise those around where it may be since it last did. A few pixels may be
    no target, and it may have been moved elsewhere: what the latest pushes all acted near in vain is left aside.
    """
    workspace = perception.maps.workspace
    if perception.target_seen:
        return perception.hint  # none
    if perception.hint.any():
        hint, places = perception.hint, (workspace.middle_of(perception.hint),)
    else:
        hint, places = cells_around(memory.last_seen, workspace), memory.last_seen
    in_vain = len(memory.failed_pushes) == REMEMBERED and all(
        any(math.dist(push, place) <= ACTS_AHEAD + PUSH_NEARNESS for place in places) for push in memory.failed_pushes
    )
    return np.zeros_like(hint) if in_vain and not perception.target_glimpsed else hint


def raised_tips(perception: Perception, hint: NDArray[np.bool_]) -> float:
    """Height above the table, metres, of the fingertips of a raised push.

    `RAISED_TIPS`, or just above the target where it is lower, or what shows of it where that is a hint alone: such a
    push takes off what lies on it and leaves it where it is, while a low one moves both.
    """
    if perception.target_seen:
        return tips_above(top_of(perception.maps, perception.mask))
    if perception.hint.any() and hint.any():
        return tips_above(perception.hint_height)
    return RAISED_TIPS
