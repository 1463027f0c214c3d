"""Push and grasp Q maps to and from `gi.QMaps`, quantised to 8 bits: within 1/510 of their range."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.clock import to_ns, to_timestamp
from grasping_invisible.data.errors import BadMessage
from grasping_invisible.data.png import decode_plane, encode_png
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi

_LEVELS = 255


@dataclass(frozen=True)
class QMapArrays:
    """Q maps of one decision, float32: `grasp` is (rotations, rows, columns), `push` (levels, *as grasp)."""

    stamp_ns: int
    step: int
    push: NDArray[np.float32]
    grasp: NDArray[np.float32]


def encode_q_maps(maps: QMapArrays) -> gi.QMaps:
    """Both stacks must have the same shape, but for the levels, and be finite; else `ValueError`."""
    if maps.push.shape[1:] != maps.grasp.shape:
        raise ValueError(f"push maps {maps.push.shape[1:]} and grasp maps {maps.grasp.shape} differ in shape")
    levels, rotations, rows, columns = maps.push.shape
    push_min, push_max, push_png = _quantise(maps.push)
    grasp_min, grasp_max, grasp_png = _quantise(maps.grasp)
    return gi.QMaps(
        stamp=to_timestamp(maps.stamp_ns),
        step=maps.step,
        push_levels=levels,
        rotations=rotations,
        rows=rows,
        columns=columns,
        push_min=push_min,
        push_max=push_max,
        grasp_min=grasp_min,
        grasp_max=grasp_max,
        push_png=push_png,
        grasp_png=grasp_png,
    )


def decode_q_maps(message: gi.QMaps) -> QMapArrays:
    """Raises `BadMessage` when an image is damaged or has not the shape the message states."""
    shape = (message.rotations, message.rows, message.columns)
    levels = message.push_levels or 1  # not said before there were several
    if not np.isfinite((message.push_min, message.push_max, message.grasp_min, message.grasp_max)).all():
        raise BadMessage("Q maps hold values that are not finite")
    return QMapArrays(
        stamp_ns=to_ns(message.stamp),
        step=message.step,
        push=_restore(message.push_png, message.push_min, message.push_max, (levels, *shape)),
        grasp=_restore(message.grasp_png, message.grasp_min, message.grasp_max, shape),
    )


def _quantise(stack: NDArray[np.float32]) -> tuple[float, float, bytes]:
    low, high = float(stack.min()), float(stack.max())
    if not np.isfinite((low, high)).all():
        raise ValueError("Q maps hold values that are not finite")
    scale = _LEVELS / (high - low) if high > low else 0.0
    levels = np.rint((stack - low) * scale).astype(np.uint8)
    return low, high, encode_png(levels.reshape(-1, stack.shape[-1]))


def _restore(png: bytes, low: float, high: float, shape: tuple[int, ...]) -> NDArray[np.float32]:
    levels = decode_plane(png, np.uint8, (math.prod(shape[:-1]), shape[-1]))
    values = np.float32(low) + levels.astype(np.float32) * np.float32((high - low) / _LEVELS)
    return values.reshape(shape)
