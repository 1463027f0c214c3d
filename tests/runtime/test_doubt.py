import math

import numpy as np
import pytest

from grasping_invisible.data.action_grid import LOW, RAISED
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.doubt import LOG_ODDS, OTHER_LEVEL, doubted
from grasping_invisible.runtime.memory import FruitlessAction
from grasping_invisible.runtime.motion import cell_position
from grasping_invisible.runtime.workspace import Workspace

WORKSPACE = Workspace()
CELL = (40, 70)
IN_VAIN = FruitlessAction(gi.PUSH, *cell_position(*CELL, WORKSPACE), 0.0, LOW, unchanged=True)
EVEN = np.full((2, 16, 112, 112), 0.5, np.float32)


def log_odds(q: np.ndarray) -> np.ndarray:
    return np.log(q / (1 - q))


def test_without_such_pushes_values_stay_as_they_are():
    changed = FruitlessAction(gi.PUSH, IN_VAIN.x, IN_VAIN.y, 0.0)
    grasp = FruitlessAction(gi.GRASP, IN_VAIN.x, IN_VAIN.y, 0.0, unchanged=True)
    assert doubted(EVEN, (), WORKSPACE) is EVEN
    assert doubted(EVEN, (changed, grasp), WORKSPACE) is EVEN


def test_the_push_itself_is_doubted_most_and_those_far_away_not_at_all():
    left = log_odds(doubted(EVEN, (IN_VAIN,), WORKSPACE))
    assert left[LOW, 0][CELL] == pytest.approx(LOG_ODDS, abs=1e-3)
    assert left[LOW, 0][CELL] == left.min()
    assert left[RAISED, 0][CELL] == pytest.approx(LOG_ODDS * OTHER_LEVEL, abs=1e-3)
    beside = left[LOW, 0, CELL[0] + 12, CELL[1]]  # 48 mm
    assert LOG_ODDS < beside < LOG_ODDS / 2
    turned = left[LOW, 2, CELL[0], CELL[1]]
    assert LOG_ODDS < turned < 0
    assert left[LOW, 8, CELL[0], CELL[1] + 25] == pytest.approx(0, abs=1e-3)  # from the other side
    assert left[LOW, 0, 111, 0] == pytest.approx(0, abs=1e-3)


def test_each_push_adds_to_the_doubt():
    again = log_odds(doubted(EVEN, (IN_VAIN,) * 3, WORKSPACE))
    assert again[LOW, 0][CELL] == pytest.approx(3 * LOG_ODDS, abs=1e-3)


def test_certain_values_stay_probabilities():
    values = np.linspace(0, 1, EVEN.size, dtype=np.float32).reshape(EVEN.shape)
    left = doubted(values, (IN_VAIN,), WORKSPACE)
    assert left.min() == 0
    assert left.max() == 1
    assert np.isfinite(left).all()


def test_yaw_wraps_around():
    behind = FruitlessAction(gi.PUSH, IN_VAIN.x, IN_VAIN.y, -math.pi, LOW, unchanged=True)
    other = FruitlessAction(gi.PUSH, IN_VAIN.x, IN_VAIN.y, math.pi, LOW, unchanged=True)
    np.testing.assert_allclose(doubted(EVEN, (behind,), WORKSPACE), doubted(EVEN, (other,), WORKSPACE), atol=1e-6)
