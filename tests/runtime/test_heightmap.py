import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from grasping_invisible.runtime.frame import Camera, RgbdFrame
from grasping_invisible.runtime.heightmap import project
from grasping_invisible.runtime.workspace import Workspace

WORKSPACE = Workspace()
INTRINSICS = np.array([[615.0, 0.0, 319.5], [0.0, 615.0, 239.5], [0.0, 0.0, 1.0]])


def camera_at(x: float, y: float, z: float) -> Camera:
    """A camera at a point of the base frame that looks at the middle of the workspace."""
    eye = np.array([x, y, z])
    forward = np.array(WORKSPACE.center) - eye
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.1, 1.0])
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([right, np.cross(forward, right), forward])
    pose[:3, 3] = eye
    return Camera(640, 480, INTRINSICS, pose)


def plane_depth(camera: Camera, z: float) -> np.ndarray:
    """Depth image of the endless plane at height `z`."""
    v, u = np.mgrid[: camera.height, : camera.width]
    optical = np.linalg.inv(camera.intrinsics) @ np.stack([u, v, np.ones_like(u)]).reshape(3, -1)
    falling = (camera.base_from_camera[:3, :3] @ optical)[2].reshape(u.shape)
    return ((z - camera.base_from_camera[2, 3]) / falling).astype(np.float32)


def frame_of(camera: Camera, depth: np.ndarray, color: np.ndarray | None = None) -> RgbdFrame:
    if color is None:
        color = np.full((camera.height, camera.width, 3), 90, np.uint8)
    return RgbdFrame(7, color, depth.astype(np.float32), camera)


def no_labels() -> np.ndarray:
    return np.zeros((480, 640), np.uint8)


@settings(deadline=None, max_examples=40)
@given(
    eye=st.tuples(st.floats(0.2, 1.2), st.floats(-0.5, 0.5), st.floats(0.5, 0.9)),
    points=st.lists(
        st.tuples(st.floats(0.33, 0.75), st.floats(-0.21, 0.21), st.floats(0.0, 0.12)), min_size=1, max_size=8
    ),
)
def test_known_points_land_in_their_cells(eye, points):
    camera = camera_at(*eye)
    depth, labels = np.zeros((480, 640)), no_labels()
    placed = {}
    for point in points:
        in_camera = np.linalg.inv(camera.base_from_camera) @ [*point, 1.0]
        u, v, _ = INTRINSICS @ in_camera[:3] / in_camera[2]
        column, row = round(u), round(v)
        if not (0 <= column < 640 and 0 <= row < 480):
            continue
        # The pixel's own ray, at this depth: up to half a pixel beside the point asked for.
        on_ray = in_camera[2] * np.linalg.inv(INTRINSICS) @ [column, row, 1.0]
        depth[row, column], labels[row, column] = in_camera[2], 3
        placed[row, column] = (camera.base_from_camera @ [*on_ray, 1.0])[:3]
    maps = project(frame_of(camera, depth), labels, WORKSPACE)
    for x, y, z in placed.values():
        row, column = WORKSPACE.cell_of(x, y)
        near = np.s_[max(0, row - 1) : row + 2, max(0, column - 1) : column + 2]
        assert (maps.labels[near] == 3).any()
        assert maps.height[near].max() >= z - 1e-4


def test_axes_row_zero_is_far_y_and_column_zero_is_near_x():
    camera = camera_at(0.53, 0.0, 0.8)
    depth, labels = plane_depth(camera, 0.0), no_labels()
    in_camera = np.linalg.inv(camera.base_from_camera) @ [0.6, 0.15, 0.0, 1.0]
    u, v, _ = INTRINSICS @ in_camera[:3] / in_camera[2]
    labels[round(v) - 2 : round(v) + 3, round(u) - 2 : round(u) + 3] = 5
    maps = project(frame_of(camera, depth), labels, WORKSPACE)
    rows, columns = np.nonzero(maps.labels == 5)
    assert abs(rows.mean() - (0.224 - 0.15) / 0.002) < 1.5
    assert abs(columns.mean() - (0.6 - 0.306) / 0.002) < 1.5


def test_the_highest_point_gives_height_color_and_label():
    camera = camera_at(0.53, 0.0, 0.8)
    depth, labels = plane_depth(camera, 0.0), no_labels()
    color = np.full((480, 640, 3), 90, np.uint8)
    raised = np.s_[220:260, 300:340]
    depth[raised] = plane_depth(camera, 0.05)[raised]
    color[raised], labels[raised] = (200, 10, 20), 1
    maps = project(frame_of(camera, depth, color), labels, WORKSPACE)
    block = maps.labels == 1
    assert block.sum() > 100
    np.testing.assert_allclose(maps.height[block], 0.05, atol=1e-4)
    assert (maps.color[block] == (200, 10, 20)).all()
    assert (maps.color[maps.height > 0.01] == (200, 10, 20)).all()


def test_too_high_and_unread_points_are_left_out_and_low_ones_lie_on_the_table():
    camera = camera_at(0.53, 0.0, 0.8)
    for z, depth in ((0.31, None), (0.0, np.zeros((480, 640))), (0.0, np.full((480, 640), np.nan))):
        maps = project(frame_of(camera, plane_depth(camera, z) if depth is None else depth), no_labels() + 1, WORKSPACE)
        assert not maps.labels.any()
        assert not maps.height.any()
    below = project(frame_of(camera, plane_depth(camera, -0.01)), no_labels() + 1, WORKSPACE)
    assert (below.labels == 1).mean() > 0.95
    assert not below.height.any()


def test_small_gaps_are_filled_and_large_ones_stay_unseen():
    camera = camera_at(0.53, 0.0, 0.45)  # so near that a cell holds several pixels
    depth = plane_depth(camera, 0.03)
    seen = project(frame_of(camera, depth), no_labels() + 2, WORKSPACE)
    middle = seen.labels[90:134, 90:134]
    assert (middle == 2).all()
    narrow, wide = depth.copy(), depth.copy()
    narrow[238:242, 200:440] = 0  # about one cell
    wide[220:260, 200:440] = 0  # about ten cells
    assert (project(frame_of(camera, narrow), no_labels() + 2, WORKSPACE).labels[90:134, 90:134] == 2).all()
    assert (project(frame_of(camera, wide), no_labels() + 2, WORKSPACE).labels[90:134, 90:134] == 0).any()


@pytest.mark.parametrize("turned", [(0.9, 0.0), (-0.9, 0.0), (0.0, 1.2), (0.0, -1.2)])
def test_a_camera_that_looks_elsewhere_sees_nothing(turned: tuple[float, float]) -> None:
    camera = camera_at(0.53, 0.0, 0.8)
    aside, over = turned
    pose = camera.base_from_camera.copy()
    pose[:3, 3] += aside * pose[:3, 0] + over * pose[:3, 1]
    elsewhere = Camera(camera.width, camera.height, camera.intrinsics, pose)
    maps = project(frame_of(elsewhere, plane_depth(elsewhere, 0.0)), np.ones((480, 640), np.uint8), WORKSPACE)
    assert not maps.labels.any()
    assert not maps.height.any()
