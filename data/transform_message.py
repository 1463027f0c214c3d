"""Poses of frames to and from Foxglove's `FrameTransforms`, quaternions (x, y, z, w)."""

from collections.abc import Mapping

import numpy as np
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from numpy.typing import NDArray

from grasping_invisible.data.clock import to_ns, to_timestamp
from grasping_invisible.data.errors import BadMessage

BASE_FRAME = "panda_link0"


def encode_transforms(base_from_frame: Mapping[str, NDArray[np.float64]], stamp_ns: int) -> FrameTransforms:
    """`base_from_frame`: for each child frame, the 4 x 4 pose that takes its points to the base frame, metres."""
    stamp = to_timestamp(stamp_ns)
    message = FrameTransforms()
    for name, pose in base_from_frame.items():
        x, y, z, w = quaternion_of(pose[:3, :3])
        message.transforms.append(
            FrameTransform(
                timestamp=stamp,
                parent_frame_id=BASE_FRAME,
                child_frame_id=name,
                translation=Vector3(x=pose[0, 3], y=pose[1, 3], z=pose[2, 3]),
                rotation=Quaternion(x=x, y=y, z=z, w=w),
            )
        )
    return message


def decode_transform(message: FrameTransforms, child: str) -> NDArray[np.float64]:
    """The 4 x 4 pose of frame `child` in the base frame, metres, as it was last: a message may hold several.

    Raises `BadMessage` when it is not there.
    """
    known = [t for t in message.transforms if t.parent_frame_id == BASE_FRAME and t.child_frame_id == child]
    if not known:
        present = ", ".join(f"{t.parent_frame_id} to {t.child_frame_id}" for t in message.transforms)
        raise BadMessage(f"no transform from {BASE_FRAME} to {child}; there are: {present or 'none'}")
    latest = max(known, key=lambda transform: to_ns(transform.timestamp))
    rotation, translation = latest.rotation, latest.translation
    pose = np.eye(4)
    pose[:3, :3] = rotation_of(np.array([rotation.x, rotation.y, rotation.z, rotation.w]))
    pose[:3, 3] = translation.x, translation.y, translation.z
    if not np.isfinite(pose).all():
        raise BadMessage(f"the transform from {BASE_FRAME} to {child} is not finite")
    return pose


def latest_stamp(message: FrameTransforms) -> int | None:
    """The stamp of the frame that transforms belong to, nanoseconds; None without any.

    Those of links that never move may keep the stamp of when they were first said.
    """
    return max((to_ns(transform.timestamp) for transform in message.transforms), default=None)


def quaternion_of(rotation: NDArray[np.float64]) -> NDArray[np.float64]:
    """The unit quaternion (x, y, z, w), w >= 0, of a 3 x 3 rotation matrix.

    It is the eigenvector of the largest eigenvalue of a symmetric 4 x 4 matrix: no case distinctions, and the
    nearest rotation where the matrix is slightly off.
    """
    (a, b, c), (d, e, f), (g, h, i) = rotation
    symmetric = np.array(
        [
            [a - e - i, b + d, c + g, h - f],
            [b + d, e - a - i, f + h, c - g],
            [c + g, f + h, i - a - e, d - b],
            [h - f, c - g, d - b, a + e + i],
        ]
    )
    quaternion = np.linalg.eigh(symmetric)[1][:, -1]
    return quaternion if quaternion[3] >= 0 else -quaternion


def rotation_of(quaternion: NDArray[np.float64]) -> NDArray[np.float64]:
    """The 3 x 3 rotation matrix of a quaternion (x, y, z, w). Raises `BadMessage` when its length is not near 1."""
    length = float(np.linalg.norm(quaternion))
    if not 0.99 < length < 1.01:
        raise BadMessage(f"a rotation's quaternion must have length 1, not {length:.3g}")
    x, y, z, w = quaternion / length
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
