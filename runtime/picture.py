"""A picture of one decision: what the camera saw, the map it was made from, and the motion drawn into both."""

import cv2
import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import PUSH_LENGTH
from grasping_invisible.data.classes import CLASSES, RGB
from grasping_invisible.data.drawing import (
    GRASP_COLOR,
    PUSH_COLOR,
    Image,
    height_colors,
    outline,
    pixel_of,
    stroke,
    strokes,
    value_colors,
)
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.decision import Deliberation
from grasping_invisible.runtime.decision_record import Decision
from grasping_invisible.runtime.frame import RgbdFrame
from grasping_invisible.runtime.perception import target_patches
from grasping_invisible.runtime.workspace import Workspace

_PANEL = 240  # pixels, side of a map
_HEIGHT = 2 * _PANEL
_HEADER = 56
_CAPTION = 20
_INK = (240, 240, 240)
_FAINT = (165, 172, 180)
_BACKGROUND = (24, 27, 31)


def draw_decision(frame: RgbdFrame, deliberation: Deliberation, target: str) -> Image:
    """An RGB picture, 536 pixels high: camera view left; maps right: colour, height, chosen map, best of all."""
    decision, perception = deliberation.decision, deliberation.perception
    workspace = perception.maps.workspace
    camera_view = _camera_view(frame, target_patches(perception.labels == CLASSES.index(target)), decision, target)
    chosen, best, name = _value_maps(deliberation)
    panels = (
        _panel(perception.maps.color, decision, workspace, "seen from above"),
        _panel(height_colors(perception.maps.height), decision, workspace, "height"),
        _panel(_value_colors(chosen, best, perception.maps.color), decision, workspace, f"{name}, this direction"),
        _panel(_value_colors(best, best, perception.maps.color), decision, workspace, f"{name}, best of 16"),
    )
    maps = np.vstack([np.hstack(panels[:2]), np.hstack(panels[2:])])
    body = np.hstack([camera_view, maps])
    return np.vstack([_header(deliberation, target, body.shape[1]), body])


def _camera_view(frame: RgbdFrame, target_pixels: NDArray[np.bool_], decision: Decision, target: str) -> Image:
    image = frame.color.copy()
    outline(image, target_pixels, RGB[target])
    camera = frame.camera
    for start, end in _strokes(decision):
        height = decision.position[2]
        pixels = [pixel_of((x, y, height), camera.intrinsics, camera.base_from_camera) for x, y in (start, end)]
        stroke(image, pixels[0], pixels[1], decision.kind)
    scale = _HEIGHT / image.shape[0]
    return cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA).astype(np.uint8)


def _panel(image: Image, decision: Decision, workspace: Workspace, caption: str) -> Image:
    """A map with the motion in it; maps of any resolution cover the same square."""
    panel = cv2.resize(image, (_PANEL, _PANEL), interpolation=cv2.INTER_NEAREST).astype(np.uint8)
    low, high = workspace.low, workspace.high
    scale = _PANEL / workspace.size
    for line in _strokes(decision):
        start, end = ((round((x - low[0]) * scale), round((high[1] - y) * scale)) for x, y in line)
        stroke(panel, start, end, decision.kind)
    panel[-_CAPTION:] = panel[-_CAPTION:] // 4
    _text(panel, caption, (7, _PANEL - 7), _INK, 0.4)
    cv2.rectangle(panel, (0, 0), (_PANEL - 1, _PANEL - 1), _BACKGROUND, 1)
    return panel


def _strokes(decision: Decision) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    x, y, _ = decision.position
    return strokes(decision.kind, x, y, decision.yaw, PUSH_LENGTH)


def _value_maps(deliberation: Deliberation) -> tuple[NDArray[np.float32], NDArray[np.float32], str]:
    """The map of the chosen direction, the best over all directions, and what the values are."""
    decision = deliberation.decision
    if deliberation.exploration is not None:
        stack, name = deliberation.exploration.posterior[decision.level], "exploration"
    elif decision.kind == gi.PUSH:
        stack, name = deliberation.q_maps.push[decision.level], "push Q"
    else:
        stack, name = deliberation.q_maps.grasp, "grasp Q"
    return stack[decision.rotation], stack.max(axis=0), name


def _value_colors(values: NDArray[np.float32], scale_of: NDArray[np.float32], color: Image) -> Image:
    return value_colors(values, float(scale_of.min()), float(scale_of.max()), color)


def _header(deliberation: Deliberation, target: str, width: int) -> Image:
    decision = deliberation.decision
    header = np.full((_HEADER, width, 3), _BACKGROUND, np.uint8)
    kind = gi.MotionKind.Name(decision.kind).lower()
    cv2.circle(header, (20, 20), 8, RGB[target], -1, cv2.LINE_AA)
    title = f"step {decision.step}   {decision.policy}: {kind}   value {decision.value:.3f}"
    _text(header, title, (38, 25), PUSH_COLOR if decision.kind == gi.PUSH else GRASP_COLOR, 0.55)
    _text(header, decision.why, (12, 46), _FAINT, 0.42)
    return header


def _text(image: Image, text: str, at: tuple[int, int], color: tuple[int, int, int], size: float) -> None:
    cv2.putText(image, text, at, cv2.FONT_HERSHEY_SIMPLEX, size, color, 1, cv2.LINE_AA)
