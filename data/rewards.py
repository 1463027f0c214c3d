"""The rewards that motions earn, from heightmaps before and after (paper, section V-B).

Each motion earns a stage's reward or nothing: less for a sensible intention, more for a result. When a rule or a number
below changes, its version in `data.labels.RULES` counts up.
"""

import math

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.target_border import TargetBorder, target_border

PUSH_AIMED = 0.25
PUSH_FREED = 0.5
GRASP_AIMED = 0.5
GRASP_SUCCEEDED = 1.0
# Square metres of the target's border that must become free: 50 cells of 2 mm, some 3 % of a 50 mm cube's border.
# On a scene that stands still the noise of the mask's edge makes up to 30.
FREED_AREA = 2.0e-4
# By how much r_b must fall as well. Where a push buries a part of the target its border gets shorter, and o_b falls
# although nothing became free.
FREED_RATIO = 0.02


def push_reward(
    before_height: NDArray[np.float32],
    before_mask: NDArray[np.bool_],
    after_height: NDArray[np.float32],
    after_mask: NDArray[np.bool_],
    start: tuple[float, float],
    yaw: float,
    length: float,
    resolution: float = 0.002,
) -> float:
    """Reward R_p of a push for the target under the masks.

    Heights (N, N) in metres and masks (N, N) bool, row 0 at the largest y. `start`: (row, column) in those
    cells, fractional, whole numbers at their middles. `yaw`: radians, counter-clockwise from +column seen
    from above. `length`: metres. `resolution`: metres a cell. A target that is no longer seen afterwards was
    not freed.
    """
    before = target_border(before_height, before_mask, resolution)
    after = target_border(after_height, after_mask, resolution)
    if is_freed(before, after, resolution):
        return PUSH_FREED
    if push_passes(before_mask, start, yaw, length / resolution):
        return PUSH_AIMED
    return 0.0


def grasp_reward(mask: NDArray[np.bool_], row: float, column: float, target_grasped: bool) -> float:
    """Reward R_g of a grasp at a cell, (row, column) in cells of the mask (N, N) before it, fractional."""
    if target_grasped:
        return GRASP_SUCCEEDED
    return GRASP_AIMED if _on_mask(mask, np.array([row]), np.array([column])) else 0.0


def is_freed(before: TargetBorder, after: TargetBorder, resolution: float) -> bool:
    """Whether so much of the target's border became free as earns a push R_p's second stage; metres a cell.

    A target that is not seen before and after was not freed.
    """
    if not before.target or not after.target:
        return False
    cells = before.occupied - after.occupied
    return cells >= round(FREED_AREA / resolution**2) and before.ratio - after.ratio >= FREED_RATIO


def freed_cells(
    before_height: NDArray[np.float32],
    before_mask: NDArray[np.bool_],
    after_height: NDArray[np.float32],
    after_mask: NDArray[np.bool_],
    resolution: float = 0.002,
) -> float:
    """By how many cells the border occupancy o_b fell; 0 where the target is not seen both before and after."""
    if not before_mask.any() or not after_mask.any():
        return 0.0
    before = target_border(before_height, before_mask, resolution)
    after = target_border(after_height, after_mask, resolution)
    return float(before.occupied - after.occupied)


def push_passes(mask: NDArray[np.bool_], start: tuple[float, float], yaw: float, length: float) -> bool:
    """Whether a push vector of `length` cells from `start`, (row, column), crosses the mask (N, N)."""
    along = np.linspace(0.0, length, 2 * math.ceil(length) + 1)
    return _on_mask(mask, start[0] - along * math.sin(yaw), start[1] + along * math.cos(yaw))


def _on_mask(mask: NDArray[np.bool_], rows: NDArray[np.float64], columns: NDArray[np.float64]) -> bool:
    row, column = np.rint(rows).astype(np.intp), np.rint(columns).astype(np.intp)
    inside = (row >= 0) & (row < mask.shape[0]) & (column >= 0) & (column < mask.shape[1])
    return bool(mask[row[inside], column[inside]].any())
