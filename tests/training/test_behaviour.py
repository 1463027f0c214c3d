import numpy as np
import pytest

from grasping_invisible.data.action_grid import ACTION_CELLS, PUSH_LEVELS, RAISED, ROTATIONS
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.workspace import Workspace
from grasping_invisible.sim_robot.robot import SimRobot
from grasping_invisible.sim_robot.scene import Scene, SceneObject
from grasping_invisible.training.behaviour import Behaviour

SCENE = Scene(name="one", target="red", objects=(SceneObject(shape="cube", color="red", position=(0, 0, 0.026)),))


@pytest.fixture(scope="module")
def robot():
    robot = SimRobot(SCENE, 0)
    yield robot
    robot.close()


def empty_table() -> Heightmaps:
    workspace = Workspace()
    cells = workspace.cells
    return Heightmaps(
        0,
        np.zeros((cells, cells, 3), np.uint8),
        np.zeros((cells, cells), np.float32),
        np.zeros((cells, cells), np.uint8),
        workspace,
    )


def test_labels_are_the_simulators_own(robot):
    frame = robot.observe()
    labels = Behaviour(robot, None, 1.0, False, 0).segment(frame.color)
    seen = frame.color[labels == 1].astype(int)
    assert len(seen) > 500
    assert (seen[:, 0] > seen[:, 1] + 80).all()  # red where the labels say red


@pytest.mark.parametrize("k", [0, 3, 4, 10])
def test_exploring_pushes_favour_the_way_to_the_target(robot, k):
    maps, mask = empty_table(), np.zeros((224, 224), bool)
    mask[108:116, 108:116] = True
    push = Behaviour(robot, None, 1.0, False, 0).q_maps(maps, mask).push[RAISED]
    best_row, best_column = np.unravel_index(push[k].argmax(), push[k].shape)
    yaw = k * 2 * np.pi / ROTATIONS
    to_target = np.array([55.5 - best_column, best_row - 55.5])  # x right, y up
    along = to_target @ [np.cos(yaw), np.sin(yaw)]
    across = to_target @ [-np.sin(yaw), np.cos(yaw)]
    assert -10 <= along <= 36
    assert abs(across) <= 11


def test_same_seed_same_noise_other_seed_other_noise(robot):
    maps, mask = empty_table(), np.zeros((224, 224), bool)
    first, again, other = (Behaviour(robot, None, 1.0, False, seed).q_maps(maps, mask) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first.grasp, again.grasp)
    assert (first.grasp != other.grasp).any()
    assert first.push.shape == (len(PUSH_LEVELS), ROTATIONS, ACTION_CELLS, ACTION_CELLS)
