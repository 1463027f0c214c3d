"""From an RGB-D image to heightmaps: the workspace seen from straight above (paper, section IV-A)."""

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from grasping_invisible.runtime.frame import Camera, RgbdFrame
from grasping_invisible.runtime.workspace import Workspace

MAX_HEIGHT = 0.3  # metres above the table; points higher than this are no part of the clutter
HIGHEST_PERCENTILE = 90.0  # of the heights of some points: how far up they reach


@dataclass(frozen=True)
class Heightmaps:
    """The workspace from above, N = `workspace.cells`; row 0 at the largest y, column 0 at the smallest x.

    `color`: (N, N, 3) uint8 RGB. `height`: (N, N) float32, metres above the table top. `labels`: (N, N) uint8
    class index. A cell that the camera does not see is 0 in all three. `stamp_ns`: of the camera frame.
    """

    stamp_ns: int
    color: NDArray[np.uint8]
    height: NDArray[np.float32]
    labels: NDArray[np.uint8]
    workspace: Workspace


def project(frame: RgbdFrame, labels: NDArray[np.uint8], workspace: Workspace) -> Heightmaps:
    """Look at the workspace along gravity: each cell takes the highest point that fell into it.

    Height, colour and label of a cell come from that one point. `labels`: (height, width) uint8 class index
    of every camera pixel. Points below the table count as lying on it; points more than `MAX_HEIGHT` above it
    are left out. Gaps between samples at most two cells wide take over the nearest seen cell; wider ones stay
    unseen.
    """
    cells = workspace.cells
    rays = _rays_of(frame.camera, workspace)
    rows, columns, heights, inside = _points(frame, rays, workspace)
    pixels = np.flatnonzero(inside & (heights <= MAX_HEIGHT))

    cell = rows.ravel()[pixels].astype(np.int64) * cells + columns.ravel()[pixels].astype(np.int64)
    height = np.maximum(heights.ravel()[pixels], 0.0)
    # Non-negative floats sort like their bits: one integer maximum finds each cell's height and the pixel it
    # is from.
    ranked = (height.view(np.int32).astype(np.int64) << 32) | pixels
    highest = np.full(cells * cells, -1, np.int64)
    np.maximum.at(highest, cell, ranked)

    seen = highest >= 0
    source = _source_cells(seen.reshape(cells, cells))
    winner = highest[source]
    known = winner >= 0
    pixel = np.where(known, winner & 0xFFFFFFFF, 0)
    top = (winner >> 32).astype(np.int32).view(np.float32)
    color = frame.color[rays.window].reshape(-1, 3)[pixel]
    label = labels[rays.window].reshape(-1)[pixel]
    return Heightmaps(
        stamp_ns=frame.stamp_ns,
        color=np.where(known[:, None], color, 0).astype(np.uint8).reshape(cells, cells, 3),
        height=np.where(known, top, 0.0).astype(np.float32).reshape(cells, cells),
        labels=np.where(known, label, 0).astype(np.uint8).reshape(cells, cells),
        workspace=workspace,
    )


@dataclass(frozen=True)
class ShownPoints:
    """What some camera pixels show in the workspace; unlike in heightmaps, points count that lie under something else.

    `over`: how many of them lie over each heightmap cell, (N, N). `height`: how far up above the table they reach,
    metres, 0 where there are none; a tenth of them may be higher, as depth images waver at edges.
    """

    over: NDArray[np.intp]
    height: float


def shown_points(frame: RgbdFrame, pixels: NDArray[np.bool_], workspace: Workspace) -> ShownPoints:
    """The points of some camera pixels, (height, width) bool."""
    rays = _rays_of(frame.camera, workspace)
    rows, columns, heights, inside = _points(frame, rays, workspace)
    shown = inside & (heights <= MAX_HEIGHT) & pixels[rays.window]
    flat = rows[shown].astype(np.intp) * workspace.cells + columns[shown].astype(np.intp)
    over = np.bincount(flat, minlength=workspace.cells**2).reshape(workspace.cells, workspace.cells)
    highest = float(np.percentile(heights[shown], HIGHEST_PERCENTILE)) if shown.any() else 0.0
    return ShownPoints(over, max(highest, 0.0))


def points_in(
    frame: RgbdFrame, workspace: Workspace, step: int
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Row and column in the heightmap, fractional, and height above the table, metres, of points over the workspace.

    Of every pixel in `step` along rows and columns; (P,) each. Points below the table have a negative height, and
    unlike in heightmaps none are left out for being too high.
    """
    rows, columns, heights, inside = _points(frame, _rays_of(frame.camera, workspace), workspace, step)
    return rows[inside], columns[inside], heights[inside]


@dataclass(frozen=True)
class _Rays:
    """What one metre of depth adds, per pixel of the image window that can see the workspace.

    In fractional rows and columns of the heightmap and in metres of height, from the camera's own position.
    """

    window: tuple[slice, slice]
    row: NDArray[np.float32]
    column: NDArray[np.float32]
    height: NDArray[np.float32]
    origin_row: np.float32
    origin_column: np.float32
    origin_height: np.float32


def _points(
    frame: RgbdFrame, rays: _Rays, workspace: Workspace, step: int = 1
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_]]:
    """Of the window's pixels: row and column, fractional; height, metres; whether it is measured over the workspace."""
    sampled = np.s_[::step, ::step]
    cells, depth = workspace.cells, frame.depth[rays.window][sampled]
    rows = depth * rays.row[sampled] + rays.origin_row
    columns = depth * rays.column[sampled] + rays.origin_column
    heights = depth * rays.height[sampled] + rays.origin_height
    inside = (rows >= 0) & (rows < cells) & (columns >= 0) & (columns < cells)
    return rows, columns, heights, inside & (depth > 0)


def _rays_of(camera: Camera, workspace: Workspace) -> _Rays:
    return _rays(
        camera.width,
        camera.height,
        camera.intrinsics.astype(np.float64).tobytes(),
        camera.base_from_camera.astype(np.float64).tobytes(),
        workspace,
    )


@lru_cache(maxsize=4)
def _rays(width: int, height: int, intrinsics: bytes, base_from_camera: bytes, workspace: Workspace) -> _Rays:
    """The rays of a camera over a workspace; a camera stands still, so they are worked out once."""
    camera = Camera(
        width,
        height,
        np.frombuffer(intrinsics, np.float64).reshape(3, 3),
        np.frombuffer(base_from_camera, np.float64).reshape(4, 4),
    )
    window = _window(camera, workspace)
    v, u = np.mgrid[window]
    optical = np.stack([u, v, np.ones_like(u)]).reshape(3, -1)
    directions = camera.base_from_camera[:3, :3] @ np.linalg.inv(camera.intrinsics) @ optical
    dx, dy, dz = directions.reshape(3, *u.shape)
    x, y, z = camera.base_from_camera[:3, 3]
    resolution = workspace.resolution
    return _Rays(
        window=window,
        row=(-dy / resolution).astype(np.float32),
        column=(dx / resolution).astype(np.float32),
        height=dz.astype(np.float32),
        origin_row=np.float32((workspace.high[1] - y) / resolution),
        origin_column=np.float32((x - workspace.low[0]) / resolution),
        origin_height=np.float32(z - workspace.center[2]),
    )


def _window(camera: Camera, workspace: Workspace) -> tuple[slice, slice]:
    """The part of the image that can show the box over the workspace; all of it where that is behind or out of view."""
    (low_x, low_y), (high_x, high_y) = workspace.low, workspace.high
    table = workspace.center[2]
    corners = np.array(
        [(x, y, z, 1.0) for x in (low_x, high_x) for y in (low_y, high_y) for z in (table - 0.02, table + MAX_HEIGHT)]
    )
    in_camera = (np.linalg.inv(camera.base_from_camera) @ corners.T)[:3]
    everything = slice(0, camera.height), slice(0, camera.width)
    if (in_camera[2] <= 0.01).any():
        return everything
    u, v, _ = camera.intrinsics @ (in_camera / in_camera[2])
    top, bottom = max(0, int(v.min()) - 1), min(camera.height, int(v.max()) + 2)
    left, right = max(0, int(u.min()) - 1), min(camera.width, int(u.max()) + 2)
    return (slice(top, bottom), slice(left, right)) if top < bottom and left < right else everything


def _source_cells(seen: NDArray[np.bool_]) -> NDArray[np.intp]:
    """For each cell, flattened, the cell whose values it takes: itself, or in a small gap the nearest."""
    source = np.arange(seen.size)
    closed = cv2.morphologyEx(
        seen.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8), borderType=cv2.BORDER_REPLICATE
    )
    gaps = (closed > 0) & ~seen
    if not gaps.any():
        return source
    _, labels = cv2.distanceTransformWithLabels(
        (~seen).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    nearest = np.asarray(labels, np.intp)
    cell_of_label = np.zeros(nearest.max() + 1, np.intp)
    cell_of_label[nearest[seen]] = np.flatnonzero(seen)
    source[gaps.ravel()] = cell_of_label[nearest[gaps]]
    return source
