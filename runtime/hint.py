"""Where to look for a target that is not seen: a little of it shows there, or did before it was pushed."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import ACTION_CELLS, ROTATIONS
from grasping_invisible.runtime.failures import ACTS_AHEAD, REMEMBERED
from grasping_invisible.runtime.last_seen import cells_around
from grasping_invisible.runtime.memory import Memory
from grasping_invisible.runtime.motion import PUSH_NEARNESS, RAISED_TIPS, pushes_towards, tips_above, top_of
from grasping_invisible.runtime.perception import Perception


@dataclass(frozen=True)
class Hint:
    """Where to look for a target that is not seen. `cells`: (N, N) bool, all false where nothing says so.

    `places`: where its middle may be, (x, y) in the base frame, metres.
    """

    cells: NDArray[np.bool_]
    places: tuple[tuple[float, float], ...] = ()


def hint_to_follow(perception: Perception, memory: Memory) -> Hint:
    """Where a little of the target shows, otherwise around where it may be since it last did.

    A few pixels may be no target, and it may have been moved elsewhere: what the latest pushes all acted near in vain
    is left aside.
    """
    workspace = perception.maps.workspace
    nowhere = Hint(np.zeros_like(perception.hint))
    if perception.target_seen:
        return nowhere
    if perception.hint.any():
        hint = Hint(perception.hint, (workspace.middle_of(perception.hint),))
    else:
        hint = Hint(cells_around(memory.last_seen, workspace), memory.last_seen)
    in_vain = len(memory.failed_pushes) == REMEMBERED and all(
        any(math.dist(push, place) <= ACTS_AHEAD + PUSH_NEARNESS for place in hint.places)
        for push in memory.failed_pushes
    )
    return nowhere if in_vain and not perception.target_glimpsed else hint


def raised_tips(perception: Perception, hint: Hint) -> NDArray[np.float32]:
    """Height above the table, metres, of the fingertips of raised pushes: of each, (16, 112, 112).

    `RAISED_TIPS`, or for pushes towards the target just above it where it is lower, or what shows of it where that is a
    hint alone: such a push takes off what lies on it and leaves it where it is, while a low one moves both.
    """
    tips = np.full((ROTATIONS, ACTION_CELLS, ACTION_CELLS), RAISED_TIPS, np.float32)
    if perception.target_seen:
        where, lower = perception.mask, tips_above(top_of(perception.maps, perception.mask))
    elif perception.hint.any() and hint.cells.any():
        where, lower = hint.cells, tips_above(perception.hint_height)
    else:
        return tips
    if lower < RAISED_TIPS:
        tips[pushes_towards(where, perception.maps.workspace)] = lower
    return tips
