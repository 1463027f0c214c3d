"""A pinhole camera's intrinsics to and from Foxglove's `CameraCalibration`."""

import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from numpy.typing import NDArray

from grasping_invisible.data.clock import to_timestamp
from grasping_invisible.data.errors import BadMessage
from grasping_invisible.data.images import CAMERA_FRAME

MAX_FOCAL_LENGTH = 1e5  # pixels; no camera that sees a table has more


def encode_calibration(intrinsics: NDArray[np.float64], width: int, height: int, stamp_ns: int) -> CameraCalibration:
    """`intrinsics`: 3 x 3, pixels, of an image without distortion."""
    projection = np.hstack([intrinsics, np.zeros((3, 1))])
    return CameraCalibration(
        timestamp=to_timestamp(stamp_ns),
        frame_id=CAMERA_FRAME,
        width=width,
        height=height,
        distortion_model="plumb_bob",
        D=[0.0] * 5,
        K=intrinsics.ravel().tolist(),
        R=np.eye(3).ravel().tolist(),
        P=projection.ravel().tolist(),
    )


def decode_calibration(message: CameraCalibration) -> NDArray[np.float64]:
    """The 3 x 3 intrinsics in pixels. Raises `BadMessage` where they are not those of an undistorted camera."""
    if len(message.K) != 9 or not np.isfinite(message.K).all():
        raise BadMessage(f"calibration K must be 9 finite numbers; got {list(message.K)}")
    intrinsics = np.array(message.K, dtype=np.float64).reshape(3, 3)
    focal_lengths = intrinsics[0, 0], intrinsics[1, 1]
    below_the_diagonal = [intrinsics[1, 0], *intrinsics[2]]
    in_range = all(0 < length < MAX_FOCAL_LENGTH for length in focal_lengths)
    if not in_range or not np.allclose(below_the_diagonal, [0.0, 0.0, 0.0, 1.0]):
        raise BadMessage(f"calibration K is not a pinhole camera's: {list(message.K)}")
    if any(message.D):
        raise BadMessage(f"images must be undistorted before they are published; D is {list(message.D)}")
    return intrinsics
