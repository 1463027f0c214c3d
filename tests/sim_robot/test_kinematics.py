import numpy as np
import pybullet
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from grasping_invisible.sim_robot.kinematics import HOME_JOINTS, JOINT_LOWER, JOINT_UPPER, Kinematics, tool_down

yaws = st.floats(-np.pi, np.pi)


@pytest.fixture(scope="module")
def kinematics():
    kinematics = Kinematics()
    yield kinematics
    kinematics.close()


@given(yaws)
def test_tool_down_points_down_and_closes_along_yaw(yaw):
    matrix = np.array(pybullet.getMatrixFromQuaternion(tool_down(yaw))).reshape(3, 3)
    np.testing.assert_allclose(matrix[:, 2], [0, 0, -1], atol=1e-6)
    np.testing.assert_allclose(matrix[:, 1], [np.cos(yaw), np.sin(yaw), 0], atol=1e-6)


def test_home_stands_behind_the_workspace_with_the_gripper_down(kinematics):
    position, quaternion = kinematics.forward(HOME_JOINTS)
    np.testing.assert_allclose(position, [0.307, 0.0, 0.485], atol=2e-3)
    assert abs(quaternion @ tool_down(-np.pi / 2)) == pytest.approx(1.0, abs=1e-6)


@settings(deadline=None, max_examples=40)
@given(st.floats(0.35, 0.74), st.floats(-0.2, 0.2), st.floats(0.015, 0.25), st.floats(-np.pi, 0.0))
def test_inverse_reaches_the_pose_within_joint_limits(kinematics, x, y, z, yaw):
    goal = np.array([x, y, z])
    joints = kinematics.inverse_from_anywhere(goal, tool_down(yaw))
    if joints is None:  # at the workspace's corners only one way round of the hand fits
        joints = kinematics.inverse_from_anywhere(goal, tool_down(yaw + np.pi))
    assert joints is not None
    assert (joints >= JOINT_LOWER).all()
    assert (joints <= JOINT_UPPER).all()
    np.testing.assert_allclose(kinematics.forward(joints)[0], goal, atol=3e-3)


@pytest.mark.parametrize("goal", [(1.2, 0.0, 0.1), (0.5, 0.9, 0.1), (0.5, 0.0, 1.4)])
def test_out_of_reach_is_none_not_a_near_miss(kinematics, goal):
    assert kinematics.inverse(np.array(goal), tool_down(0.0), HOME_JOINTS) is None
