"""Forward and inverse kinematics of the Panda, computed on a copy of the arm that nothing can touch."""

from pathlib import Path

import numpy as np
import pybullet
import pybullet_data
from numpy.typing import NDArray

PANDA_URDF = str(Path(pybullet_data.getDataPath()) / "franka_panda" / "panda.urdf")

ARM_JOINTS = tuple(range(7))
FINGER_JOINTS = (9, 10)
HAND_LINK = 8
FINGER_LINKS = (9, 10)
TCP_LINK = 11  # between the finger pads, 0.105 m from the hand's flange

# Franka's own limits for the Panda: radians, radians a second, newton metres.
JOINT_LOWER = np.array([-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973])
JOINT_UPPER = np.array([2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973])
JOINT_SPEED = np.array([2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61])
JOINT_TORQUE = np.array([87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0])

# Franka's "ready" posture: gripper down, TCP about (0.307, 0, 0.485), behind the camera's view.
HOME_JOINTS = np.array([0.0, -np.pi / 4, 0.0, -3 * np.pi / 4, 0.0, np.pi / 2, np.pi / 4])

# From home as it is, then with the elbow swung out or the wrist turned: the arm has one joint more than a pose needs.
_SEED_TURNS = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.4, 0.0, -0.4, 0.0, 0.0, 0.0, 0.0],
        [-0.4, 0.0, 0.4, 0.0, 0.0, 0.0, 0.0],
        [0.0, 0.2, 0.0, 0.3, 0.0, 0.4, 1.0],
        [0.0, 0.2, 0.0, 0.3, 0.0, 0.4, -1.0],
        [0.8, 0.2, -0.8, 0.0, 0.4, 0.0, 0.0],
        [-0.8, 0.2, 0.8, 0.0, -0.4, 0.0, 0.0],
    ]
)

POSITION_TOLERANCE = 0.003  # metres
ANGLE_TOLERANCE = np.radians(2.0)


def tool_down(closing_yaw: float) -> NDArray[np.float64]:
    """Quaternion (x, y, z, w), base frame, of a gripper pointing down whose fingers close along `closing_yaw`."""
    c, s = np.cos(closing_yaw), np.sin(closing_yaw)
    # Columns: the hand's x, y (closing axis) and z (down) axes, which make a half turn about a horizontal axis.
    matrix = np.array([[-s, c, 0.0], [c, s, 0.0], [0.0, 0.0, -1.0]])
    axis = np.array([matrix[0, 0] + 1.0, matrix[1, 0], 0.0])
    if np.linalg.norm(axis) < 1e-9:
        axis = np.array([0.0, 1.0, 0.0])
    axis /= np.linalg.norm(axis)
    return np.array([axis[0], axis[1], axis[2], 0.0])


class Kinematics:
    """Inverse kinematics of the tool centre point, base frame. One instance is not safe across threads."""

    def __init__(self) -> None:
        self._client = pybullet.connect(pybullet.DIRECT)
        self._arm = pybullet.loadURDF(PANDA_URDF, useFixedBase=True, physicsClientId=self._client)

    def forward(self, joints: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """TCP position (3,) metres and quaternion (4,) x, y, z, w of seven joint angles in radians."""
        self._set(joints)
        state = pybullet.getLinkState(self._arm, TCP_LINK, computeForwardKinematics=True, physicsClientId=self._client)
        return np.array(state[4]), np.array(state[5])

    def inverse(
        self, position: NDArray[np.float64], quaternion: NDArray[np.float64], seed: NDArray[np.float64]
    ) -> NDArray[np.float64] | None:
        """Seven joint angles, near `seed`, that bring the TCP to a pose; None where the search from there ends nowhere.

        A solution is within 3 mm and 2 degrees of the pose and inside Franka's joint limits.
        """
        joints = seed
        for _ in range(4):
            self._set(joints)
            solution = pybullet.calculateInverseKinematics(
                self._arm,
                TCP_LINK,
                position.tolist(),
                quaternion.tolist(),
                maxNumIterations=50,
                residualThreshold=1e-5,
                physicsClientId=self._client,
            )
            joints = np.clip(np.array(solution[:7]), JOINT_LOWER, JOINT_UPPER)
            if self._is_at(joints, position, quaternion):
                return joints
        return None

    def inverse_from_anywhere(
        self, position: NDArray[np.float64], quaternion: NDArray[np.float64]
    ) -> NDArray[np.float64] | None:
        """Like `inverse`, but searched from home with the elbow and wrist turned to several sides."""
        for turn in _SEED_TURNS:
            joints = self.inverse(position, quaternion, HOME_JOINTS + turn)
            if joints is not None:
                return joints
        return None

    def close(self) -> None:
        """Free the copy of the arm."""
        pybullet.disconnect(physicsClientId=self._client)

    def _is_at(
        self, joints: NDArray[np.float64], position: NDArray[np.float64], quaternion: NDArray[np.float64]
    ) -> bool:
        reached, turned = self.forward(joints)
        angle = 2.0 * np.arccos(min(1.0, abs(float(turned @ quaternion))))
        return float(np.linalg.norm(reached - position)) < POSITION_TOLERANCE and angle < ANGLE_TOLERANCE

    def _set(self, joints: NDArray[np.float64]) -> None:
        for index, angle in zip(ARM_JOINTS, joints, strict=True):
            pybullet.resetJointState(self._arm, index, float(angle), physicsClientId=self._client)
