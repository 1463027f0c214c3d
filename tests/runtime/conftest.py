"""Tables with blocks on them, as heightmaps and as what was perceived, built by hand."""

from collections.abc import Callable

import numpy as np
import pytest

from grasping_invisible.data.classes import CLASSES
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.perception import Perception
from grasping_invisible.runtime.workspace import Workspace

Block = tuple[float, float, float, float, str]  # x, y of its middle, side, top: metres; colour
TableWith = Callable[..., Heightmaps]


@pytest.fixture
def table_with() -> TableWith:
    """Heightmaps of square blocks on an otherwise empty table; later blocks lie over earlier ones."""

    def build(*blocks: Block) -> Heightmaps:
        workspace = Workspace()
        cells = workspace.cells
        height = np.zeros((cells, cells), np.float32)
        labels = np.zeros((cells, cells), np.uint8)
        for x, y, side, top, color in blocks:
            top_row, left = workspace.cell_of(x - side / 2 + 1e-6, y + side / 2 - 1e-6)
            extent = round(side / workspace.resolution)
            area = np.s_[max(0, top_row) : top_row + extent, max(0, left) : left + extent]
            height[area] = top
            labels[area] = CLASSES.index(color) if color in CLASSES else 0
        color = np.full((cells, cells, 3), 120, np.uint8)
        return Heightmaps(5, color, height, labels, workspace)

    return build


@pytest.fixture
def perceived(table_with: TableWith) -> Callable[..., Perception]:
    """What is perceived of such a table, with red the target."""

    def build(*blocks: Block) -> Perception:
        maps = table_with(*blocks)
        mask = maps.labels == CLASSES.index("red")
        return Perception(maps.labels, maps, mask, int(mask.sum()) * 3, {})

    return build
