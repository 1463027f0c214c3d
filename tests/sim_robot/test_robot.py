"""The simulated Panda as a user of the `Robot` interface sees it, in a real PyBullet world."""

import math

import numpy as np
import pytest

from grasping_invisible.data.action_grid import LOW, RAISED
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.errors import RobotError
from grasping_invisible.runtime.heightmap import project
from grasping_invisible.runtime.motion import cell_position, push_heights
from grasping_invisible.runtime.rotation import action_grid
from grasping_invisible.sim_robot.robot import SimRobot
from grasping_invisible.sim_robot.scene import Scene, SceneObject


def scene(*objects: SceneObject) -> Scene:
    return Scene(name="test", target="red", objects=objects)


def block(shape="cube", color="red", x=0.0, y=0.0, z=0.026, yaw=0.0) -> SceneObject:
    return SceneObject(shape=shape, color=color, position=(x, y, z), yaw=yaw)


def command(kind, x=0.53, y=0.0, z=0.02, yaw=0.0, length=0.1, identity=1, opening=0.0) -> gi.MotionCommand:
    position = gi.Point(x=x, y=y, z=z)
    return gi.MotionCommand(id=identity, kind=kind, position=position, yaw=yaw, length=length, opening=opening)


def position_of(robot: SimRobot, color: str) -> np.ndarray:
    truth = next(item for item in robot.truth().objects if item.color == color)
    return np.array([truth.position.x, truth.position.y, truth.position.z])


@pytest.fixture
def make():
    robots: list[SimRobot] = []

    def build(*objects: SceneObject, **options) -> SimRobot:
        robots.append(SimRobot(scene(*objects), seed=0, **options))
        return robots[-1]

    yield build
    for robot in robots:
        robot.close()


def test_grasp_lifts_by_friction_and_place_puts_it_in_the_bin(make):
    robot = make(block(yaw=0.3))
    outcome = robot.execute(command(gi.GRASP, yaw=0.3))
    assert outcome.status == gi.COMPLETED
    assert outcome.holding
    assert 0.045 < outcome.gripper_width < 0.056
    assert robot.truth().held_object == "00_red_cube"
    assert position_of(robot, "red")[2] > 0.4
    placed = robot.execute(command(gi.PLACE))
    assert placed.status == gi.COMPLETED
    assert not placed.holding
    assert not robot.workspace.contains(*position_of(robot, "red")[:2])


def test_grasp_of_nothing_says_so(make):
    robot = make(block(x=0.1))
    outcome = robot.execute(command(gi.GRASP, x=0.44))
    assert outcome.status == gi.COMPLETED
    assert not outcome.holding
    assert outcome.gripper_width < 0.004


def test_fingers_landing_on_a_block_are_reported_as_blocked(make):
    robot = make(block(), block("cube", "grey", x=0.051), block("cube", "grey", x=-0.051))
    outcome = robot.execute(command(gi.GRASP, yaw=0.0))
    assert outcome.status == gi.BLOCKED
    assert not outcome.holding
    assert 0.5 < outcome.path_fraction < 1.0
    assert np.abs(position_of(robot, "red")[:2] - [0.53, 0.0]).max() < 0.01


def test_fingers_that_fit_a_block_come_down_where_fully_open_ones_cannot(make):
    neighbours = [block("cube", "grey", x=sign * 0.060) for sign in (-1, 1)]
    assert not make(block(), *neighbours).execute(command(gi.GRASP)).holding
    assert make(block(), *neighbours).execute(command(gi.GRASP, opening=0.062)).holding


@pytest.mark.parametrize("yaw", [0.0, math.pi / 2, -3 * math.pi / 4])
def test_push_moves_what_lies_ahead_along_yaw(make, yaw):
    robot = make(block(yaw=yaw))
    before = position_of(robot, "red")
    start = before[:2] - 0.09 * np.array([math.cos(yaw), math.sin(yaw)])
    outcome = robot.execute(command(gi.PUSH, x=start[0], y=start[1], yaw=yaw))
    assert outcome.status == gi.COMPLETED
    moved = position_of(robot, "red")[:2] - before[:2]
    along = moved @ [math.cos(yaw), math.sin(yaw)]
    assert 0.03 < along < 0.07
    assert abs(moved @ [-math.sin(yaw), math.cos(yaw)]) < 0.015


def test_a_push_over_a_block_moves_what_stands_on_its_neighbour_and_nothing_else(make):
    robot = make(block(color="grey", x=-0.026), block(color="grey", x=0.026), block(x=0.03, z=0.077))
    middle = robot.workspace.center
    frame = robot.observe()
    maps = project(frame, robot.truth_labels(), robot.workspace)
    row, column = action_grid(robot.workspace).cell_of(middle[0] - 0.032, middle[1])
    x, y = cell_position(row, column, robot.workspace)
    before = position_of(robot, "red"), position_of(robot, "grey")
    outcome = robot.execute(command(gi.PUSH, x, y, middle[2] + float(push_heights(maps)[LOW, 0, row, column])))
    assert outcome.path_fraction > 0.5, outcome.detail  # it may be blocked once the red one tips over the edge
    assert position_of(robot, "red")[0] - before[0][0] > 0.03
    assert np.linalg.norm(position_of(robot, "grey") - before[1]) < 0.005


@pytest.mark.parametrize(("level", "roof_alone"), [(RAISED, True), (LOW, False)])
def test_a_raised_push_takes_the_roof_off_a_house_that_a_low_one_moves_as_a_whole(make, level, roof_alone):
    walls = block(color="grey", x=-0.026), block(color="grey", x=0.026)
    robot = make(*walls, block("plank", z=0.064))
    middle = robot.workspace.center
    maps = project(robot.observe(), robot.truth_labels(), robot.workspace)
    row, column = action_grid(robot.workspace).cell_of(middle[0] - 0.085, middle[1])
    roof, wall = position_of(robot, "red"), position_of(robot, "grey")
    height = middle[2] + float(push_heights(maps)[level, 0, row, column])
    robot.execute(command(gi.PUSH, *cell_position(row, column, robot.workspace), height))
    assert np.linalg.norm(position_of(robot, "red") - roof) > 0.03
    assert (np.linalg.norm(position_of(robot, "grey") - wall) < 0.005) == roof_alone


def test_a_push_into_something_heavy_is_blocked_and_says_how_far_it_came(make):
    anvil = SceneObject(shape="cube", color="red", position=(0.05, 0.0, 0.026), mass=8.0, friction=1.5)
    robot = make(anvil)
    outcome = robot.execute(command(gi.PUSH, x=0.50, y=0.0))
    assert outcome.status == gi.BLOCKED
    assert 0.0 < outcome.path_fraction < 1.0


def test_what_cannot_be_reached_is_reported_and_nothing_moves(make):
    robot = make(block())
    before = robot.panda.joints
    outcome = robot.execute(command(gi.PUSH, x=0.75, y=0.2, yaw=0.0))
    assert outcome.status == gi.UNREACHABLE
    assert "cannot reach" in outcome.detail
    np.testing.assert_array_equal(robot.panda.joints, before)


@pytest.mark.parametrize(
    ("bad", "says"),
    [
        (command(gi.PUSH, x=0.9), "outside the workspace"),
        (command(gi.GRASP, z=-0.01), "height"),
        (command(gi.PUSH, length=0.4), "push length"),
        (command(gi.PUSH, yaw=float("nan")), "finite"),
        (gi.MotionCommand(id=1), "unknown motion kind"),
    ],
)
def test_refuses_what_is_not_safe(make, bad, says):
    robot = make(block())
    with pytest.raises(RobotError, match=says):
        robot.execute(bad)


def test_refuses_to_push_with_something_in_the_gripper(make):
    robot = make(block())
    robot.execute(command(gi.GRASP))
    with pytest.raises(RobotError, match="PLACE"):
        robot.execute(command(gi.PUSH))


def test_a_stop_ends_the_motion_and_home_is_wanted_next(make):
    robot = make(block())
    robot._on_tick = lambda seconds: robot.request_stop("test") if seconds > 1.0 else None
    outcome = robot.execute(command(gi.PUSH, x=0.46))
    assert outcome.status == gi.STOPPED
    assert robot.state == gi.SAFE_STOP
    with pytest.raises(RobotError, match="HOME"):
        robot.execute(command(gi.PUSH))
    robot._on_tick = None
    assert robot.execute(command(gi.HOME)).status == gi.COMPLETED
    assert robot.state == gi.IDLE


def test_what_falls_when_the_arm_is_stopped_comes_to_rest(make):
    robot = make(block(), block(color="green", z=0.076))
    robot._on_tick = lambda seconds: robot.request_stop("test") if position_of(robot, "green")[2] < 0.07 else None
    assert robot.execute(command(gi.PUSH, x=0.46, z=0.075)).status == gi.STOPPED
    lies = position_of(robot, "green")
    robot.world.step(240)
    np.testing.assert_allclose(position_of(robot, "green"), lies, atol=1e-3)


def test_same_seed_same_world_after_the_same_motions(make):
    def run():
        robot = make(block(yaw=0.4), block("plank", "grey", x=0.06, y=0.05, z=0.013, yaw=1.0))
        robot.execute(command(gi.PUSH, x=0.46, y=0.01))
        return robot.observe(), robot.truth()

    (first, truth_1), (second, truth_2) = run(), run()
    np.testing.assert_array_equal(first.color, second.color)
    np.testing.assert_array_equal(first.depth, second.depth)
    assert [item.position for item in truth_1.objects] == [item.position for item in truth_2.objects]


def test_truth_counts_the_pixels_that_the_frame_shows(make):
    robot = make(block(), block("cube", "grey", x=0.1))
    robot.observe()
    assert all(item.visible_pixels > 500 for item in robot.truth().objects)


def test_telemetry_names_links_and_the_camera(make):
    robot = make(block())
    names = {item.child_frame_id for item in robot.transforms(5).transforms}
    assert {"panda_link7", "panda_hand", "camera_color_optical_frame"} <= names
    joints = {joint.name: joint.position for joint in robot.joint_states(5).joints}
    assert joints["panda_joint4"] == pytest.approx(-3 * math.pi / 4, abs=0.01)
    assert joints["panda_finger_joint1"] == pytest.approx(0.04, abs=1e-3)
