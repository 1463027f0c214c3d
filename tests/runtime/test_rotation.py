import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from grasping_invisible.data.action_grid import ROTATIONS, rotation_angle
from grasping_invisible.runtime import rotation
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.workspace import Workspace

cells = st.integers(0, rotation.ACTION_CELLS - 1)


@settings(max_examples=60, deadline=None)
@given(row=cells, column=cells, k=st.integers(0, ROTATIONS - 1))
def test_a_rotated_cell_comes_back_to_its_own_place(row, column, k):
    rows, columns = rotation.rotated_cell(row, column, k)
    pixel = rotation.rotated_pixel(row, column, k)
    assert abs(pixel[0] - rows) <= 0.5 + 1e-9
    assert abs(pixel[1] - columns) <= 0.5 + 1e-9
    maps = np.zeros((ROTATIONS, rotation.ROTATED_CELLS, rotation.ROTATED_CELLS), np.float32)
    maps[k][pixel] = 1.0
    back = rotation.unrotate(maps)
    assert back[k, row, column] == 1.0
    hits = np.argwhere(back[k] > 0)
    assert np.abs(hits - (row, column)).max() <= 1


@settings(max_examples=40, deadline=None)
@given(row=st.integers(2, 109), column=st.integers(2, 109), k=st.integers(0, ROTATIONS - 1))
def test_planes_turn_the_way_rotated_cell_says(row, column, k):
    planes = np.zeros((rotation.ACTION_CELLS, rotation.ACTION_CELLS, rotation.PLANES), np.float32)
    planes[row - 1 : row + 2, column - 1 : column + 2, 3] = 1.0
    turned = rotation.rotate_planes(planes, [k])[0, 3]
    weights = turned / turned.sum()
    rows, columns = np.mgrid[: rotation.ROTATED_CELLS, : rotation.ROTATED_CELLS]
    center = (rows * weights).sum(), (columns * weights).sum()
    assert math.dist(center, rotation.rotated_cell(row, column, k)) < 0.25


@settings(max_examples=30, deadline=None)
@given(k=st.integers(0, ROTATIONS - 1), top=st.integers(0, 96), left=st.integers(0, 96), seed=st.integers(0, 9))
def test_a_window_is_cut_out_of_the_turned_planes(k, top, left, seed):
    planes = np.random.default_rng(seed).random((rotation.ACTION_CELLS, rotation.ACTION_CELLS, 2), np.float32)
    (turned,) = rotation.rotate_planes(planes, [k])
    window = rotation.rotated_window(planes, k, top, left, 64)
    # Bilinear weights come in steps of 1/32 of a cell, which two ways of computing a place may round differently.
    np.testing.assert_allclose(window, turned[:, top : top + 64, left : left + 64], atol=0.07)
    assert np.abs(window - turned[:, top : top + 64, left : left + 64]).mean() < 0.005


@pytest.mark.parametrize("k", range(ROTATIONS))
def test_an_action_points_to_the_right(k):
    yaw = rotation_angle(k)
    start = rotation.rotated_cell(60.0, 50.0, k)
    end = rotation.rotated_cell(60.0 - 10 * math.sin(yaw), 50.0 + 10 * math.cos(yaw), k)
    assert end == pytest.approx((start[0], start[1] + 10))


@pytest.mark.parametrize("k", range(ROTATIONS))
def test_there_and_back_keeps_smooth_maps(k):
    rows, columns = np.mgrid[: rotation.ACTION_CELLS, : rotation.ACTION_CELLS].astype(np.float32)
    smooth = np.sin(rows / 15) + np.cos(columns / 20)
    turned = rotation.rotate_planes(smooth[..., None])[:, 0]
    back = rotation.unrotate(turned)[k]
    assert np.abs(back - smooth)[2:-2, 2:-2].max() < 0.1


def test_all_of_the_grid_fits_into_every_rotation():
    ones = np.ones((rotation.ACTION_CELLS, rotation.ACTION_CELLS, 1), np.float32)
    turned = rotation.rotate_planes(ones)
    assert turned.sum(axis=(1, 2, 3)) == pytest.approx(rotation.ACTION_CELLS**2, rel=2e-3)
    assert turned.flags.c_contiguous


def test_a_subset_of_rotations_is_the_same_as_all():
    planes = np.random.default_rng(0).random((112, 112, 5), np.float32)
    np.testing.assert_array_equal(rotation.rotate_planes(planes, [9, 3]), rotation.rotate_planes(planes)[[9, 3]])


def test_planes_are_normalised():
    height = np.zeros((224, 224), np.float32)
    height[100:102, 50:52] = 0.05  # one cell of the action grid
    height[0, 0] = 0.1  # a quarter of one
    color = np.full((224, 224, 3), 255, np.uint8)
    maps = Heightmaps(0, color, height, np.zeros((224, 224), np.uint8), Workspace())
    mask = height == np.float32(0.05)
    planes = rotation.critic_planes(maps, mask)
    assert planes.shape == (112, 112, 5)
    assert planes.dtype == np.float32
    np.testing.assert_allclose(planes[..., :3], 1.0, atol=1e-6)
    np.testing.assert_allclose(planes[50, 25], [1, 1, 1, 0.5, 1], atol=1e-6)
    assert planes[0, 0, 3] == pytest.approx(0.25)
    assert planes[..., 4].sum() == pytest.approx(1.0)


def test_action_grid_covers_the_same_square():
    grid = rotation.action_grid(Workspace())
    assert grid.cells == rotation.ACTION_CELLS
    assert (grid.low, grid.high) == (Workspace().low, Workspace().high)
