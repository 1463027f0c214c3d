"""The pushing failure likelihood F_p: pushes near recent failures are less likely to succeed (paper, appendix D)."""

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import ACTION_CELLS, PUSH_LENGTH
from grasping_invisible.runtime.rotation import action_grid
from grasping_invisible.runtime.workspace import Workspace

REMEMBERED = 3  # the most recent failed pushes
SCALE = 0.75  # s: the likelihood at the place of a single failure
DEVIATION = PUSH_LENGTH  # metres, standard deviation of the Gaussian


def failure_likelihood(failed_pushes: tuple[tuple[float, float], ...], workspace: Workspace) -> NDArray[np.float32]:
    """F_p on the action grid, (112, 112) float32: 1 far from all failures, `SCALE` at a single one.

    `failed_pushes`: where failed pushes started, (x, y) in the base frame, most recent last; the last
    `REMEMBERED` count.
    """
    grid = action_grid(workspace)
    cells = np.arange(ACTION_CELLS)
    x = grid.low[0] + (cells + 0.5) * grid.resolution
    y = grid.high[1] - (cells[:, None] + 0.5) * grid.resolution
    likelihood = np.ones((ACTION_CELLS, ACTION_CELLS))
    for failed_x, failed_y in failed_pushes[-REMEMBERED:]:
        squared = (x - failed_x) ** 2 + (y - failed_y) ** 2
        likelihood *= 1.0 - (1.0 - SCALE) * np.exp(-squared / (2.0 * DEVIATION**2))
    return likelihood.astype(np.float32)
