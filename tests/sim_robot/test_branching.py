import math

import numpy as np
import pytest

from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.sim_robot.branching import BranchingRobot
from grasping_invisible.sim_robot.robot import SimRobot
from grasping_invisible.sim_robot.scene import Scene, SceneObject

SCENE = Scene(
    name="a cube and its neighbour",
    target="red",
    objects=(
        SceneObject(shape="cube", color="red", position=(0.0, 0.0, 0.025)),
        SceneObject(shape="cube", color="grey", position=(0.10, 0.0, 0.025)),
    ),
)
GRASP = gi.MotionCommand(id=1, kind=gi.GRASP, position=gi.Point(x=0.53, y=0.0, z=0.02), yaw=0.0)
BESIDE = gi.MotionCommand(id=1, kind=gi.GRASP, position=gi.Point(x=0.53, y=0.12, z=0.02), yaw=0.0)
PUSH = gi.MotionCommand(id=1, kind=gi.PUSH, position=gi.Point(x=0.53, y=-0.06, z=0.02), yaw=math.pi / 2, length=0.10)
TOO_FAR = gi.MotionCommand(id=1, kind=gi.GRASP, position=gi.Point(x=0.75, y=0.22, z=0.01), yaw=math.pi / 4)


def positions(robot: SimRobot) -> np.ndarray:
    return np.array([item.position for item in robot.world.object_states()])


@pytest.fixture(scope="module")
def robots():
    pair = SimRobot(SCENE, 0), BranchingRobot(SCENE, 0)
    yield pair
    for robot in pair:
        robot.close()


def test_the_world_is_put_back_exactly_as_often_as_one_likes(robots):
    robot = robots[1]
    state = robot.save()
    before = positions(robot)
    for command in (PUSH, GRASP, BESIDE, PUSH, GRASP):
        outcome = robot.execute(command)
        assert outcome.holding == (command is GRASP)
        assert command is BESIDE or not np.allclose(positions(robot), before, atol=0.02)
        robot.restore(state)
        np.testing.assert_array_equal(positions(robot), before)
        assert not robot.panda.holding
    robot.forget(state)


def test_the_same_motion_has_the_same_effect_as_with_the_way_there_and_back(robots):
    whole, short = robots
    state = short.save()
    for command in (BESIDE, PUSH):
        outcomes = [robot.execute(command) for robot in (whole, short)]
        assert outcomes[0].status == outcomes[1].status == gi.COMPLETED
        np.testing.assert_allclose(positions(whole), positions(short), atol=0.004)
    short.restore(state)


def test_what_cannot_be_reached_from_home_cannot_be_reached(robots):
    statuses = [robot.execute(TOO_FAR).status for robot in robots]
    assert statuses[0] == statuses[1]


def test_the_arm_is_out_of_the_picture_after_a_push(robots):
    robot = robots[1]
    state = robot.save()
    empty = robot.observe().depth
    robot.execute(PUSH)
    robot.restore(state)
    again = robot.observe().depth
    assert np.median(np.abs(again - empty)) < 0.005
    assert np.quantile(np.abs(again - empty), 0.999) < 0.02
    robot.forget(state)
