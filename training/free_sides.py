"""Whether the gripper's two fingers find room beside the target as it lies, by geometry alone."""

import math

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import ROTATIONS, rotation_angle
from grasping_invisible.data.drawing import FINGER_OPENING
from grasping_invisible.data.target_border import GROUND_HEIGHT
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.motion import FINGERTIPS, GRASP_DEPTH, MIN_TCP_HEIGHT

FINGER_WIDTH = 0.022  # metres across the closing direction
FINGER_DEPTH = 0.016  # and along it
PLAY = 0.003  # metres by which the opening must exceed the target


def has_free_sides(maps: Heightmaps, mask: NDArray[np.bool_]) -> bool:
    """Whether a grasp at the middle of the target's mask, (N, N), would be free of neighbours in some direction.

    It is where the target is narrower than the opening, and nothing stands where the fingers come down higher than
    they reach.
    """
    if not mask.any():
        return False
    row, column = np.argwhere(mask).mean(axis=0)
    tcp = max(float(np.percentile(maps.height[mask], 80)) - GRASP_DEPTH, MIN_TCP_HEIGHT)
    tip = max(tcp - FINGERTIPS, GROUND_HEIGHT)
    rows, columns = np.mgrid[: len(mask), : len(mask)]
    x, y = (columns - column) * maps.workspace.resolution, (row - rows) * maps.workspace.resolution
    for k in range(ROTATIONS // 2):
        angle = rotation_angle(k)
        along, across = x * math.cos(angle) + y * math.sin(angle), y * math.cos(angle) - x * math.sin(angle)
        lane = np.abs(across) <= FINGER_WIDTH / 2
        fingers = lane & (np.abs(np.abs(along) - FINGER_OPENING / 2 - FINGER_DEPTH / 2) <= FINGER_DEPTH / 2)
        fits = np.abs(along[mask & lane]).max(initial=0.0) <= FINGER_OPENING / 2 - PLAY
        if fits and maps.height[fingers].max(initial=0.0) < tip:
            return True
    return False
