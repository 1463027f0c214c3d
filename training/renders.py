"""Labelled renders on disk: one file for each pile of blocks, several views in each.

A file's content depends on its seed alone, so an interrupted rendering goes on where it stopped.
"""

import os
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from zipfile import BadZipFile

import cv2
import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.classes import CLASSES
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.runtime.frame import Camera
from grasping_invisible.sim_robot.blocks import BLOCKS
from grasping_invisible.sim_robot.camera import default_camera, render
from grasping_invisible.sim_robot.kinematics import Kinematics
from grasping_invisible.training.appearance import draw_appearance, paint
from grasping_invisible.training.clutter_world import ClutterWorld, knock, make_clutter, pose_arm

VIEWS = 6  # of each pile
STANDARD_SHARE = 0.3  # of views with the simulator's own light, colours and camera
EMPTY_SHARE = 0.12  # of views without any target class
KNOCKED_SHARE = 0.5  # of views before which a block is knocked
TARGET_ODDS = 0.5  # a block's, to be of a target class
SLIVER_ODDS = 0.8  # the same where little of it shows: otherwise few targets would be seen as slivers
SLIVER_PIXELS = (4, 150)  # how little that is
HELD_OUT_SEEDS = 1_000_000  # piles from this seed on are never trained on


@dataclass(frozen=True)
class Views:
    """Renders of one pile. V views of H x W pixels.

    `color`: (V, H, W, 3) uint8 RGB. `labels`: (V, H, W) uint8 class indices. `visible`: (V, 8) float32, which
    share of a class's blocks is in view, from pixels seen and the blocks' outlines; NaN without such blocks.
    `standard`: (V,) bool, taken with the simulator's own light, colours and camera.
    """

    color: NDArray[np.uint8]
    labels: NDArray[np.uint8]
    visible: NDArray[np.float32]
    standard: NDArray[np.bool_]


def render_pile(seed: int, kinematics: Kinematics) -> Views:
    """Drop a pile of blocks and look at it from `VIEWS` places, in other colours each time."""
    rng = np.random.default_rng(seed)
    clutter = make_clutter(rng)
    try:
        views = [_view(clutter, kinematics, rng) for _ in range(VIEWS)]
    finally:
        clutter.close()
    color, labels, visible, standard = (np.stack(parts) for parts in zip(*views, strict=True))
    return Views(color, labels, visible, standard)


def render_missing(folder: Path, seeds: Iterable[int]) -> Iterable[int]:
    """Render the piles that the folder lacks; yields each seed when it is there."""
    folder.mkdir(parents=True, exist_ok=True)
    kinematics = Kinematics()
    try:
        for seed in seeds:
            path = pile_path(folder, seed)
            if not path.is_file():
                partial = path.with_suffix(".partial")
                with partial.open("wb") as file:
                    np.savez(file, **vars(render_pile(seed, kinematics)))
                os.replace(partial, path)
            yield seed
    finally:
        kinematics.close()


def load_pile(folder: Path, seed: int) -> Views:
    """Raises `BadInput` where the file is damaged."""
    path = pile_path(folder, seed)
    try:
        with np.load(path) as content:
            return Views(**content)
    except (OSError, ValueError, TypeError, EOFError, KeyError, BadZipFile) as error:
        raise BadInput(f"{path} is not a file of renders ({error}); delete it to have it made again") from None


def pile_path(folder: Path, seed: int) -> Path:
    """The file of a pile."""
    return folder / f"pile-{seed:07d}.npz"


def _view(clutter: ClutterWorld, kinematics: Kinematics, rng: np.random.Generator) -> tuple:
    bodies = list(clutter.world.bodies.values())
    standard, empty = bool(rng.random() < STANDARD_SHARE), bool(rng.random() < EMPTY_SHARE)
    if rng.random() < KNOCKED_SHARE:
        knock(clutter.world, rng)
    pose_arm(clutter, kinematics, rng)
    odds = [0.0] * len(bodies) if empty else _target_odds(clutter.client, bodies)
    look = draw_appearance(rng, odds, standard)
    paint(clutter.client, bodies, clutter.world.table, look)
    image = render(clutter.client, look.camera, look.lighting)
    class_of_body = np.zeros(max([*bodies, *np.unique(image.bodies)]) + 2, np.uint8)
    class_of_body[bodies] = look.classes
    labels = class_of_body[image.bodies]  # body -1, nothing, reads the last entry, which stays 0
    return image.color, labels, _visible(clutter, look.camera, look.classes, labels), np.bool_(standard)


def _target_odds(client: int, bodies: list[int]) -> list[float]:
    seen = Counter(render(client, default_camera()).bodies.ravel().tolist())
    fewest, most = SLIVER_PIXELS
    return [SLIVER_ODDS if fewest <= seen[body] <= most else TARGET_ODDS for body in bodies]


def _visible(
    clutter: ClutterWorld, camera: Camera, classes: tuple[int, ...], labels: NDArray[np.uint8]
) -> NDArray[np.float32]:
    """Seen pixels of each class over the area of its blocks' convex outlines, were nothing before them."""
    outlines = np.zeros(len(CLASSES))
    for state, index in zip(clutter.world.object_states(), classes, strict=True):
        corners = _project(camera, BLOCKS[state.shape].surface.vertices, state.position, state.quaternion)
        mask = np.zeros((camera.height, camera.width), np.uint8)
        cv2.fillConvexPoly(mask, cv2.convexHull(corners), 1)
        outlines[index] += np.count_nonzero(mask)
    seen = np.bincount(labels.ravel(), minlength=len(CLASSES)).astype(float)
    shares = np.full(len(CLASSES), np.nan, np.float32)
    present = outlines[1:] > 0
    shares[1:][present] = seen[1:][present] / outlines[1:][present]
    return shares


def _project(camera: Camera, vertices: NDArray, position: tuple, quaternion: tuple) -> NDArray[np.int32]:
    """Corners of a body, own frame, to whole pixels (M, 2)."""
    x, y, z, w = quaternion
    axis = np.array([x, y, z])
    turned = vertices + 2 * np.cross(axis, np.cross(axis, vertices) + w * vertices)
    inverse = np.linalg.inv(camera.base_from_camera)
    optical = (turned + position) @ inverse[:3, :3].T + inverse[:3, 3]
    pixels = optical @ camera.intrinsics.T
    return np.rint(pixels[:, :2] / pixels[:, 2:]).astype(np.int32)
