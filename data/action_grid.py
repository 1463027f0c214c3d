"""Motions as cells of a grid over the workspace and directions: where each begins, and what it is aimed at.

The action grid has 112 x 112 cells over the workspace, oriented like the heightmaps: row 0 at the largest y, column 0
at the smallest x. Each cell has 16 directions, 22.5 degrees apart (paper, section IV-A), and a push may be made at one
of two heights.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.target_border import distance_to

ACTION_CELLS = 112
ROTATIONS = 16
PUSH_LENGTH = 0.10  # metres
# How high a push may pass: over what the fingers come down on, or raised over all that lies as low as a target.
LOW, RAISED = PUSH_LEVELS = range(2)
GRASP_MARGIN = 0.006  # metres beside the target's mask at which its grasp may still be aimed


def rotation_angle(k: int) -> float:
    """Yaw in radians of rotation `k` (22.5 degree steps), counter-clockwise from +x seen from above."""
    return k * (2.0 * np.pi / ROTATIONS)


def heightmap_cell(row: int, column: int, cells: int) -> tuple[float, float]:
    """The (row, column), fractional, of the middle of a cell of the action grid, in a heightmap of `cells` a side."""
    factor = cells / ACTION_CELLS
    return (row + 0.5) * factor - 0.5, (column + 0.5) * factor - 0.5


def feasible_grasps(mask: NDArray[np.bool_], resolution: float) -> NDArray[np.bool_]:
    """Which grasps are aimed at the target, its mask (N, N) grown by `GRASP_MARGIN`: (16, 112, 112) bool."""
    if not mask.any():
        return np.zeros((ROTATIONS, ACTION_CELLS, ACTION_CELLS), np.bool_)
    near = distance_to(mask) * resolution <= GRASP_MARGIN + 1e-6
    return np.broadcast_to(blocks(near).any(axis=(1, 3)), (ROTATIONS, ACTION_CELLS, ACTION_CELLS))


def blocks(values: NDArray[Any]) -> NDArray[Any]:
    """Heightmap cells, (N, N), by the cell of the action grid they lie in: (112, N / 112, 112, N / 112)."""
    factor = values.shape[0] // ACTION_CELLS
    return values.reshape(ACTION_CELLS, factor, ACTION_CELLS, factor)
