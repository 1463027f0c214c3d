"""What the simulated robot says of itself: joint states and the transforms of its links and camera."""

import numpy as np
import pybullet
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.JointState_pb2 import JointState
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from numpy.typing import NDArray

from grasping_invisible.data.clock import to_timestamp
from grasping_invisible.data.images import CAMERA_FRAME
from grasping_invisible.runtime.frame import Camera
from grasping_invisible.sim_robot.kinematics import ARM_JOINTS, FINGER_JOINTS

BASE_FRAME = "panda_link0"


def joint_states(client: int, arm: int, stamp_ns: int) -> JointStates:
    """Positions (radians; metres for the fingers), velocities and efforts of the arm's and the fingers' joints."""
    joints = (*ARM_JOINTS, *FINGER_JOINTS)
    states = pybullet.getJointStates(arm, joints, physicsClientId=client)
    return JointStates(
        timestamp=to_timestamp(stamp_ns),
        joints=[
            JointState(name=_joint_name(client, arm, joint), position=state[0], velocity=state[1], effort=state[3])
            for joint, state in zip(joints, states, strict=True)
        ],
    )


def transforms(client: int, arm: int, camera: Camera, stamp_ns: int) -> FrameTransforms:
    """From `panda_link0` to every link of the arm and to the camera's optical frame."""
    count = pybullet.getNumJoints(arm, physicsClientId=client)
    states = pybullet.getLinkStates(arm, range(count), computeForwardKinematics=True, physicsClientId=client)
    poses = [(_link_name(client, arm, link), state[4], state[5]) for link, state in enumerate(states)]
    poses.append((CAMERA_FRAME, camera.base_from_camera[:3, 3], quaternion_of(camera.base_from_camera)))
    return FrameTransforms(
        transforms=[
            FrameTransform(
                timestamp=to_timestamp(stamp_ns),
                parent_frame_id=BASE_FRAME,
                child_frame_id=name,
                translation=Vector3(x=position[0], y=position[1], z=position[2]),
                rotation=Quaternion(x=turn[0], y=turn[1], z=turn[2], w=turn[3]),
            )
            for name, position, turn in poses
        ]
    )


def quaternion_of(pose: NDArray[np.float64]) -> tuple[float, float, float, float]:
    """The rotation of a 4 x 4 pose as a quaternion (x, y, z, w)."""
    # The eigenvector of the largest eigenvalue of Bar-Itzhack's matrix: no case distinctions, exact for rotations.
    m = pose[:3, :3]
    k = np.array(
        [
            [m[0, 0] - m[1, 1] - m[2, 2], m[1, 0] + m[0, 1], m[2, 0] + m[0, 2], m[2, 1] - m[1, 2]],
            [m[1, 0] + m[0, 1], m[1, 1] - m[0, 0] - m[2, 2], m[2, 1] + m[1, 2], m[0, 2] - m[2, 0]],
            [m[2, 0] + m[0, 2], m[2, 1] + m[1, 2], m[2, 2] - m[0, 0] - m[1, 1], m[1, 0] - m[0, 1]],
            [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], m[0, 0] + m[1, 1] + m[2, 2]],
        ]
    )
    x, y, z, w = np.linalg.eigh(k)[1][:, -1]
    sign = 1.0 if w >= 0 else -1.0
    return sign * float(x), sign * float(y), sign * float(z), sign * float(w)


def _joint_name(client: int, arm: int, joint: int) -> str:
    return pybullet.getJointInfo(arm, joint, physicsClientId=client)[1].decode()


def _link_name(client: int, arm: int, link: int) -> str:
    return pybullet.getJointInfo(arm, link, physicsClientId=client)[12].decode()
