import pytest
from hypothesis import given
from hypothesis import strategies as st

from grasping_invisible.training.evaluation import TrialResult
from grasping_invisible.training.evaluation_summary import summarise, wilson


def result(scene: str, seed: int, success: bool, motions: int) -> TrialResult:
    return TrialResult(scene, seed, success, success, True, True, motions, (10.0,))


def test_rates_are_overall_and_of_each_scene():
    results = [result("a", 0, True, 2), result("a", 1, False, 5), result("b", 0, True, 2)]
    summary = summarise(results, "suite", "ours", 2, 0, "hash")
    assert summary.success_rate == pytest.approx(2 / 3)
    assert summary.motions_mean == 3.0
    assert summary.scenes["a"].success_rate == 0.5
    assert summary.scenes["b"].motions_std == 0.0


def test_wilson_of_a_textbook_case():
    low, high = wilson(81, 263)
    assert (low, high) == (pytest.approx(0.2553, abs=1e-4), pytest.approx(0.3662, abs=1e-4))


@given(st.integers(1, 500).flatmap(lambda runs: st.tuples(st.integers(0, runs), st.just(runs))))
def test_wilson_holds_the_rate_and_stays_a_rate(case):
    successes, runs = case
    low, high = wilson(successes, runs)
    assert 0.0 <= low <= successes / runs + 1e-12
    assert successes / runs - 1e-12 <= high <= 1.0
