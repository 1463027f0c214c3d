from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.target_border import TargetBorder
from grasping_invisible.runtime.border_heuristic import border_heuristic, drawn_kind, pushing_rate

RED = (0.53, 0.0, 0.05, 0.05, "red")
WALL = (0.585, 0.0, 0.05, 0.05, "grey")
FREE = TargetBorder(0, 100, 50)
shares = st.floats(0, 1)


def test_the_rate_is_the_papers() -> None:
    border = TargetBorder(occupied=2, border=100, target=50)  # r_b 0.02, n_b 0.04
    assert pushing_rate(0.2, 0.8, border, 0) == pytest.approx(0.5 - 0.01 * 0.6 / 0.06)
    assert pushing_rate(0.2, 0.8, border, 1) == pytest.approx(0.5 - 0.01 * 0.6 / (2 * 0.06))
    assert pushing_rate(0.0, 1.0, TargetBorder(1, 1000, 1000), 0) == 0.0  # kept within 0 and 1
    assert pushing_rate(1.0, 0.0, TargetBorder(1, 1000, 1000), 0) == 1.0


def test_with_a_free_border_the_greater_value_decides() -> None:
    assert [pushing_rate(p, g, FREE, 0) for p, g in ((0.2, 0.8), (0.8, 0.2), (0.5, 0.5))] == [0.0, 1.0, 0.5]


@given(shares, shares, st.integers(0, 100), st.integers(0, 5))
def test_more_clutter_and_more_failures_bring_the_rate_nearer_to_even(q_push, q_grasp, occupied, failures) -> None:
    off = [abs(pushing_rate(q_push, q_grasp, TargetBorder(n, 200, 100), failures) - 0.5) for n in (occupied, 100)]
    assert off[1] <= off[0] + 1e-12
    more = abs(pushing_rate(q_push, q_grasp, TargetBorder(occupied, 200, 100), failures + 1) - 0.5)
    assert more <= off[0] + 1e-12


def drawn(rate: float, ratio: float, failures: int) -> Counter:
    rng = np.random.default_rng(0)
    return Counter(drawn_kind(rate, ratio, failures, rng) for _ in range(2000))


def test_failed_grasps_bring_pushes() -> None:
    assert drawn(0.0, 0.9, 0) == {gi.GRASP: 2000}
    assert drawn(1.0, 0.0, 0) == {gi.PUSH: 2000}
    assert drawn(0.0, 0.3, 1)[gi.PUSH] == pytest.approx(600, abs=80)
    assert drawn(0.5, 0.3, 1)[gi.PUSH] == pytest.approx(2000 * (0.5 + 0.5 * 0.3), abs=80)
    assert drawn(0.0, 0.0, 2) == {gi.PUSH: 2000}


def test_the_critic_chooses_the_motion_of_the_drawn_kind(situation, set_models) -> None:
    kinds = Counter()
    for seed in range(40):
        asked = situation(RED, WALL, seed=seed)
        proposal = border_heuristic(asked)
        assert proposal == border_heuristic(situation(RED, WALL, seed=seed))  # the seed draws, nothing else
        assert proposal is not None
        assert (set_models.masks[-1] == asked.perception.mask).all()
        kinds[proposal.kind] += 1
    assert kinds[gi.PUSH] > 5
    assert kinds[gi.GRASP] > 5
    assert not set_models.features  # the classifier is not asked
