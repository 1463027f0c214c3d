"""What a critic in training says of a whole state: the same path as on the robot, the network in torch."""

from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import ACTION_CELLS, PUSH_LEVELS, ROTATIONS, feasible_grasps
from grasping_invisible.runtime.choice import best_value
from grasping_invisible.runtime.critic import QMaps
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.motion import (
    feasible_pushes,
    low_grasps,
    push_heights,
    pushes_for,
    tips_above,
    top_of,
)
from grasping_invisible.runtime.rotation import (
    ROTATED_CELLS,
    critic_planes,
    rotate_planes,
    rotated_cell,
    rotated_window,
    unrotate,
)
from grasping_invisible.training.critic_net import CriticNet

NEAR = 96  # cells; a push that passes the target starts and ends within half of this from its middle


def q_maps(
    net: CriticNet, maps: Heightmaps, mask: NDArray[np.bool_], rotations: Sequence[int] = range(ROTATIONS)
) -> QMaps:
    """Q maps of a network in evaluation mode; minus infinity for rotations that are not asked for."""
    planes = torch.from_numpy(rotate_planes(critic_planes(maps, mask, net.planes), rotations))
    with torch.inference_mode():
        values = net.maps_by_kind(planes).cpu().numpy()
    turned = _nothing_known()
    turned[:, list(rotations)] = values.swapaxes(0, 1)
    return _turned_back(turned)


def q_maps_near(
    net: CriticNet, maps: Heightmaps, mask: NDArray[np.bool_], rotations: Sequence[int] = range(ROTATIONS)
) -> QMaps:
    """As `q_maps`, but worked out only within reach of the target under the mask, at a third of the time."""
    planes = critic_planes(maps, mask, net.planes)
    factor = maps.workspace.cells // ACTION_CELLS
    row, column = np.argwhere(mask).mean(axis=0) / factor - 0.5
    corners = [
        np.clip(np.rint(rotated_cell(row, column, k)).astype(int) - NEAR // 2, 0, ROTATED_CELLS - NEAR)
        for k in rotations
    ]
    windows = [rotated_window(planes, k, top, left, NEAR) for k, (top, left) in zip(rotations, corners, strict=True)]
    with torch.inference_mode():
        values = net.maps_by_kind(torch.from_numpy(np.stack(windows))).cpu().numpy()
    turned = _nothing_known()
    for k, (top, left), window in zip(rotations, corners, values, strict=True):
        turned[:, k, top : top + NEAR, left : left + NEAR] = window
    return _turned_back(turned)


def best_values(q: QMaps, maps: Heightmaps, mask: NDArray[np.bool_]) -> tuple[float, float]:
    """q_p and q_g: the greatest values of pushes and grasps that the robot would choose from; 0 where there is none.

    `mask`: (N, N) bool, not all false: where what they are for is.
    """
    heights = push_heights(maps, tips_above(top_of(maps, mask)))
    push = best_value(q.push, pushes_for(feasible_pushes(maps, heights), mask, maps.workspace))
    grasp = best_value(q.grasp, low_grasps(maps, feasible_grasps(mask, maps.workspace.resolution)))
    return push or 0.0, grasp or 0.0


def _nothing_known() -> NDArray[np.float32]:
    """Turned maps of each kind of motion, pushes low and raised and grasps: (3, 16, 160, 160), minus infinity."""
    return np.full((len(PUSH_LEVELS) + 1, ROTATIONS, ROTATED_CELLS, ROTATED_CELLS), -np.inf, np.float32)


def _turned_back(turned: NDArray[np.float32]) -> QMaps:
    *pushes, grasps = map(unrotate, turned)
    return QMaps(np.stack(pushes), grasps)
