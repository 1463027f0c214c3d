import numpy as np
import pytest

from grasping_invisible.data.target_border import TargetBorder, border_mask, target_border


@pytest.fixture
def mask() -> np.ndarray:
    mask = np.zeros((224, 224), bool)
    mask[100:120, 100:120] = True  # a 40 mm square
    return mask


def test_the_border_is_a_ring_of_its_width(mask):
    ring = border_mask(mask)
    assert not (ring & mask).any()
    along_a_row = np.flatnonzero(ring[110])
    # One cell of guard, then cells up to 10 away, on both sides.
    np.testing.assert_array_equal(along_a_row, [*range(90, 99), *range(121, 130)])


def test_an_isolated_target_has_a_free_border(mask):
    height = np.where(mask, 0.04, 0.0).astype(np.float32)
    border = target_border(height, mask)
    assert border.occupied == 0
    assert border.ratio == border.norm == 0.0
    assert border.target == 400


def test_a_neighbour_on_one_side_is_counted(mask):
    height = np.where(mask, 0.04, 0.0).astype(np.float32)
    height[100:120, 121:140] = 0.03
    border = target_border(height, mask)
    assert border.occupied == 20 * 9
    assert border.ratio == pytest.approx(180 / border.border)
    assert border.norm == pytest.approx(180 / 400)


def test_noise_on_the_table_is_free(mask):
    height = np.full((224, 224), 0.007, np.float32)
    assert target_border(height, mask).occupied == 0


def test_the_border_ends_at_the_edge_of_the_workspace():
    mask = np.zeros((224, 224), bool)
    mask[0:20, 0:20] = True
    height = np.full((224, 224), 0.05, np.float32)
    assert target_border(height, mask).ratio == 1.0


def test_the_width_is_in_metres(mask):
    assert np.flatnonzero(border_mask(mask, resolution=0.004)[110]).tolist() == [
        *range(95, 100),
        *range(120, 125),
    ]


def test_no_target_no_border():
    height = np.full((224, 224), 0.05, np.float32)
    border = target_border(height, np.zeros((224, 224), bool))
    assert border == TargetBorder(0, 0, 0)
    assert (border.ratio, border.norm) == (0.0, 0.0)
