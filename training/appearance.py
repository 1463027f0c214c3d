"""How a render looks: the colours of blocks and table, the light, the camera's place; drawn at random.

Objects of a target class are near its colour. What is none of them (grey, the robot, the table, blocks of foreign
colours) is background.
"""

import colorsys
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pybullet
from numpy.typing import NDArray

from grasping_invisible.data.classes import CLASSES, GREY, RGB, TARGET_COLORS
from grasping_invisible.runtime.frame import Camera
from grasping_invisible.sim_robot.camera import LOOK_AT, POSITION, Lighting, default_camera, look_at
from grasping_invisible.sim_robot.world import TABLE_RGB

Color = tuple[float, float, float]

HUE_JITTER = 6.0 / 360.0  # neighbouring target colours are 18 degrees or more apart
# Hues, degrees, that are none of the target colours: lime, cyan, pink.
FOREIGN_HUES = ((78.0, 105.0), (165.0, 195.0), (312.0, 340.0))


@dataclass(frozen=True)
class Appearance:
    """Everything about a render that is not geometry. `classes`: class index of each block, in order."""

    classes: tuple[int, ...]
    colors: tuple[Color, ...]
    table: Color
    lighting: Lighting
    camera: Camera


def draw_appearance(rng: np.random.Generator, odds: Sequence[float], standard: bool) -> Appearance:
    """Random colours, light and camera. `odds`: of each block, its probability of a target class.

    `standard`: the simulator's own light, table, camera and colours.
    """
    kinds = [_draw_kind(rng, chance) for chance in odds]
    colors = [_color_of(kind, rng, standard) for kind in kinds]
    classes = [CLASSES.index(kind) if kind in CLASSES else 0 for kind in kinds]
    if standard:
        return Appearance(tuple(classes), tuple(colors), _unit(TABLE_RGB), Lighting(), default_camera())
    return Appearance(tuple(classes), tuple(colors), _table_color(rng), _lighting(rng), _camera(rng))


def paint(client: int, bodies: list[int], table: int, appearance: Appearance) -> None:
    """Give blocks and table of a PyBullet world their colours."""
    for body, color in zip([*bodies, table], [*appearance.colors, appearance.table], strict=True):
        pybullet.changeVisualShape(body, -1, rgbaColor=(*color, 1.0), physicsClientId=client)


def _draw_kind(rng: np.random.Generator, odds: float) -> str:
    if rng.random() < odds:
        return str(rng.choice(TARGET_COLORS))
    return "foreign" if rng.random() < 0.2 else GREY


def _color_of(kind: str, rng: np.random.Generator, standard: bool) -> Color:
    if kind == "foreign":
        low, high = FOREIGN_HUES[rng.integers(len(FOREIGN_HUES))]
        return colorsys.hsv_to_rgb(rng.uniform(low, high) / 360.0, rng.uniform(0.3, 0.9), rng.uniform(0.3, 0.95))
    red, green, blue = _unit(RGB[kind])
    if standard:
        return red, green, blue
    if kind == GREY:
        level, tint = rng.uniform(0.25, 0.85), rng.normal(0.0, 0.02, 3)
        return _clipped(level + tint)
    hue, saturation, value = colorsys.rgb_to_hsv(red, green, blue)
    return colorsys.hsv_to_rgb(
        (hue + rng.uniform(-HUE_JITTER, HUE_JITTER)) % 1.0,
        min(1.0, saturation * rng.uniform(0.8, 1.1)),
        min(1.0, value * rng.uniform(0.8, 1.2)),
    )


def _table_color(rng: np.random.Generator) -> Color:
    """Near the simulator's, or any grey, or wood, or a pale tint."""
    choice = rng.random()
    if choice < 0.4:
        return _clipped(np.array(TABLE_RGB) / 255.0 * rng.uniform(0.8, 1.1) + rng.normal(0.0, 0.02, 3))
    if choice < 0.7:
        return _clipped(rng.uniform(0.1, 1.0) + rng.normal(0.0, 0.02, 3))
    if choice < 0.85:
        return colorsys.hsv_to_rgb(rng.uniform(20, 40) / 360.0, rng.uniform(0.15, 0.4), rng.uniform(0.35, 0.85))
    return colorsys.hsv_to_rgb(rng.random(), rng.uniform(0.0, 0.2), rng.uniform(0.4, 1.0))


def _lighting(rng: np.random.Generator) -> Lighting:
    azimuth, height = rng.uniform(0.0, 2 * np.pi), rng.uniform(0.7, 3.0)
    warmth = rng.uniform(-0.06, 0.06)
    return Lighting(
        direction=(float(np.cos(azimuth)), float(np.sin(azimuth)), float(height)),
        color=(1.0, 1.0 - abs(warmth) / 3, 1.0 - warmth) if warmth > 0 else (1.0 + warmth, 1.0 + warmth / 3, 1.0),
        ambient=float(rng.uniform(0.4, 0.75)),
        diffuse=float(rng.uniform(0.2, 0.6)),
        specular=float(rng.uniform(0.0, 0.3)),
        shadow=bool(rng.random() < 0.3),
    )


def _camera(rng: np.random.Generator) -> Camera:
    """The mounted camera, moved by some centimetres."""
    standard = default_camera()
    position = np.array(POSITION) + rng.uniform(-0.08, 0.08, 3)
    target = np.array(LOOK_AT) + np.append(rng.uniform(-0.05, 0.05, 2), 0.0)
    return Camera(standard.width, standard.height, standard.intrinsics, look_at(position, target))


def _unit(rgb: tuple[int, int, int]) -> Color:
    red, green, blue = rgb
    return red / 255.0, green / 255.0, blue / 255.0


def _clipped(values: NDArray[np.float64]) -> Color:
    red, green, blue = np.clip(values, 0.0, 1.0)
    return float(red), float(green), float(blue)
