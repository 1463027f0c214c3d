"""From a cell and a rotation to a motion of the arm, and which motions can be made at all (paper, section IV-A)."""

import math
from collections.abc import Sequence
from functools import lru_cache
from itertools import product

import cv2
import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import ACTION_CELLS, LOW, PUSH_LENGTH, RAISED, ROTATIONS, blocks
from grasping_invisible.data.target_border import BORDER_WIDTH, distance_to
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.rotation import ANGLES, action_grid, ahead_of_cells
from grasping_invisible.runtime.workspace import Workspace

MIN_TCP_HEIGHT = 0.015  # metres above the table, of every motion
# And no motion starts above this one: what looks taller is no clutter, and the arm travels at 0.25 m.
MAX_TCP_HEIGHT = 0.24
GRASP_DEPTH = 0.03  # metres below the local top, to which a grasp descends
GRASP_TOP_PERCENTILE = 80.0  # of the heights around a grasp: the top, were half of them beside the object
GRASP_REACH = 0.008  # metres around a grasp's cell in which the top is looked for

FINGERS_ALONG = 0.025  # metres, footprint of the closed fingers along a push
FINGERS_ACROSS = 0.045  # and across it
PALM_ALONG = 0.034  # metres, the hand itself, seen from above, along a push
PALM_ACROSS = 0.194  # and across it
PALM = 0.039  # metres by which its underside lies above the TCP
FINGERTIPS = 0.008  # metres by which the fingers reach below the TCP, which lies between their pads
PUSH_CLEARANCE = 0.003  # metres between the fingertips and what they stand above
RAISED_TIPS = 0.055  # metres above the table, fingertips of a raised push: over anything that the hand can take whole
TIPS_ABOVE = 0.004  # metres between a target and the fingertips of a raised push that takes away what lies on it
TOP_PERCENTILE = 90  # of the heights of a target's cells: those at its edges may be its neighbours'
PUSH_OVERLAP = 0.008  # metres by which something ahead must stand higher than the fingertips, to be pushed
# Points of a push's way, metres ahead of its start and beside its middle. At fewer than `POINTS_MET` it would meet
# something with its very end or a corner of the fingers alone, and move nothing.
WAY_AHEAD = (0.025, 0.05, 0.075, PUSH_LENGTH)
WAY_ASIDE = (-0.016, 0.0, 0.016)
POINTS_MET = 2
PUSH_NEARNESS = 0.03  # metres from the target within which a push for it has to pass
# Metres from the workspace's edge at which a push must end, and metres ahead of its end that must lie inside too: there
# is what it moves, and what leaves the workspace is lost.
PUSH_END_INSET = 0.03
PUSH_AHEAD = 0.07
# Metres from the workspace's edge that a pushed target has to keep: its middle is that of what shows of it.
TARGET_INSET = 0.015


def cell_position(row: float, column: float, workspace: Workspace) -> tuple[float, float]:
    """The (x, y) in the base frame, metres, of the middle of a cell of the action grid."""
    return action_grid(workspace).cell_center(row, column)


def grasp_height(maps: Heightmaps, row: int, column: int) -> float:
    """TCP height above the table, metres, of a grasp at a cell of the action grid.

    `GRASP_DEPTH` below the local top, so that the fingers reach down the object's sides, and not below
    `MIN_TCP_HEIGHT`.
    """
    factor = maps.workspace.cells // ACTION_CELLS
    reach = round(GRASP_REACH / maps.workspace.resolution) - factor // 2
    around = maps.height[
        max(0, row * factor - reach) : (row + 1) * factor + reach,
        max(0, column * factor - reach) : (column + 1) * factor + reach,
    ]
    top = float(np.percentile(around, GRASP_TOP_PERCENTILE))
    return max(top - GRASP_DEPTH, MIN_TCP_HEIGHT)


def tips_above(height: float) -> float:
    """Height above the table, metres, of the fingertips of a raised push for a target that is so high."""
    return min(RAISED_TIPS, height + TIPS_ABOVE)


def top_of(maps: Heightmaps, mask: NDArray[np.bool_]) -> float:
    """How far up above the table, metres, the object under a mask (N, N) reaches; the mask must not be empty."""
    return float(np.percentile(maps.height[mask], TOP_PERCENTILE))


def push_heights(maps: Heightmaps, raised_tips: float | NDArray[np.float32] = RAISED_TIPS) -> NDArray[np.float32]:
    """TCP height above the table, metres, of a push starting at every cell: (2, 16, 112, 112) float32, low and raised.

    The closed fingers come down just above whatever is under their footprint: beside a heap they reach the
    table, on top of it they push what stands higher. Raised, they take the roof off a heap and leave what it stands on,
    which a low push moves as a whole. `raised_tips`: metres above the table, their fingertips; of all, or of each,
    (16, 112, 112).
    """
    above = np.float32(PUSH_CLEARANCE + FINGERTIPS)
    under = _heights_under(_highest(maps), FINGERS_ALONG, FINGERS_ACROSS, maps.workspace)
    low = np.maximum(under + above, np.float32(MIN_TCP_HEIGHT))
    return np.stack([low, np.maximum(low, np.asarray(raised_tips, np.float32) + np.float32(FINGERTIPS))])


def feasible_pushes(maps: Heightmaps, heights: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Which pushes can be made and would move something: (2, 16, 112, 112) bool.

    `heights`: of `push_heights`. A push is left out where it would not end well inside the workspace
    (`ends_inside`), where it would start above `MAX_TCP_HEIGHT`, where the hand would come down on something before the
    fingers are where they should be, or where hardly anything along its way stands higher than the fingertips; a raised
    one also where the low one is as high.
    """
    highest = _highest(maps)
    met = _points_met(highest, heights - np.float32(FINGERTIPS - PUSH_OVERLAP), maps.workspace)
    moves = met >= POINTS_MET
    moves[RAISED] &= heights[RAISED] > heights[LOW]
    comes_down = heights >= _heights_under(highest, PALM_ALONG, PALM_ACROSS, maps.workspace) - np.float32(PALM)
    return open_pushes(maps.workspace, heights) & moves & comes_down


def _points_met(highest: NDArray[np.float32], limits: NDArray[np.float32], workspace: Workspace) -> NDArray[np.uint8]:
    """At how many points of their way pushes meet what stands higher than their `limits`, both (2, 16, 112, 112)."""
    met = np.zeros(limits.shape, np.uint8)
    cell = workspace.size / ACTION_CELLS
    for k, yaw in enumerate(ANGLES):
        for ahead, aside in product(WAY_AHEAD, WAY_ASIDE):
            rows = round(-(ahead * math.sin(yaw) + aside * math.cos(yaw)) / cell)
            columns = round((ahead * math.cos(yaw) - aside * math.sin(yaw)) / cell)
            here, there = _overlap(rows, columns)
            met[:, k, *here] += highest[there] > limits[:, k, *here]
    return met


def open_pushes(workspace: Workspace, heights: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Which pushes can be made, be it through thin air: (2, 16, 112, 112) bool. `heights`: of `push_heights`."""
    return ends_inside(workspace) & (heights <= np.float32(MAX_TCP_HEIGHT))


def pushes_towards(mask: NDArray[np.bool_], workspace: Workspace) -> NDArray[np.bool_]:
    """Which pushes come within `PUSH_NEARNESS` of the target under the mask, (N, N): (16, 112, 112) bool.

    Others leave the target and its border as they are, so what a critic says of them means nothing to it. Nor is a push
    towards it that only goes away from where it starts, unless it starts at the border.
    """
    cell = workspace.size / ACTION_CELLS
    distance = np.asarray(blocks(distance_to(mask)).min(axis=(1, 3)) * workspace.resolution, np.float32)
    nearest = np.stack([cv2.erode(distance, _way(k, cell)) for k in range(ROTATIONS)])
    return (nearest <= PUSH_NEARNESS) & ((nearest < distance) | (distance <= BORDER_WIDTH))


def pushes_for(
    pushes: NDArray[np.bool_],
    mask: NDArray[np.bool_],
    workspace: Workspace,
    places: Sequence[tuple[float, float]] | None = None,
) -> NDArray[np.bool_]:
    """Of pushes (..., 16, 112, 112) those towards a target under a mask, (N, N), that keep it inside the workspace.

    `places`: where its middle may be, (x, y) in the base frame, metres; None: in the middle of the mask.
    """
    middles = (workspace.middle_of(mask),) if places is None else places
    return keeping_inside(pushes & pushes_towards(mask, workspace), middles, workspace)


def keeping_inside(
    pushes: NDArray[np.bool_], places: Sequence[tuple[float, float]], workspace: Workspace
) -> NDArray[np.bool_]:
    """Of pushes (..., 16, 112, 112) towards a target those that cannot drive it out of the workspace, if there are any.

    `places`: where its middle may be, (x, y) in the base frame, metres. A push may take it along for all of its length.
    """
    stays = [
        all(
            workspace.contains(x + PUSH_LENGTH * math.cos(yaw), y + PUSH_LENGTH * math.sin(yaw), TARGET_INSET)
            for x, y in places
        )
        for yaw in ANGLES
    ]
    kept = pushes & np.array(stays)[:, None, None]
    return kept if kept.any() else pushes


@lru_cache(maxsize=ROTATIONS)
def _way(k: int, cell: float) -> NDArray[np.uint8]:
    """The cells that a push in rotation `k` passes from the middle of the kernel on."""
    reach = round(PUSH_LENGTH / cell)
    way = np.zeros((2 * reach + 1, 2 * reach + 1), np.uint8)
    tip = (round(reach + reach * math.cos(ANGLES[k])), round(reach - reach * math.sin(ANGLES[k])))
    return np.asarray(cv2.line(way, (reach, reach), tip, (1,)), np.uint8)


@lru_cache(maxsize=4)
def ends_inside(workspace: Workspace) -> NDArray[np.bool_]:
    """Which pushes end inside the workspace, and so does what they move: (16, 112, 112) bool.

    They end `PUSH_END_INSET` from its edge or farther, and `PUSH_AHEAD` before it as they go.
    """
    return _inside_after(PUSH_LENGTH, PUSH_END_INSET, workspace) & _inside_after(
        PUSH_LENGTH + PUSH_AHEAD, 0.0, workspace
    )


def _inside_after(distance: float, inset: float, workspace: Workspace) -> NDArray[np.bool_]:
    """Whether the point `distance` metres ahead of each cell lies `inset` metres inside the workspace's edge."""
    x, y = ahead_of_cells(distance, workspace)
    (low_x, low_y), (high_x, high_y) = workspace.low, workspace.high
    inset -= 1e-9
    inside = (x >= low_x + inset) & (x <= high_x - inset)
    return inside & (y >= low_y + inset) & (y <= high_y - inset)


def low_grasps(maps: Heightmaps, grasps: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Those of some grasps, (16, 112, 112) bool, whose TCP stays at or below `MAX_TCP_HEIGHT`."""
    tall = np.asarray(blocks(maps.height > MAX_TCP_HEIGHT + GRASP_DEPTH).any(axis=(1, 3)), np.uint8)
    if not tall.any():
        return grasps
    reach = math.ceil(GRASP_REACH / maps.workspace.size * ACTION_CELLS)
    near_tall = cv2.dilate(tall, np.ones((2 * reach + 1,) * 2, np.uint8)) > 0
    low = grasps.copy()
    for row, column in np.argwhere(near_tall & grasps.any(axis=0)):
        low[:, row, column] &= grasp_height(maps, row, column) <= MAX_TCP_HEIGHT
    return low


def _heights_under(
    highest: NDArray[np.float32], length: float, width: float, workspace: Workspace
) -> NDArray[np.float32]:
    """The greatest height under a rectangle, as `_rectangle` has it, at every cell, for every rotation: (16, 112, 112).

    `highest`: of `_highest`.
    """
    cell = workspace.size / ACTION_CELLS
    half_turn = [cv2.dilate(highest, _rectangle(k, cell, length, width)) for k in range(ROTATIONS // 2)]
    return np.stack(half_turn + half_turn).astype(np.float32)


def _highest(maps: Heightmaps) -> NDArray[np.float32]:
    """The greatest height within every cell of the action grid, (112, 112)."""
    # A single wild reading must not lift the fingers over what they are to push.
    calm = np.asarray(cv2.medianBlur(maps.height, 3), np.float32)
    return np.asarray(blocks(calm).max(axis=(1, 3)), np.float32)


@lru_cache(maxsize=2 * ROTATIONS)
def _rectangle(k: int, cell: float, length: float, width: float) -> NDArray[np.uint8]:
    """The cells under a rectangle of so many metres along and across a push in rotation `k`, a kernel of odd size."""
    reach = math.ceil(math.hypot(length, width) / 2 / cell)
    rows, columns = np.mgrid[-reach : reach + 1, -reach : reach + 1] * cell
    yaw = ANGLES[k]
    along = columns * math.cos(yaw) - rows * math.sin(yaw)
    across = columns * math.sin(yaw) + rows * math.cos(yaw)
    under = (np.abs(along) <= length / 2) & (np.abs(across) <= width / 2)
    return under.astype(np.uint8)


def _overlap(rows: int, columns: int) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
    """The cells that still have a cell `rows` down and `columns` to the right of them, and those cells."""
    size = ACTION_CELLS
    here = (slice(max(0, -rows), size - max(0, rows)), slice(max(0, -columns), size - max(0, columns)))
    there = (slice(max(0, rows), size - max(0, -rows)), slice(max(0, columns), size - max(0, -columns)))
    return here, there
