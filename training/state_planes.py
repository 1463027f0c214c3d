"""What a critic sees of a state, kept unpacked in memory: an image is decoded once, not at every step of a training."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.runtime.rotation import PLANES, critic_planes
from grasping_invisible.training.packed_maps import PackedMaps
from grasping_invisible.training.transitions import Transition, goal_mask

STATES_KEPT = 30_000  # 0.1 MB each
MASKS_KEPT = 60_000  # 25 kB each


def planes_of(transition: Transition, count: int) -> NDArray[np.float32]:
    """The state before a transition with its goal's mask, `count` of `critic_planes`: (112, 112, P), a copy."""
    seen = _seen(transition.seen)[..., PLANES - count :]
    return np.dstack([seen, _mask(transition.seen, transition.goal)]).astype(np.float32)


@lru_cache(maxsize=STATES_KEPT)
def _seen(state: PackedMaps) -> NDArray[np.float16]:
    """All planes but the mask; half floats are exact to 0.05 mm of height at 10 cm."""
    maps = state.unpack()
    return critic_planes(maps, np.zeros_like(maps.labels, np.bool_))[..., :-1].astype(np.float16)


@lru_cache(maxsize=MASKS_KEPT)
def _mask(state: PackedMaps, goal: int) -> NDArray[np.float16]:
    maps = state.unpack()
    return critic_planes(maps, goal_mask(maps, goal), 2)[..., -1].astype(np.float16)
