import math

import numpy as np
import pytest

from grasping_invisible.data.action_grid import blocks, feasible_grasps, heightmap_cell, rotation_angle


def test_cells_of_the_action_grid_have_their_middle_between_heightmap_cells() -> None:
    assert heightmap_cell(0, 111, 224) == (0.5, 222.5)


def test_directions_go_round_once() -> None:
    assert rotation_angle(0) == 0
    assert rotation_angle(4) == pytest.approx(math.pi / 2)
    assert rotation_angle(16) == pytest.approx(2 * math.pi)


def test_grasps_are_aimed_at_the_target_or_just_beside_it() -> None:
    """A target 40 mm wide: 6 mm beside it is still at it, 14 mm is not."""
    mask = np.zeros((224, 224), np.bool_)
    mask[102:122, 102:122] = True
    feasible = feasible_grasps(mask, 0.002)
    assert feasible.shape == (16, 112, 112)
    assert feasible[:, 56, 56].all()
    assert feasible[:, 56, 49].all()
    assert not feasible[:, 56, 45].any()
    assert not feasible_grasps(np.zeros_like(mask), 0.002).any()


def test_blocks_are_the_heightmap_cells_of_each_action_cell() -> None:
    values = np.arange(224 * 224).reshape(224, 224)
    assert blocks(values)[3, :, 5, :].tolist() == values[6:8, 10:12].tolist()
