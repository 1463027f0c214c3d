"""The pictures of `gi-log report`: panels with the motion drawn in, as text that an HTML file can hold."""

import base64
import math
from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from google.protobuf.message import Message
from numpy.typing import NDArray

from grasping_invisible.data.calibration_message import decode_calibration
from grasping_invisible.data.classes import CLASSES, RGB
from grasping_invisible.data.drawing import (
    GRASP_COLOR,
    PUSH_COLOR,
    SHOWN_HEIGHT,
    Image,
    height_colors,
    outline,
    painted,
    pixel_of,
    stroke,
    strokes,
    value_colors,
)
from grasping_invisible.data.errors import BadMessage
from grasping_invisible.data.heightmap_message import HeightmapArrays
from grasping_invisible.data.images import CAMERA_FRAME, decode_color, decode_labels
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.topics import CAMERA_INFO, COLOR_IMAGE, SEGMENTATION, TRANSFORMS
from grasping_invisible.data.transform_message import decode_transform

PANEL = 400  # pixels, side of a map
_SMALL = 96  # pixels, side of one rotation's map in the strip of all
_LONGEST = 1.0  # metres; a motion that says to be longer is damaged, not drawn
_QUALITY = 86


@dataclass(frozen=True)
class Scale:
    """What the two ends of a picture's colours stand for."""

    kind: str  # `heights` or `values`: which colours
    low: str
    high: str


@dataclass(frozen=True)
class Panel:
    """A picture, what it shows, and what its colours mean. `src`: a data URI. `chosen`: decided from.

    `keys`: things shown, each with the colour, red, green and blue, that it is drawn in.
    """

    title: str
    src: str
    note: str = ""
    chosen: bool = False
    scale: Scale | None = None
    keys: tuple[tuple[str, tuple[int, int, int]], ...] = ()


@dataclass(frozen=True)
class Motion:
    """What is drawn of a decision: metres and radians, base frame."""

    kind: gi.MotionKind
    position: tuple[float, float, float]
    yaw: float
    length: float

    @property
    def lines(self) -> list[tuple[tuple[float, float], tuple[float, float]]]:
        """Arrows (from, to) in x and y; none where the log's numbers make no sense."""
        numbers = (*self.position, self.yaw, self.length)
        if not all(map(math.isfinite, numbers)) or max(map(abs, (*self.position, self.length))) > 10 * _LONGEST:
            return []
        return strokes(self.kind, *self.position[:2], self.yaw, self.length)


def camera_panels(messages: Mapping[str, Message], target: str, motion: Motion | None) -> list[Panel]:
    """The camera view with the target's outline and the motion, and the classes seen; what is there of both.

    `messages`: of one camera frame, by topic key. `target`: its colour.
    """
    color, labels = messages.get(COLOR_IMAGE.key), messages.get(SEGMENTATION.key)
    if not isinstance(color, CompressedImage):
        return []
    try:
        view = decode_color(color)
        classes = decode_labels(labels) if isinstance(labels, CompressedImage) else None
    except BadMessage:
        return []
    seen = None if classes is None or classes.shape != view.shape[:2] else classes
    panels = []
    if seen is not None:
        grey = cv2.cvtColor(cv2.cvtColor(view, cv2.COLOR_RGB2GRAY), cv2.COLOR_GRAY2RGB)
        share = np.where(seen > 0, 0.8, 0.0)[..., None]
        picture = (share * painted(seen) + (1 - share) * grey * 0.85).astype(np.uint8)
        keys = _classes_in(seen)
        panels.append(Panel("Classes seen", jpeg(picture), "" if keys else "nothing but grey", keys=keys))
        if target in CLASSES:
            view = view.copy()
            outline(view, seen == CLASSES.index(target), RGB[target])
    if motion is not None:
        view = view.copy()
        _draw_in_view(view, messages, motion)
    return [Panel("Camera", jpeg(view)), *panels]


def thumbnail(maps: HeightmapArrays, motion: Motion) -> str:
    """The view from above with the motion, for the strip of all steps."""
    return jpeg(_map_with_motion(maps.color, maps, motion))


def map_panels(maps: HeightmapArrays, target: str, motion: Motion | None) -> list[Panel]:
    """Colour, height and the target's mask, seen from above."""
    mask = maps.labels == (CLASSES.index(target) if target in CLASSES else len(CLASSES))
    masked = (maps.color * 0.3).astype(np.uint8)
    masked[mask] = RGB.get(target, (255, 255, 255))
    cells = int(np.count_nonzero(mask))
    return [
        Panel("Seen from above", jpeg(_map_with_motion(maps.color, maps, motion))),
        Panel(
            "Height",
            jpeg(_map_with_motion(height_colors(maps.height), maps, motion)),
            f"up to {maps.height.max() * 1000:.0f} mm",
            scale=Scale("heights", "0", f"{SHOWN_HEIGHT * 1000:.0f} mm"),
        ),
        Panel("Target mask", jpeg(_map_with_motion(masked, maps, motion)), f"{cells} cells" if cells else "not seen"),
    ]


def after_panel(maps: HeightmapArrays) -> Panel:
    """The view from above once the motion had ended."""
    return Panel("Afterwards", jpeg(_map_with_motion(maps.color, maps, None)))


def value_panel(
    title: str,
    stack: NDArray[np.float32],
    maps: HeightmapArrays,
    motion: Motion,
    rotation: int | None = None,
    *,
    chosen: bool = False,
) -> Panel:
    """Values of one rotation of a stack, (16, R, C), or without one the best of all, on the stack's scale."""
    low, high = _scale(stack)
    values = stack.max(axis=0) if rotation is None else stack[rotation]
    picture = jpeg(_map_with_motion(value_colors(values, low, high, maps.color), maps, motion))
    if float(stack.min()) == high:
        return Panel(title, picture, f"{high:.2f} everywhere", chosen)
    return Panel(title, picture, chosen=chosen, scale=Scale("values", f"{low:.2f}", f"{high:.2f}"))


def rotation_strip(stack: NDArray[np.float32], maps: HeightmapArrays) -> list[str]:
    """All rotations of a stack on one scale, small."""
    low, high = _scale(stack)
    below = np.asarray(cv2.resize(maps.color, (_SMALL, _SMALL), interpolation=cv2.INTER_AREA), np.uint8)
    return [jpeg(value_colors(values, low, high, below)) for values in stack]


def jpeg(image: Image) -> str:
    """An RGB image as a data URI."""
    bgr = cv2.cvtColor(np.ascontiguousarray(image), cv2.COLOR_RGB2BGR)
    data = cv2.imencode(".jpg", bgr, (cv2.IMWRITE_JPEG_QUALITY, _QUALITY))[1].tobytes()
    return f"data:image/jpeg;base64,{base64.b64encode(data).decode()}"


def _scale(stack: NDArray[np.float32]) -> tuple[float, float]:
    """From the least to the greatest value; a map of one value is bright unless that is nothing."""
    low, high = float(stack.min()), float(stack.max())
    return (low, high) if high - low > 1e-6 else (min(0.0, low), high)


def _classes_in(labels: NDArray[np.uint8]) -> tuple[tuple[str, tuple[int, int, int]], ...]:
    counts = np.bincount(labels.ravel(), minlength=len(CLASSES))[1 : len(CLASSES)]
    return tuple((name, RGB[name]) for name, count in zip(CLASSES[1:], counts, strict=True) if count)


def _draw_in_view(view: Image, messages: Mapping[str, Message], motion: Motion) -> None:
    info, transforms = messages.get(CAMERA_INFO.key), messages.get(TRANSFORMS.key)
    if not isinstance(info, CameraCalibration) or not isinstance(transforms, FrameTransforms):
        return
    try:
        intrinsics = decode_calibration(info)
        base_from_camera = decode_transform(transforms, CAMERA_FRAME)
    except BadMessage:
        return  # the view is worth showing without the motion, too
    for line in motion.lines:
        start, end = (pixel_of((x, y, motion.position[2]), intrinsics, base_from_camera) for x, y in line)
        stroke(view, start, end, motion.kind)


def _map_with_motion(image: Image, maps: HeightmapArrays, motion: Motion | None) -> Image:
    panel = np.asarray(cv2.resize(image, (PANEL, PANEL), interpolation=cv2.INTER_NEAREST), np.uint8)
    size = maps.resolution * max(maps.height.shape)
    if motion is None or not 0 < size < 10 * _LONGEST or not all(abs(place) < 10 * _LONGEST for place in maps.center):
        return panel
    left, top = maps.center[0] - size / 2, maps.center[1] + size / 2
    scale = PANEL / size

    def pixel(x: float, y: float) -> tuple[int, int]:
        return round((x - left) * scale), round((top - y) * scale)

    for start, end in motion.lines:
        stroke(panel, pixel(*start), pixel(*end), motion.kind)
    if motion.lines:  # the chosen cell
        color = PUSH_COLOR if motion.kind == gi.PUSH else GRASP_COLOR
        for radius, width, ink in ((6, 4, (0, 0, 0)), (6, 2, color)):
            cv2.circle(panel, pixel(*motion.position[:2]), radius, ink, width, cv2.LINE_AA)
    return panel
