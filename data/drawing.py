"""How maps and motions are drawn, in every picture alike: colours of heights and values, a motion's arrows."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.classes import GREY, RGB, TARGET_COLORS
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi

Image = NDArray[np.uint8]  # (H, W, 3), RGB

FINGER_OPENING = 0.08  # metres between the fingers before they close
PUSH_COLOR = (255, 214, 30)
GRASP_COLOR = (80, 255, 120)
_PALETTE = np.array([RGB[name] for name in (GREY, *TARGET_COLORS)], np.uint8)
_SPECK = 16  # pixels
SHOWN_HEIGHT = 0.15  # metres; what is higher is drawn alike
_FAR = 10_000  # pixels; what lies behind the camera is drawn out there


def painted(labels: NDArray[np.uint8]) -> Image:
    """(H, W) class indices in the colours of their classes."""
    return _PALETTE[np.minimum(labels, len(_PALETTE) - 1)]


def height_colors(height: NDArray[np.float32]) -> Image:
    """(N, M) metres, dark at 0 and bright from 0.15 m on."""
    return _colors(np.clip(height / SHOWN_HEIGHT, 0.0, 1.0), cv2.COLORMAP_VIRIDIS)


def value_colors(values: NDArray[np.float32], low: float, high: float, below: Image) -> Image:
    """Values from low, dark, to high, bright, over a dimmed view from above, so that one sees what they are values of.

    `values`: (R, C); `below`: of any size, which the result has.
    """
    share = np.clip((values - low) / max(high - low, 1e-6), 0.0, 1.0).astype(np.float32)
    share = np.asarray(cv2.resize(share, below.shape[1::-1], interpolation=cv2.INTER_LINEAR), np.float32)
    weight = (0.4 + 0.45 * share)[..., None]
    return (weight * _colors(share, cv2.COLORMAP_INFERNO) + (1 - weight) * 0.8 * below).astype(np.uint8)


def outline(image: Image, mask: NDArray[np.bool_], color: tuple[int, int, int]) -> None:
    """Draw a line around the pixels of a mask of the image's size; specks are left out."""
    found = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)[0]
    lines = [line for line in found if cv2.contourArea(line) >= _SPECK]
    cv2.drawContours(image, lines, -1, (255, 255, 255), 3, cv2.LINE_AA)
    cv2.drawContours(image, lines, -1, color, 1, cv2.LINE_AA)


def strokes(
    kind: gi.MotionKind, x: float, y: float, yaw: float, length: float
) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """Lines (from, to), base frame: a push's path; for a grasp the two fingers' ways to each other."""
    along = np.array([math.cos(yaw), math.sin(yaw)])
    at = np.array([x, y])
    if kind == gi.PUSH:
        ends = [(at, at + length * along)]
    else:
        ends = [(at + side * FINGER_OPENING / 2 * along, at + side * 0.006 * along) for side in (-1, 1)]
    return [((float(a[0]), float(a[1])), (float(b[0]), float(b[1]))) for a, b in ends]


def stroke(image: Image, start: tuple[int, int], end: tuple[int, int], kind: gi.MotionKind) -> None:
    """Draw an arrow, pixels (x, y), in the colour of the motion."""
    color = PUSH_COLOR if kind == gi.PUSH else GRASP_COLOR
    tip = 10 / max(10.0, math.dist(start, end))
    cv2.arrowedLine(image, start, end, (0, 0, 0), 5, cv2.LINE_AA, tipLength=tip)
    cv2.arrowedLine(image, start, end, color, 2, cv2.LINE_AA, tipLength=tip)


def pixel_of(
    point: tuple[float, float, float], intrinsics: NDArray[np.float64], base_from_camera: NDArray[np.float64]
) -> tuple[int, int]:
    """Where a point of the base frame, metres, appears: (x, y); points behind the camera land far outside."""
    x, y, z, _ = np.linalg.inv(base_from_camera) @ np.array([*point, 1.0])
    u, v, _ = intrinsics @ np.array([x, y, max(z, 1e-3)]) / max(z, 1e-3)
    return int(np.clip(round(u), -_FAR, _FAR)), int(np.clip(round(v), -_FAR, _FAR))


def _colors(share: NDArray[np.float32], color_map: int) -> Image:
    bgr = cv2.applyColorMap((share * 255).astype(np.uint8), color_map)
    return cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB).astype(np.uint8)
