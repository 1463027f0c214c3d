import numpy as np
import pytest

from grasping_invisible.runtime.failures import failure_likelihood
from grasping_invisible.runtime.motion import cell_position
from grasping_invisible.runtime.workspace import Workspace

WORKSPACE = Workspace()
CELL = (40, 70)
PLACE = cell_position(*CELL, WORKSPACE)


def test_nothing_failed():
    assert (failure_likelihood((), WORKSPACE) == 1.0).all()


def test_a_single_failure_is_three_quarters_at_its_place():
    likelihood = failure_likelihood((PLACE,), WORKSPACE)
    assert np.unravel_index(likelihood.argmin(), likelihood.shape) == CELL
    assert likelihood[CELL] == pytest.approx(0.75)
    # 0.10 m, one standard deviation, away: 25 cells.
    one_deviation = 1 - 0.25 * np.exp(-0.5)
    assert likelihood[CELL[0] + 25, CELL[1]] == pytest.approx(one_deviation, abs=1e-5)
    assert likelihood[CELL[0], CELL[1] - 25] == pytest.approx(one_deviation, abs=1e-5)
    assert likelihood[111, 0] > 0.99


def test_failures_multiply():
    assert failure_likelihood((PLACE,) * 3, WORKSPACE)[CELL] == pytest.approx(0.75**3)


def test_only_the_three_most_recent_count():
    far = (0.3, -0.2)
    recent = failure_likelihood((far, far, far), WORKSPACE)
    np.testing.assert_array_equal(failure_likelihood((PLACE, far, far, far), WORKSPACE), recent)
