"""Paths of the arm, planned whole before anything moves: straight TCP lines as timed joint angles."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.sim_robot.kinematics import JOINT_SPEED, Kinematics, tool_down

WAYPOINT_SPACING = 0.02  # metres between the poses at which inverse kinematics is solved
WAYPOINT_TURN = np.radians(6.0)
JOINT_SPEED_SHARE = 0.8  # of Franka's limits
MAX_JOINT_STEP = 0.6  # radians between waypoints; more means the arm would swing to another branch


class Unreachable(Exception):
    """No joint angles bring the gripper somewhere along the path; nothing has moved."""


@dataclass(frozen=True)
class Tool:
    """A gripper pose that points down: TCP position (x, y, z), metres, and closing axis yaw, radians, base frame."""

    position: tuple[float, float, float]
    yaw: float

    def at_height(self, z: float) -> "Tool":
        """The same pose at another height in metres."""
        return Tool((self.position[0], self.position[1], z), self.yaw)


@dataclass(frozen=True)
class JointPath:
    """Joint angles (N, 7), radians, at times (N,), seconds from its start, and the TCP positions (N, 3) they reach."""

    times: NDArray[np.float64]
    joints: NDArray[np.float64]
    positions: NDArray[np.float64]

    @property
    def duration(self) -> float:
        """Seconds."""
        return float(self.times[-1])

    def joints_at(self, time: float) -> NDArray[np.float64]:
        """Joint angles (7,) at a time, held at both ends."""
        return np.array([np.interp(time, self.times, self.joints[:, j]) for j in range(7)])

    def position_at(self, time: float) -> NDArray[np.float64]:
        """Intended TCP position (3,), metres, base frame."""
        return np.array([np.interp(time, self.times, self.positions[:, axis]) for axis in range(3)])

    def backwards(self) -> "JointPath":
        """The same path from its end to its start."""
        return JointPath(self.times[-1] - self.times[::-1], self.joints[::-1], self.positions[::-1])

    @property
    def end(self) -> NDArray[np.float64]:
        """The last joint angles (7,)."""
        return self.joints[-1]


def stand_at(kinematics: Kinematics, tool: Tool) -> NDArray[np.float64]:
    """Joint angles (7,) of a pose, whatever the arm's posture now. Raises `Unreachable`."""
    joints = kinematics.inverse_from_anywhere(np.array(tool.position), tool_down(tool.yaw))
    if joints is None:
        raise _unreachable(tool.position)
    return joints


def line(kinematics: Kinematics, start: Tool, end: Tool, seed: NDArray[np.float64], speed: float) -> JointPath:
    """A straight TCP line from `start` to `end` at `speed` metres a second, slower where a joint limits it.

    `seed`: the joint angles (7,) at `start`. Raises `Unreachable`.
    """
    a, b = np.array(start.position), np.array(end.position)
    turn = end.yaw - start.yaw
    count = max(2, 1 + int(np.ceil(max(np.linalg.norm(b - a) / WAYPOINT_SPACING, abs(turn) / WAYPOINT_TURN))))
    fractions = np.linspace(0.0, 1.0, count)
    positions = a + fractions[:, None] * (b - a)
    joints = np.empty((count, 7))
    previous = seed
    for index, fraction in enumerate(fractions):
        solution = kinematics.inverse(positions[index], tool_down(start.yaw + fraction * turn), previous)
        if solution is None or (index and np.abs(solution - previous).max() > MAX_JOINT_STEP):
            raise _unreachable(positions[index])
        joints[index] = previous = solution
    return _timed(joints, positions, speed)


def swing(kinematics: Kinematics, start: NDArray[np.float64], end: NDArray[np.float64], speed: float) -> JointPath:
    """A path straight in joint space, for long moves well above the table; `speed` of the TCP, metres a second."""
    count = max(2, 1 + int(np.ceil(np.abs(end - start).max() / 0.1)))
    joints = start + np.linspace(0.0, 1.0, count)[:, None] * (end - start)
    return _timed(joints, np.array([kinematics.forward(q)[0] for q in joints]), speed)


def _timed(joints: NDArray[np.float64], positions: NDArray[np.float64], speed: float) -> JointPath:
    steps = np.linalg.norm(np.diff(positions, axis=0), axis=1) / speed
    limits = (np.abs(np.diff(joints, axis=0)) / (JOINT_SPEED_SHARE * JOINT_SPEED)).max(axis=1)
    times = np.concatenate([[0.0], np.cumsum(np.maximum(np.maximum(steps, limits), 1e-3))])
    return JointPath(times, joints, positions)


def _unreachable(position: Sequence[float] | NDArray[np.float64]) -> Unreachable:
    x, y, z = position
    return Unreachable(f"the arm cannot reach ({x:.3f}, {y:.3f}, {z:.3f}) m with the gripper pointing down")
