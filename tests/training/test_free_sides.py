import numpy as np
import pytest

from grasping_invisible.data.classes import CLASSES
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.workspace import Workspace
from grasping_invisible.training.free_sides import has_free_sides

TARGET = (0.0, 0.0, 0.05, 0.05)  # x, y from the workspace's middle, extent along x and y: metres


def table(*blocks: tuple[float, float, float, float], height: float = 0.05) -> tuple[Heightmaps, np.ndarray]:
    """Blocks on a table, the first of them the target; and its mask."""
    workspace = Workspace()
    heights = np.zeros((workspace.cells,) * 2, np.float32)
    labels = np.zeros(heights.shape, np.uint8)
    for index, (x, y, width, depth) in enumerate(blocks):
        row, column = workspace.cell_of(workspace.center[0] + x, workspace.center[1] + y)
        half = round(depth / 2 / workspace.resolution), round(width / 2 / workspace.resolution)
        area = np.s_[int(row) - half[0] : int(row) + half[0], int(column) - half[1] : int(column) + half[1]]
        heights[area] = height
        labels[area] = CLASSES.index("red") if index == 0 else 0
    color = np.zeros((*heights.shape, 3), np.uint8)
    return Heightmaps(0, color, heights, labels, workspace), labels > 0


SIDES = ((0.06, 0.0, 0.05, 0.05), (-0.06, 0.0, 0.05, 0.05), (0.0, 0.06, 0.17, 0.05), (0.0, -0.06, 0.17, 0.05))


@pytest.mark.parametrize(
    ("blocks", "free"),
    [
        ((TARGET,), True),
        ((TARGET, *SIDES[:2]), True),  # from above and below
        ((TARGET, *SIDES[2:]), True),
        ((TARGET, *SIDES), False),
        (((0.0, 0.0, 0.12, 0.12),), False),  # wider than the opening
        (((0.0, 0.0, 0.12, 0.04),), True),  # a plank, across
    ],
)
def test_fingers_need_room_on_two_opposite_sides(blocks, free):
    assert has_free_sides(*table(*blocks)) is free


def test_neighbours_below_the_fingertips_do_not_count():
    maps, mask = table(TARGET, *SIDES)
    maps.height[~mask & (maps.height > 0)] = 0.010
    assert has_free_sides(maps, mask)


def test_nothing_is_nowhere():
    maps, mask = table(TARGET)
    assert not has_free_sides(maps, np.zeros_like(mask))
