"""What the simulated robot says of itself: joint states and the transforms of its links and camera."""

import numpy as np
import pybullet
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.JointState_pb2 import JointState
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from numpy.typing import NDArray

from grasping_invisible.data.clock import to_timestamp
from grasping_invisible.data.images import CAMERA_FRAME
from grasping_invisible.data.transform_message import encode_transforms, rotation_of
from grasping_invisible.runtime.frame import Camera
from grasping_invisible.sim_robot.kinematics import ARM_JOINTS, FINGER_JOINTS


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
    poses = {_link_name(client, arm, link): _pose(state[4], state[5]) for link, state in enumerate(states)}
    return encode_transforms({**poses, CAMERA_FRAME: camera.base_from_camera}, stamp_ns)


def _pose(position: tuple[float, float, float], quaternion: tuple[float, ...]) -> NDArray[np.float64]:
    pose = np.eye(4)
    pose[:3, :3] = rotation_of(np.array(quaternion))
    pose[:3, 3] = position
    return pose


def _joint_name(client: int, arm: int, joint: int) -> str:
    return pybullet.getJointInfo(arm, joint, physicsClientId=client)[1].decode()


def _link_name(client: int, arm: int, link: int) -> str:
    return pybullet.getJointInfo(arm, link, physicsClientId=client)[12].decode()
