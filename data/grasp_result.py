"""What a grasp took, judged from the heightmaps before and after it."""

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import heightmap_cell
from grasping_invisible.data.heightmap_message import HeightmapArrays

GONE = 0.7  # share of an object's cells that must vanish for it to be what the gripper holds
GRASP_SURROUNDINGS = 0.06  # metres around a grasp in which its object's cells are counted


def mostly_gone(before: NDArray[np.bool_], after: NDArray[np.bool_]) -> bool:
    """Whether at least `GONE` of the cells of a mask before a motion, (N, N), are missing from the one after it."""
    return bool(np.count_nonzero(after) <= (1.0 - GONE) * np.count_nonzero(before))


def grasped_class(before: HeightmapArrays, after: HeightmapArrays, row: int, column: int) -> int | None:
    """Which class a grasp at a cell of the action grid took: the one under it, if it vanished from there.

    None when unsure, and for what is of no target's colour.
    """
    at_row, at_column = (round(value) for value in heightmap_cell(row, column, len(before.labels)))
    under = before.labels[_window(at_row, 2), _window(at_column, 2)]
    index = int(np.bincount(under.ravel(), minlength=1).argmax())
    if index == 0:
        return None
    reach = round(GRASP_SURROUNDINGS / before.resolution / 2)
    around = _window(at_row, reach), _window(at_column, reach)
    return index if mostly_gone(before.labels[around] == index, after.labels[around] == index) else None


def _window(middle: int, reach: int) -> slice:
    return slice(max(0, middle - reach), middle + reach + 1)
