"""The pushing failure likelihood F_p: pushes near recent failures are less likely to succeed (paper, appendix D).

Near is meant of where pushes act, half of their way ahead of where they start: pushes at one heap from two sides start
far apart, and two that start side by side can meet different heaps.
"""

import math

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import ACTION_CELLS, PUSH_LENGTH, ROTATIONS
from grasping_invisible.runtime.rotation import ahead_of_cells
from grasping_invisible.runtime.workspace import Workspace

REMEMBERED = 3  # the most recent failed pushes
# s: the likelihood at the place of a single failure. A second push there is often the right one, and the critic sees
# what the first has left.
SCALE = 0.75
DEVIATION = 0.03  # metres, standard deviation of the Gaussian
ACTS_AHEAD = PUSH_LENGTH / 2


def acts_at(x: float, y: float, yaw: float) -> tuple[float, float]:
    """Where a push that starts at (x, y) acts, metres, in the same frame: in the middle of its way."""
    return x + ACTS_AHEAD * math.cos(yaw), y + ACTS_AHEAD * math.sin(yaw)


def failure_likelihood(failed_pushes: tuple[tuple[float, float], ...], workspace: Workspace) -> NDArray[np.float32]:
    """F_p of every push on the action grid, (16, 112, 112) float32: 1 far from all failures, `SCALE` at a single one.

    `failed_pushes`: where failed pushes acted, (x, y) in the base frame, most recent last; the last
    `REMEMBERED` count.
    """
    acts_x, acts_y = ahead_of_cells(ACTS_AHEAD, workspace)
    likelihood = np.ones((ROTATIONS, ACTION_CELLS, ACTION_CELLS))
    for failed_x, failed_y in failed_pushes[-REMEMBERED:]:
        # The Gaussian of the distance is that along x times that along y.
        along_x, along_y = (
            np.exp(-(distance**2) / (2.0 * DEVIATION**2)) for distance in (acts_x - failed_x, acts_y - failed_y)
        )
        likelihood *= 1.0 - (1.0 - SCALE) * along_x * along_y
    return likelihood.astype(np.float32)
