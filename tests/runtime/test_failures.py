import numpy as np
import pytest

from grasping_invisible.runtime.failures import DEVIATION, SCALE, acts_at, failure_likelihood
from grasping_invisible.runtime.motion import cell_position
from grasping_invisible.runtime.workspace import Workspace

WORKSPACE = Workspace()
CELL = (40, 70)
START = cell_position(*CELL, WORKSPACE)
PLACE = acts_at(*START, 0.0)  # of a push along x from there


def test_a_push_acts_half_of_its_way_ahead():
    assert acts_at(0.5, 0.0, 0.0) == pytest.approx((0.55, 0.0))
    assert acts_at(0.5, 0.0, np.pi / 2) == pytest.approx((0.5, 0.05))


def test_nothing_failed():
    assert (failure_likelihood((), WORKSPACE) == 1.0).all()


def test_a_single_failure_counts_most_for_pushes_that_act_where_it_did():
    likelihood = failure_likelihood((PLACE,), WORKSPACE)
    assert np.unravel_index(likelihood[0].argmin(), likelihood[0].shape) == CELL
    assert likelihood[0][CELL] == pytest.approx(SCALE)
    cells = 8
    beside = 1 - (1 - SCALE) * np.exp(-((cells * 0.004 / DEVIATION) ** 2) / 2)
    assert likelihood[0, CELL[0] + cells, CELL[1]] == pytest.approx(beside, abs=1e-5)
    assert likelihood[0, CELL[0], CELL[1] - cells] == pytest.approx(beside, abs=1e-5)
    assert likelihood[0, 111, 0] > 0.99


def test_a_push_from_the_other_side_counts_as_near_and_one_from_there_the_other_way_does_not():
    likelihood = failure_likelihood((PLACE,), WORKSPACE)
    beyond = CELL[0], CELL[1] + 25  # 0.10 m
    assert likelihood[8][beyond] == pytest.approx(SCALE, abs=1e-5)
    assert likelihood[0][beyond] > 0.99
    assert likelihood[8][CELL] > 0.99


def test_failures_multiply():
    assert failure_likelihood((PLACE,) * 3, WORKSPACE)[0][CELL] == pytest.approx(SCALE**3)


def test_only_the_three_most_recent_count():
    far = (0.3, -0.2)
    recent = failure_likelihood((far, far, far), WORKSPACE)
    np.testing.assert_array_equal(failure_likelihood((PLACE, far, far, far), WORKSPACE), recent)
