"""The clutter prior C_p: where, for each push direction, the edge of a heap lies ahead (paper, section VII-A)."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import ACTION_CELLS, ROTATIONS
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.rotation import ANGLES, to_action_grid

LOOK_AHEAD = 0.050  # metres: 25 heightmap cells, about twice the closed gripper's width
RISE = 0.020  # metres by which the ground ahead must be higher, to be an edge
BOX = 0.050  # metres, side of the box filter: 25 heightmap cells


def clutter_prior(maps: Heightmaps) -> NDArray[np.float32]:
    """Prior of every push on the action grid, (16, 112, 112) float32, 0 to 1.

    A cell is an edge for rotation k where the height `LOOK_AHEAD` farther along the push is greater by
    `RISE`; its prior is the share of edge cells in the box around it. The heights are shifted along each
    direction instead of the map being turned; the box stays aligned with the grid.
    """
    height = to_action_grid(maps.height)
    cell = maps.workspace.size / ACTION_CELLS
    edges = np.empty((ROTATIONS, ACTION_CELLS, ACTION_CELLS), np.float32)
    box = round(BOX / cell) // 2 * 2 + 1
    for k, yaw in enumerate(ANGLES):
        ahead = _shifted(height, float(yaw), LOOK_AHEAD / cell)
        edge = (ahead - height > RISE).astype(np.float32)
        edges[k] = cv2.blur(edge, (box, box), borderType=cv2.BORDER_CONSTANT)
    return np.clip(edges, 0.0, 1.0, out=edges)


def _shifted(height: NDArray[np.float32], yaw: float, distance: float) -> NDArray[np.float32]:
    """For every cell the height `distance` cells farther along `yaw`; the table, 0, outside the grid."""
    source = np.array([[1.0, 0.0, distance * math.cos(yaw)], [0.0, 1.0, -distance * math.sin(yaw)]])
    shifted = cv2.warpAffine(
        height,
        source,
        height.shape[::-1],
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=(0.0,),
    )
    return np.asarray(shifted, np.float32)
