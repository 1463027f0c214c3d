"""Heightmaps to and from `gi.Heightmaps`."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.classes import CLASSES
from grasping_invisible.data.clock import to_ns, to_timestamp
from grasping_invisible.data.errors import BadMessage
from grasping_invisible.data.png import decode_color_image, decode_plane, encode_png
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi

HEIGHT_UNIT = 1e-4  # metres a count


@dataclass(frozen=True)
class HeightmapArrays:
    """What a heightmap message holds. Row 0 lies at the largest y, column 0 at the smallest x, base frame.

    `color`: (N, M, 3) uint8 RGB. `height`: (N, M) float32, metres above the table, in steps of 0.1 mm.
    `labels`: (N, M) uint8 class indices. `resolution`: metres a cell. `center`: workspace centre, base frame.
    """

    stamp_ns: int
    step: int
    color: NDArray[np.uint8]
    height: NDArray[np.float32]
    labels: NDArray[np.uint8]
    resolution: float
    center: tuple[float, float, float]


def encode_heightmaps(maps: HeightmapArrays) -> gi.Heightmaps:
    """Heightmaps as a message; heights as by `encode_heights`."""
    rows, columns = maps.height.shape
    x, y, z = maps.center
    return gi.Heightmaps(
        stamp=to_timestamp(maps.stamp_ns),
        step=maps.step,
        rows=rows,
        columns=columns,
        resolution=maps.resolution,
        origin=gi.Point(x=x, y=y, z=z),
        color_png=encode_png(maps.color),
        height_png=encode_heights(maps.height),
        labels_png=encode_png(maps.labels),
        classes=CLASSES,
    )


def decode_heightmaps(message: gi.Heightmaps) -> HeightmapArrays:
    """Raises `BadMessage` when an image is damaged, has not the shape the message states, or holds other classes."""
    if message.classes and tuple(message.classes) != CLASSES:
        raise BadMessage(f"its classes are {', '.join(message.classes)}, not {', '.join(CLASSES)}")
    shape = (message.rows, message.columns)
    color = decode_color_image(message.color_png)
    if color.shape[:2] != shape:
        raise BadMessage(f"colour heightmap is {color.shape[:2]}, its message says {shape}")
    return HeightmapArrays(
        stamp_ns=to_ns(message.stamp),
        step=message.step,
        color=color,
        height=decode_heights(message.height_png, shape),
        labels=decode_plane(message.labels_png, np.uint8, shape),
        resolution=message.resolution,
        center=(message.origin.x, message.origin.y, message.origin.z),
    )


def encode_heights(height: NDArray[np.float32]) -> bytes:
    """Heights below the table are kept as 0 and above 6.5 m as 6.5 m; the rest within 0.05 mm."""
    counts = np.clip(np.rint(height / HEIGHT_UNIT), 0, np.iinfo(np.uint16).max)
    return encode_png(counts.astype(np.uint16))


def decode_heights(png: bytes, shape: tuple[int, int]) -> NDArray[np.float32]:
    """Heights in metres, (N, M) float32. Raises `BadMessage`."""
    return decode_plane(png, np.uint16, shape).astype(np.float32) * np.float32(HEIGHT_UNIT)
