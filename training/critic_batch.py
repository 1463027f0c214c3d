"""Transitions as the critic's input, with the changes that leave an action's worth as it is."""

from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import PUSH_LEVELS, ROTATIONS
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.rotation import PLANES, ROTATED_CELLS, rotate_planes, rotated_pixel, rotated_window
from grasping_invisible.training.critic_net import CriticNet, executed
from grasping_invisible.training.state_planes import planes_of
from grasping_invisible.training.transitions import Transition

CROP = 64  # cells of a training input, square; holds what a motion can reach and a target's border beyond it
CROP_JITTER = 6
PUSH_AHEAD = 12  # cells by which more of it lies ahead of a push than behind: a push is 25 cells long
HEIGHT_NOISE = 0.02  # standard deviation, in the units of the height plane: 2 mm
COLOR_GAIN, COLOR_SHIFT = 0.15, 0.1

Example = tuple[NDArray[np.float32], tuple[int, int]]


def example(transition: Transition, planes: int, rng: np.random.Generator | None = None) -> Example:
    """So many `planes` turned to the executed action, (P, S, S), and the pixel (row, column) where its Q value is.

    With `rng` augmented and cropped to `CROP`: mirrored about the action's axis, a grasp turned by half a turn,
    colours and heights changed. Without it all of the rotated grid.
    """
    rotation, row, column = transition.rotation, transition.row, transition.column
    if rng is not None and transition.kind == gi.GRASP and rng.random() < 0.5:
        rotation = (rotation + ROTATIONS // 2) % ROTATIONS
    seen = planes_of(transition, planes)
    pixel = rotated_pixel(row, column, rotation)
    if rng is None:
        (turned,) = rotate_planes(seen, [rotation])
        return turned, pixel
    window, pixel = _crop(seen, rotation, pixel, PUSH_AHEAD if transition.kind == gi.PUSH else 0, rng)
    _distort(window, rng)
    return window, pixel


def executed_values(net: CriticNet, examples: list[Example], transitions: Sequence[Transition]) -> torch.Tensor:
    """The Q values of executed actions, (B,) on the network's device, each from the map of its kind of motion."""
    planes = torch.from_numpy(np.stack([planes for planes, _ in examples]))
    # A map for each level of a push, and one for grasps.
    maps = [item.level if item.kind == gi.PUSH else len(PUSH_LEVELS) for item in transitions]
    places = [(index, *pixel) for index, (_, pixel) in zip(maps, examples, strict=True)]
    return executed(net.maps_by_kind(planes), torch.tensor(places, device=net.device))


def _distort(planes: NDArray[np.float32], rng: np.random.Generator) -> None:
    """Other light, where colour is seen, and a noisier depth camera, in place; planes (P, S, S)."""
    if len(planes) == PLANES:
        gain = rng.uniform(1 - COLOR_GAIN, 1 + COLOR_GAIN, (3, 1, 1)).astype(np.float32)
        shift = rng.uniform(-COLOR_SHIFT, COLOR_SHIFT, (3, 1, 1)).astype(np.float32)
        planes[:3] = np.clip((planes[:3] + 1) * gain + shift, 0, 2) - 1
    noise = rng.standard_normal(planes.shape[1:], np.float32) * np.float32(HEIGHT_NOISE * rng.random())
    planes[-2] = np.maximum(planes[-2] + noise, 0)


def _crop(
    planes: NDArray[np.float32], rotation: int, pixel: tuple[int, int], ahead: int, rng: np.random.Generator
) -> Example:
    """A turned window around the pixel, and half of the time its mirror image about the action's axis."""
    jitter = rng.integers(-CROP_JITTER, CROP_JITTER + 1, 2)
    corner = np.array(pixel) - CROP // 2 + (0, ahead) + jitter
    top, left = (int(at) for at in np.clip(corner, 0, ROTATED_CELLS - CROP))
    window = rotated_window(planes, rotation, top, left, CROP)
    row, column = pixel[0] - top, pixel[1] - left
    if rng.random() < 0.5:
        return np.ascontiguousarray(window[:, ::-1]), (CROP - 1 - row, column)
    return window, (row, column)
