import numpy as np
import pytest

from grasping_invisible.data.action_grid import ROTATIONS, rotation_angle
from grasping_invisible.runtime.clutter import clutter_prior
from grasping_invisible.runtime.motion import cell_position
from grasping_invisible.runtime.rotation import action_grid
from grasping_invisible.runtime.workspace import Workspace


def prior_at(prior, k, x, y):
    row, column = action_grid(Workspace()).cell_of(x, y)
    return prior[k, row, column]


@pytest.mark.parametrize("k", range(ROTATIONS))
def test_pushes_towards_a_block_are_favoured_and_pushes_away_from_it_are_not(table_with, k):
    prior = clutter_prior(table_with((0.5, 0.0, 0.06, 0.05, "grey")))
    yaw = rotation_angle(k)
    toward = prior_at(prior, k, 0.5 - 0.055 * np.cos(yaw), -0.055 * np.sin(yaw))
    away = prior_at(prior, k, 0.5 + 0.055 * np.cos(yaw), 0.055 * np.sin(yaw))
    assert toward > 0.4
    assert away < 0.1


def test_a_step_edge_along_x(table_with):
    maps = table_with()
    maps.height[:, 112:] = 0.04  # the half at larger x is a plateau
    prior = clutter_prior(maps)
    row, edge = 56, 56
    # 50 mm before the edge up to it the plateau lies ahead; the box is 13 cells wide.
    assert prior[0, row, edge - 7] == pytest.approx(1.0, abs=0.1)
    assert prior[0, row, edge - 26] == 0.0
    assert prior[0, row, edge + 10] == 0.0
    assert prior[8, :, : edge + 2].max() == 0.0  # nothing rises towards -x
    assert prior[4, 20:90, 10:100].max() == 0.0  # nor across


def test_it_is_a_share(table_with):
    maps = table_with()
    maps.height[:] = np.random.default_rng(0).random(maps.height.shape) * 0.2
    prior = clutter_prior(maps)
    assert prior.shape == (ROTATIONS, 112, 112)
    assert prior.min() >= 0.0
    assert 0.0 < prior.max() <= 1.0


def test_flat_ground_and_low_steps_are_no_edge(table_with):
    assert clutter_prior(table_with()).max() == 0.0
    assert clutter_prior(table_with((0.5, 0.0, 0.1, 0.015, "grey"))).max() == 0.0


def test_the_grid_is_the_action_grid(table_with):
    prior = clutter_prior(table_with((0.6, 0.1, 0.06, 0.05, "grey")))
    row, column = np.unravel_index(prior[0].argmax(), prior[0].shape)
    x, y = cell_position(float(row), float(column), Workspace())
    assert x < 0.58
    assert abs(y - 0.1) < 0.03
