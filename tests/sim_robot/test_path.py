import numpy as np
import pytest

from grasping_invisible.sim_robot.kinematics import HOME_JOINTS, JOINT_SPEED, Kinematics
from grasping_invisible.sim_robot.path import Tool, Unreachable, line, stand_at, swing

HOME = Tool((0.3069, 0.0, 0.4853), -np.pi / 2)


@pytest.fixture(scope="module")
def kinematics():
    kinematics = Kinematics()
    yield kinematics
    kinematics.close()


def test_line_is_straight_and_keeps_its_speed(kinematics):
    end = Tool((0.55, 0.1, 0.25), -0.8)
    path = line(kinematics, HOME, end, HOME_JOINTS, speed=0.4)
    a, b = np.array(HOME.position), np.array(end.position)
    for time in np.linspace(0, path.duration, 25):
        reached = kinematics.forward(path.joints_at(time))[0]
        along = np.clip((reached - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        assert np.linalg.norm(reached - (a + along * (b - a))) < 0.006
    assert path.duration >= np.linalg.norm(b - a) / 0.4 - 1e-6
    steps = np.abs(np.diff(path.joints, axis=0)) / np.diff(path.times)[:, None]
    assert (steps <= JOINT_SPEED).all()


def test_a_line_that_leaves_reach_is_refused_whole(kinematics):
    with pytest.raises(Unreachable, match="cannot reach"):
        line(kinematics, HOME, Tool((0.95, 0.0, 0.1), -np.pi / 2), HOME_JOINTS, speed=0.4)


def test_swing_ends_where_it_should(kinematics):
    end = HOME_JOINTS + np.array([1.0, 0.1, 0, 0, 0, 0, 0])
    path = swing(kinematics, HOME_JOINTS, end, speed=0.5)
    np.testing.assert_allclose(path.joints_at(path.duration + 1.0), end)
    np.testing.assert_allclose(path.joints_at(0.0), HOME_JOINTS)


def test_backwards_is_the_same_way_back(kinematics):
    path = line(kinematics, HOME, Tool((0.5, 0.1, 0.3), -np.pi / 2), HOME_JOINTS, speed=0.4)
    back = path.backwards()
    np.testing.assert_allclose(back.joints_at(0.3), path.joints_at(path.duration - 0.3))
    assert back.duration == path.duration


@pytest.mark.parametrize(("x", "y", "yaw"), [(0.359, 0.0, 0.0), (0.41, 0.18, -3.1), (0.35, -0.01, -0.1)])
def test_a_pose_is_found_though_the_search_from_home_misses_it(kinematics, x, y, yaw):
    tool = Tool((x, y, 0.06), yaw)
    np.testing.assert_allclose(kinematics.forward(stand_at(kinematics, tool))[0], tool.position, atol=3e-3)
