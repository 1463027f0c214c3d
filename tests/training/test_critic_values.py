import numpy as np

from grasping_invisible.data.action_grid import RAISED
from grasping_invisible.runtime.critic import QMaps
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.workspace import Workspace
from grasping_invisible.training.critic_values import best_values

WORKSPACE = Workspace()
OUTWARDS = 4  # the rotation of a push along +y


def block_at(y: float) -> tuple[Heightmaps, np.ndarray]:
    """A red cube of 50 mm on an empty table, in the middle of the workspace's x, and its mask."""
    mask = np.zeros((WORKSPACE.cells, WORKSPACE.cells), np.bool_)
    row, column = (int(at) for at in WORKSPACE.cell_of(WORKSPACE.center[0], y))
    mask[row - 12 : row + 13, column - 12 : column + 13] = True
    height = np.where(mask, 0.05, 0.0).astype(np.float32)
    return Heightmaps(5, np.zeros((*mask.shape, 3), np.uint8), height, mask.astype(np.uint8), WORKSPACE), mask


def beside(neighbour: float) -> tuple[Heightmaps, np.ndarray]:
    """A low block of 20 mm with a cube of some height beside it, and the low one's mask."""
    maps, mask = block_at(0.0)
    maps.height[mask] = 0.02
    maps.height[np.roll(mask, 25, axis=1)] = neighbour
    return maps, mask


def valued(outwards: float, others: float, grasps: float) -> QMaps:
    push = np.full((2, 16, 112, 112), others, np.float32)
    push[:, OUTWARDS] = outwards
    return QMaps(push, np.full((16, 112, 112), grasps, np.float32))


def test_the_best_of_what_the_robot_would_choose_from():
    assert best_values(valued(0.9, 0.4, 0.7), *block_at(0.0)) == (np.float32(0.9), np.float32(0.7))
    at_the_edge = block_at(WORKSPACE.high[1] - 0.08)
    assert best_values(valued(0.9, 0.4, 0.7), *at_the_edge) == (np.float32(0.4), np.float32(0.7))


def test_a_raised_push_passes_just_above_a_low_target_as_on_the_robot():
    raised = valued(0.4, 0.4, 0.7)
    raised.push[RAISED] = 0.9
    assert best_values(raised, *beside(0.045))[0] == np.float32(0.9)
    assert best_values(raised, *beside(0.025))[0] == np.float32(0.4)
