"""A picture of one decision: what the camera saw, the map it was made from, and the motion drawn into both."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.classes import CLASSES, RGB
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.decision import Deliberation
from grasping_invisible.runtime.decision_record import Decision
from grasping_invisible.runtime.frame import Camera, RgbdFrame
from grasping_invisible.runtime.perception import target_patches
from grasping_invisible.runtime.workspace import PUSH_LENGTH, Workspace

Image = NDArray[np.uint8]

_PANEL = 240  # pixels, side of a map
_HEIGHT = 2 * _PANEL
_HEADER = 56
_CAPTION = 20
_PUSH = (255, 214, 30)
_GRASP = (80, 255, 120)
_INK = (240, 240, 240)
_FAINT = (165, 172, 180)
_BACKGROUND = (24, 27, 31)
_OPENING = 0.08  # metres between the fingers before they close
_SHOWN_HEIGHT = 0.15  # metres; what is higher is drawn alike


def draw_decision(frame: RgbdFrame, deliberation: Deliberation, target: str) -> Image:
    """An RGB picture, 536 pixels high: camera view left; maps right: colour, height, chosen map, best of all."""
    decision, perception = deliberation.decision, deliberation.perception
    workspace = perception.maps.workspace
    camera_view = _camera_view(frame, target_patches(perception.labels == CLASSES.index(target)), decision, target)
    chosen, best, name = _value_maps(deliberation)
    panels = (
        _panel(perception.maps.color, decision, workspace, "seen from above"),
        _panel(_height_colors(perception.maps.height), decision, workspace, "height"),
        _panel(_value_colors(chosen, best, perception.maps.color), decision, workspace, f"{name}, this direction"),
        _panel(_value_colors(best, best, perception.maps.color), decision, workspace, f"{name}, best of 16"),
    )
    maps = np.vstack([np.hstack(panels[:2]), np.hstack(panels[2:])])
    body = np.hstack([camera_view, maps])
    return np.vstack([_header(deliberation, target, body.shape[1]), body])


def _camera_view(frame: RgbdFrame, target_pixels: NDArray[np.bool_], decision: Decision, target: str) -> Image:
    image = np.ascontiguousarray(frame.color)
    outlines = cv2.findContours(target_pixels.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)[0]
    cv2.drawContours(image, outlines, -1, (255, 255, 255), 3, cv2.LINE_AA)
    cv2.drawContours(image, outlines, -1, RGB[target], 1, cv2.LINE_AA)
    for start, end in _strokes(decision):
        height = decision.position[2]
        pixels = [_pixel(frame.camera, (x, y, height)) for x, y in (start, end)]
        _stroke(image, pixels[0], pixels[1], decision)
    scale = _HEIGHT / image.shape[0]
    return cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA).astype(np.uint8)


def _panel(image: Image, decision: Decision, workspace: Workspace, caption: str) -> Image:
    """A map with the motion in it; maps of any resolution cover the same square."""
    panel = cv2.resize(image, (_PANEL, _PANEL), interpolation=cv2.INTER_NEAREST).astype(np.uint8)
    low, high = workspace.low, workspace.high
    scale = _PANEL / workspace.size
    for line in _strokes(decision):
        start, end = ((round((x - low[0]) * scale), round((high[1] - y) * scale)) for x, y in line)
        _stroke(panel, start, end, decision)
    panel[-_CAPTION:] = panel[-_CAPTION:] // 4
    _text(panel, caption, (7, _PANEL - 7), _INK, 0.4)
    cv2.rectangle(panel, (0, 0), (_PANEL - 1, _PANEL - 1), _BACKGROUND, 1)
    return panel


def _strokes(decision: Decision) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """Lines (from, to), base frame: a push's path; for a grasp the two fingers' ways to each other."""
    x, y, _ = decision.position
    along = np.array([math.cos(decision.yaw), math.sin(decision.yaw)])
    at = np.array([x, y])
    if decision.kind == gi.PUSH:
        ends = [(at, at + PUSH_LENGTH * along)]
    else:
        ends = [(at + side * _OPENING / 2 * along, at + side * 0.006 * along) for side in (-1, 1)]
    return [((float(a[0]), float(a[1])), (float(b[0]), float(b[1]))) for a, b in ends]


def _stroke(image: Image, start: tuple[int, int], end: tuple[int, int], decision: Decision) -> None:
    color = _PUSH if decision.kind == gi.PUSH else _GRASP
    tip = 10 / max(10.0, math.dist(start, end))
    cv2.arrowedLine(image, start, end, (0, 0, 0), 5, cv2.LINE_AA, tipLength=tip)
    cv2.arrowedLine(image, start, end, color, 2, cv2.LINE_AA, tipLength=tip)


def _pixel(camera: Camera, point: tuple[float, float, float]) -> tuple[int, int]:
    """Where a point of the base frame, metres, appears; points behind the camera land far outside."""
    x, y, z, _ = np.linalg.inv(camera.base_from_camera) @ np.array([*point, 1.0])
    u, v, _ = camera.intrinsics @ np.array([x, y, max(z, 1e-3)]) / max(z, 1e-3)
    return int(np.clip(round(u), -10_000, 10_000)), int(np.clip(round(v), -10_000, 10_000))


def _value_maps(deliberation: Deliberation) -> tuple[NDArray[np.float32], NDArray[np.float32], str]:
    """The map of the chosen direction, the best over all directions, and what the values are."""
    decision = deliberation.decision
    if deliberation.exploration is not None:
        stack, name = deliberation.exploration.posterior, "exploration"
    elif decision.kind == gi.PUSH:
        stack, name = deliberation.q_maps.push, "push Q"
    else:
        stack, name = deliberation.q_maps.grasp, "grasp Q"
    return stack[decision.rotation], stack.max(axis=0), name


def _value_colors(values: NDArray[np.float32], scale_of: NDArray[np.float32], color: Image) -> Image:
    """Values from low to high over a dimmed view from above, so that one sees what they are values of."""
    low, high = float(scale_of.min()), float(scale_of.max())
    share = np.clip((values - low) / max(high - low, 1e-6), 0.0, 1.0)
    share = cv2.resize(share, color.shape[1::-1], interpolation=cv2.INTER_LINEAR)
    heat = cv2.cvtColor(cv2.applyColorMap((share * 255).astype(np.uint8), cv2.COLORMAP_INFERNO), cv2.COLOR_BGR2RGB)
    weight = (0.45 + 0.55 * share)[..., None]
    return (weight * heat + (1 - weight) * 0.8 * color).astype(np.uint8)


def _height_colors(height: NDArray[np.float32]) -> Image:
    levels = (np.clip(height / _SHOWN_HEIGHT, 0.0, 1.0) * 255).astype(np.uint8)
    return cv2.cvtColor(cv2.applyColorMap(levels, cv2.COLORMAP_VIRIDIS), cv2.COLOR_BGR2RGB).astype(np.uint8)


def _header(deliberation: Deliberation, target: str, width: int) -> Image:
    decision = deliberation.decision
    header = np.full((_HEADER, width, 3), _BACKGROUND, np.uint8)
    kind = gi.MotionKind.Name(decision.kind).lower()
    cv2.circle(header, (20, 20), 8, RGB[target], -1, cv2.LINE_AA)
    title = f"step {decision.step}   {decision.policy}: {kind}   value {decision.value:.3f}"
    _text(header, title, (38, 25), _PUSH if decision.kind == gi.PUSH else _GRASP, 0.55)
    _text(header, decision.why, (12, 46), _FAINT, 0.42)
    return header


def _text(image: Image, text: str, at: tuple[int, int], color: tuple[int, int, int], size: float) -> None:
    cv2.putText(image, text, at, cv2.FONT_HERSHEY_SIMPLEX, size, color, 1, cv2.LINE_AA)
