"""Camera images as Foxglove messages: colour and labels compressed, depth raw in millimetres."""

import cv2
import numpy as np
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from numpy.typing import NDArray

from grasping_invisible.data.clock import to_timestamp
from grasping_invisible.data.errors import BadMessage
from grasping_invisible.data.png import decode_color_image, decode_plane, encode_png

CAMERA_FRAME = "camera_color_optical_frame"
_MAX_DEPTH_MM = np.iinfo(np.uint16).max


def encode_color(
    color: NDArray[np.uint8], stamp_ns: int, frame_id: str = CAMERA_FRAME, *, jpeg_quality: int | None = None
) -> CompressedImage:
    """An (H, W, 3) uint8 RGB image, lossless as PNG, or as JPEG where a quality (0..100) is given."""
    if jpeg_quality is None:
        data, kind = encode_png(color), "png"
    else:
        bgr = cv2.cvtColor(color, cv2.COLOR_RGB2BGR)
        data, kind = cv2.imencode(".jpg", bgr, (cv2.IMWRITE_JPEG_QUALITY, jpeg_quality))[1].tobytes(), "jpeg"
    return CompressedImage(timestamp=to_timestamp(stamp_ns), frame_id=frame_id, data=data, format=kind)


def decode_color(message: CompressedImage) -> NDArray[np.uint8]:
    """The (H, W, 3) uint8 RGB image of a PNG or JPEG message. Raises `BadMessage`."""
    return decode_color_image(message.data)


def encode_depth(depth: NDArray[np.float32], stamp_ns: int, frame_id: str = CAMERA_FRAME) -> RawImage:
    """An (H, W) float32 depth image in metres, rounded to millimetres; NaN and negative become 0: no reading."""
    clean = np.nan_to_num(depth, nan=0.0, posinf=0.0, neginf=0.0)
    millimetres = np.clip(np.rint(clean * 1000.0), 0, _MAX_DEPTH_MM).astype("<u2")
    height, width = millimetres.shape
    return RawImage(
        timestamp=to_timestamp(stamp_ns),
        frame_id=frame_id,
        width=width,
        height=height,
        encoding="16UC1",
        step=2 * width,
        data=millimetres.tobytes(),
    )


def decode_depth(message: RawImage) -> NDArray[np.float32]:
    """The (H, W) float32 depth in metres, 0 where there is no reading. Raises `BadMessage`."""
    height, width = message.height, message.width
    if message.encoding != "16UC1" or message.step != 2 * width or len(message.data) != 2 * height * width:
        raise BadMessage(
            f"depth must be a packed little-endian 16UC1 image; got encoding {message.encoding!r}, "
            f"{width} x {height}, step {message.step}, {len(message.data)} bytes"
        )
    millimetres = np.frombuffer(message.data, "<u2").reshape(height, width)
    return millimetres.astype(np.float32) / np.float32(1000.0)


def encode_labels(labels: NDArray[np.uint8], stamp_ns: int, frame_id: str = CAMERA_FRAME) -> CompressedImage:
    """An (H, W) uint8 image of class indices, as an 8-bit PNG."""
    return CompressedImage(timestamp=to_timestamp(stamp_ns), frame_id=frame_id, data=encode_png(labels), format="png")


def decode_labels(message: CompressedImage) -> NDArray[np.uint8]:
    """The (H, W) uint8 class indices of a label image. Raises `BadMessage`."""
    return decode_plane(message.data, np.uint8)
