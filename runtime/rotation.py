"""What the critic sees: normalised planes, turned so that a rotation's action points right; and back.

The action grid has 112 x 112 cells over the workspace, oriented like the heightmaps. Rotation k turns it
clockwise (seen from above) by k * 22.5 degrees about the middle of the workspace into a grid of 160 x 160
cells of the same size, in which an action of that rotation points along +column.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import ACTION_CELLS, ROTATIONS, rotation_angle
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.workspace import Workspace

ROTATED_CELLS = 160  # holds 112 * sqrt(2), whatever the angle
PLANES = 5  # red, green, blue, height, target mask
# What a critic may be made to see, and how many planes that is: always the last of them.
CRITIC_INPUTS = {"color+depth+mask": PLANES, "depth+mask": 2}
HEIGHT_SCALE = 0.1  # metres of height that a height plane calls 1
ANGLES = np.array([rotation_angle(k) for k in range(ROTATIONS)])  # yaw of each rotation, radians
_QUARTER_TURNS = (cv2.ROTATE_90_CLOCKWISE, cv2.ROTATE_180, cv2.ROTATE_90_COUNTERCLOCKWISE)


def action_grid(workspace: Workspace) -> Workspace:
    """The same square cut into the cells of the action grid (4 mm on the default workspace)."""
    return replace(workspace, resolution=workspace.size / ACTION_CELLS)


def ahead_of_cells(distance: float, workspace: Workspace) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Where the points lie that are `distance` metres ahead of every cell of the action grid, for each rotation.

    x, (16, 1, 112), and y, (16, 112, 1), in the base frame, metres.
    """
    x, y = action_grid(workspace).cell_centers()
    yaw = ANGLES[:, None, None]
    return x + distance * np.cos(yaw), y + distance * np.sin(yaw)


def critic_planes(maps: Heightmaps, mask: NDArray[np.bool_], count: int = PLANES) -> NDArray[np.float32]:
    """The critic's input on the action grid, (112, 112, P) float32; the one place where it is normalised.

    Planes 0 to 2: RGB from -1 to 1. Plane 3: height above the table in units of `HEIGHT_SCALE`. Plane 4: the
    share of the cell covered by the target, 0 to 1. `mask`: (N, N) bool, the target's cells. `count`: P, one of the
    values of `CRITIC_INPUTS`; the colours are left out of 2. Cells are averaged by area, so a gap of one heightmap
    cell lowers the height and does not vanish. A grey, empty table is 0 in every plane.
    """
    planes = np.empty((ACTION_CELLS, ACTION_CELLS, count), np.float32)
    if count == PLANES:
        planes[..., :3] = to_action_grid(maps.color.astype(np.float32)) * (2.0 / 255.0) - 1.0
    planes[..., -2] = to_action_grid(maps.height) * (1.0 / HEIGHT_SCALE)
    planes[..., -1] = to_action_grid(mask.astype(np.float32))
    return planes


def to_action_grid(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Heightmap-sized float32 values, (N, N) or (N, N, C), averaged over the cells of the action grid."""
    resized = cv2.resize(values, (ACTION_CELLS, ACTION_CELLS), interpolation=cv2.INTER_AREA)
    return np.asarray(resized, np.float32)


def rotate_planes(planes: NDArray[np.float32], rotations: Sequence[int] = range(ROTATIONS)) -> NDArray[np.float32]:
    """Planes on the action grid, (112, 112, C), turned for each of K rotations: (K, C, 160, 160), contiguous.

    Bilinear. What lies outside the workspace is 0: table, of a neutral colour.
    """
    channels = [np.ascontiguousarray(planes[..., channel]) for channel in range(planes.shape[2])]
    # Four rotations are interpolated; the others are quarter turns of those, exact and cheaper.
    first_quarter = {k: [_turn(plane, k) for plane in channels] for k in {k % 4 for k in rotations}}
    rotated = np.empty((len(rotations), len(channels), ROTATED_CELLS, ROTATED_CELLS), np.float32)
    for index, k in enumerate(rotations):
        for channel, plane in enumerate(first_quarter[k % 4]):
            if k < 4:
                rotated[index, channel] = plane
            else:
                cv2.rotate(plane, _QUARTER_TURNS[k // 4 - 1], dst=rotated[index, channel])
    return rotated


def rotated_window(planes: NDArray[np.float32], rotation: int, top: int, left: int, size: int) -> NDArray[np.float32]:
    """A square window of `rotate_planes`' result for one rotation, (C, S, S), its first cell at (`top`, `left`)."""
    grid = _grid_from_rotated(rotation)
    grid = np.column_stack([grid[:, :2], grid @ np.array([left, top, 1.0])])
    turned = [_warp(np.ascontiguousarray(planes[..., channel]), grid, size) for channel in range(planes.shape[2])]
    return np.stack(turned)


def unrotate(maps: NDArray[np.float32]) -> NDArray[np.float32]:
    """One map for each rotation, (16, 160, 160), back on the action grid: (16, 112, 112).

    Each cell takes the value of the rotated pixel nearest to it, `rotated_pixel`, so that a Q value that was
    trained at one pixel is read from that same pixel.
    """
    flat = maps.reshape(ROTATIONS, ROTATED_CELLS * ROTATED_CELLS)
    return np.take_along_axis(flat, _pixels_of_cells(), axis=1).reshape(ROTATIONS, ACTION_CELLS, ACTION_CELLS)


def rotated_cell(row: float, column: float, k: int) -> tuple[float, float]:
    """Where a cell of the action grid lies in the grid of rotation `k`: (row, column), fractional."""
    rows, columns = _rotate(row, column, k)
    return float(rows), float(columns)


def rotated_pixel(row: int, column: int, k: int) -> tuple[int, int]:
    """The pixel of the network's output for rotation `k` that holds the Q value of an action's cell."""
    index = int(_pixels_of_cells()[k, row * ACTION_CELLS + column])
    return divmod(index, ROTATED_CELLS)


def _rotate(row: Any, column: Any, k: int) -> tuple[Any, Any]:
    angle = rotation_angle(k)
    across = column - (ACTION_CELLS - 1) / 2
    down = row - (ACTION_CELLS - 1) / 2
    middle = (ROTATED_CELLS - 1) / 2
    return (
        across * np.sin(angle) + down * np.cos(angle) + middle,
        across * np.cos(angle) - down * np.sin(angle) + middle,
    )


def _turn(plane: NDArray[np.float32], k: int) -> NDArray[np.float32]:
    return _warp(plane, _grid_from_rotated(k), ROTATED_CELLS)


def _warp(plane: NDArray[np.float32], grid: NDArray[np.float64], size: int) -> NDArray[np.float32]:
    turned = cv2.warpAffine(
        plane,
        grid,
        (size, size),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=(0.0,),
    )
    return np.asarray(turned, np.float32)


@lru_cache(maxsize=ROTATIONS)
def _grid_from_rotated(k: int) -> NDArray[np.float64]:
    """The 2 x 3 matrix from (column, row) in the grid of rotation `k` to those of the action grid."""
    angle = rotation_angle(k)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    middle = (ACTION_CELLS - 1) / 2 - turn @ np.full(2, (ROTATED_CELLS - 1) / 2)
    return np.column_stack([turn, middle])


@lru_cache(maxsize=1)
def _pixels_of_cells() -> NDArray[np.intp]:
    """For each rotation and each cell of the action grid, the flat index of its nearest rotated pixel."""
    row, column = np.mgrid[:ACTION_CELLS, :ACTION_CELLS].astype(np.float64)
    indices = np.empty((ROTATIONS, ACTION_CELLS * ACTION_CELLS), np.intp)
    for k in range(ROTATIONS):
        rows, columns = _rotate(row, column, k)
        indices[k] = (np.rint(rows) * ROTATED_CELLS + np.rint(columns)).astype(np.intp).ravel()
    return indices
