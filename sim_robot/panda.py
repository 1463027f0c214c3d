"""The Panda's body in a PyBullet world: joint position control, contact forces, and the gripper."""

from collections.abc import Callable

import numpy as np
import pybullet
from numpy.typing import NDArray

from grasping_invisible.sim_robot.kinematics import (
    ARM_JOINTS,
    FINGER_JOINTS,
    FINGER_LINKS,
    HAND_LINK,
    HOME_JOINTS,
    JOINT_SPEED,
    JOINT_TORQUE,
    PANDA_URDF,
    TCP_LINK,
)
from grasping_invisible.sim_robot.path import JointPath

OPEN_WIDTH = 0.08  # metres between the finger pads
FINGER_FORCE = 20.0  # newtons, each finger
FINGER_SPEED = 0.1  # metres a second, each finger
FINGER_FRICTION = 1.0
HOLDING_WIDTH = 0.004  # metres; closed on nothing, the pads stand closer than this

PHYSICS_HZ = 240
STEPS_PER_TICK = 4  # physics steps between two commands to the joints: 60 Hz
TICK = STEPS_PER_TICK / PHYSICS_HZ

CONTACT_FORCE_LIMIT = 40.0  # newtons along z or in the plane, sustained: the arm counts as blocked
CONTACT_TICKS = 3
LAG_LIMIT = 0.025  # metres between where the TCP should be and is


class Panda:
    """An arm bolted to the table at the base frame's origin, in the PyBullet client it is given.

    `step` advances the world by that many physics steps; it may raise to abandon a motion.
    """

    def __init__(self, client: int, step: Callable[[int], None]) -> None:
        self._client = client
        self._step = step
        self.body = pybullet.loadURDF(PANDA_URDF, useFixedBase=True, physicsClientId=client)
        self._couple_fingers()
        for link in FINGER_LINKS:
            pybullet.changeDynamics(
                self.body,
                link,
                lateralFriction=FINGER_FRICTION,
                spinningFriction=0.005,
                rollingFriction=0.0001,
                frictionAnchor=True,
                physicsClientId=client,
            )
        self._goal = HOME_JOINTS.copy()
        self.stand(HOME_JOINTS, OPEN_WIDTH)

    @property
    def joints(self) -> NDArray[np.float64]:
        """Measured arm joint angles (7,), radians."""
        states = pybullet.getJointStates(self.body, ARM_JOINTS, physicsClientId=self._client)
        return np.array([state[0] for state in states])

    @property
    def goal(self) -> NDArray[np.float64]:
        """Commanded arm joint angles (7,), radians."""
        return self._goal

    @property
    def tcp(self) -> NDArray[np.float64]:
        """Measured TCP position (3,), metres, base frame."""
        state = pybullet.getLinkState(self.body, TCP_LINK, computeForwardKinematics=True, physicsClientId=self._client)
        return np.array(state[4])

    @property
    def closing_yaw(self) -> float:
        """Measured direction in which the fingers close, radians about +z from +x, base frame."""
        state = pybullet.getLinkState(self.body, TCP_LINK, computeForwardKinematics=True, physicsClientId=self._client)
        matrix = pybullet.getMatrixFromQuaternion(state[5])
        return float(np.arctan2(matrix[4], matrix[1]))

    @property
    def gripper_width(self) -> float:
        """Metres between the finger pads."""
        states = pybullet.getJointStates(self.body, FINGER_JOINTS, physicsClientId=self._client)
        return float(sum(state[0] for state in states))

    @property
    def holding(self) -> bool:
        """Whether closed fingers stand apart with something pressing on both."""
        return self.gripper_width > HOLDING_WIDTH and all(self._normal_force(link) > 0.5 for link in FINGER_LINKS)

    def stand(self, joints: NDArray[np.float64], width: float) -> None:
        """Be at arm joint angles (7,), radians, with the fingers at a width in metres, without moving there."""
        for joint, angle in zip(ARM_JOINTS, joints, strict=True):
            pybullet.resetJointState(self.body, joint, float(angle), physicsClientId=self._client)
        for joint in FINGER_JOINTS:
            pybullet.resetJointState(self.body, joint, width / 2, physicsClientId=self._client)
        self._hold(joints)
        self._command_fingers(width)

    def follow(self, path: JointPath, guarded: bool = False) -> float:
        """Move along a path; returns the fraction of its length travelled.

        That is 1.0 unless `guarded` and the hand met more than `CONTACT_FORCE_LIMIT`, or fell behind by `LAG_LIMIT`:
        then the arm stops where it is.
        """
        time, pressed = 0.0, 0
        while time < path.duration:
            time = min(time + TICK, path.duration)
            self._hold(path.joints_at(time))
            self._step(STEPS_PER_TICK)
            if not guarded:
                continue
            pressed = pressed + 1 if self.contact_force > CONTACT_FORCE_LIMIT else 0
            lag = float(np.linalg.norm(self.tcp - path.position_at(time)))
            if pressed >= CONTACT_TICKS or lag > LAG_LIMIT:
                self.freeze()
                return self._travelled(path)
        self._arrive(path)
        return 1.0

    def open_gripper(self, width: float = OPEN_WIDTH) -> None:
        """Open the fingers to a width in metres and wait until they stand."""
        self._command_fingers(width)
        self._wait_for_fingers()

    def close_gripper(self) -> None:
        """Close the fingers until they meet or something stops them; they keep pressing."""
        self._command_fingers(0.0)
        self._wait_for_fingers()

    def freeze(self) -> None:
        """Hold the posture the arm has now."""
        self._hold(self.joints)

    @property
    def contact_force(self) -> float:
        """Newtons: the resultant of the contacts of hand and fingers with everything else."""
        total = np.zeros(3)
        for link in (HAND_LINK, *FINGER_LINKS):
            for contact in pybullet.getContactPoints(bodyA=self.body, linkIndexA=link, physicsClientId=self._client):
                if contact[2] != self.body:
                    total += contact[9] * np.array(contact[7])
        return float(np.linalg.norm(total))

    def touched_by_both_fingers(self) -> int | None:
        """Id of the body that both fingers press on, the harder-pressed one of several; None where there is none."""
        left, right = (dict(self._forces_by_body(link)) for link in FINGER_LINKS)
        common = {body: min(force, right[body]) for body, force in left.items() if body in right}
        return max(common, key=lambda body: common[body], default=None)

    def _forces_by_body(self, link: int) -> list[tuple[int, float]]:
        contacts = pybullet.getContactPoints(bodyA=self.body, linkIndexA=link, physicsClientId=self._client)
        bodies = {contact[2] for contact in contacts if contact[2] != self.body}
        return [(body, sum(c[9] for c in contacts if c[2] == body)) for body in bodies]

    def _normal_force(self, link: int) -> float:
        contacts = pybullet.getContactPoints(bodyA=self.body, linkIndexA=link, physicsClientId=self._client)
        return float(sum(contact[9] for contact in contacts if contact[2] != self.body))

    def _arrive(self, path: JointPath) -> None:
        """Give the joints up to a quarter second to catch up with the end of a path."""
        for _ in range(15):
            if np.abs(self.joints - path.end).max() < 0.004:
                return
            self._step(STEPS_PER_TICK)

    def _travelled(self, path: JointPath) -> float:
        start, end = path.positions[0], path.positions[-1]
        span = end - start
        return float(np.clip((self.tcp - start) @ span / max(float(span @ span), 1e-9), 0.0, 1.0))

    def _hold(self, joints: NDArray[np.float64]) -> None:
        self._goal = joints
        for joint, angle, speed, torque in zip(ARM_JOINTS, joints, JOINT_SPEED, JOINT_TORQUE, strict=True):
            pybullet.setJointMotorControl2(
                self.body,
                joint,
                pybullet.POSITION_CONTROL,
                targetPosition=float(angle),
                positionGain=0.3,
                velocityGain=1.0,
                maxVelocity=float(speed),
                force=float(torque),
                physicsClientId=self._client,
            )

    def _command_fingers(self, width: float) -> None:
        for joint in FINGER_JOINTS:
            pybullet.setJointMotorControl2(
                self.body,
                joint,
                pybullet.POSITION_CONTROL,
                targetPosition=width / 2,
                maxVelocity=FINGER_SPEED,
                force=FINGER_FORCE,
                physicsClientId=self._client,
            )

    def _wait_for_fingers(self) -> None:
        """Until the fingers have stood still for five ticks, two seconds at most."""
        still, before = 0, self.gripper_width
        for _ in range(int(2.0 / TICK)):
            self._step(STEPS_PER_TICK)
            width = self.gripper_width
            still = still + 1 if abs(width - before) < 2e-4 else 0
            before = width
            if still >= 5:
                return

    def _couple_fingers(self) -> None:
        """The real hand drives both fingers with one motor: neither moves without the other."""
        gear = pybullet.createConstraint(
            self.body,
            FINGER_JOINTS[0],
            self.body,
            FINGER_JOINTS[1],
            jointType=pybullet.JOINT_GEAR,
            jointAxis=[1, 0, 0],
            parentFramePosition=[0, 0, 0],
            childFramePosition=[0, 0, 0],
            physicsClientId=self._client,
        )
        pybullet.changeConstraint(gear, gearRatio=-1, erp=0.1, maxForce=50, physicsClientId=self._client)
