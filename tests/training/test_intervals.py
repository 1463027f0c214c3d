import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from grasping_invisible.training.intervals import mean_interval, paired_difference, wilson

counts = st.tuples(*[st.integers(0, 60)] * 4).filter(lambda four: sum(four) > 0)


def test_wilson_of_a_textbook_case():
    assert wilson(81, 263) == (pytest.approx(0.2553, abs=1e-4), pytest.approx(0.3662, abs=1e-4))


@given(st.integers(1, 500).flatmap(lambda runs: st.tuples(st.integers(0, runs), st.just(runs))))
def test_wilson_holds_the_rate_and_stays_a_rate(case):
    successes, runs = case
    low, high = wilson(successes, runs)
    assert 0.0 <= low <= successes / runs + 1e-12
    assert successes / runs - 1e-12 <= high <= 1.0


def test_the_paired_difference_of_newcombes_own_example():
    # Newcombe 1998, table III: 20, 12, 2, 16.
    assert paired_difference(20, 2, 12, 16) == (pytest.approx(0.0562, abs=1e-4), pytest.approx(0.3292, abs=1e-4))


@given(counts)
def test_a_paired_difference_holds_its_estimate_and_turns_with_its_sides(four):
    both, first, second, neither = four
    low, high = paired_difference(both, first, second, neither)
    estimate = (second - first) / sum(four)
    assert -1.0 <= low <= estimate + 1e-9
    assert estimate - 1e-9 <= high <= 1.0
    assert paired_difference(both, second, first, neither) == (pytest.approx(-high), pytest.approx(-low))


def test_runs_that_agree_tell_more_than_runs_that_do_not():
    agreeing, mixed = paired_difference(40, 0, 10, 50), paired_difference(25, 15, 25, 35)
    assert mixed[1] - mixed[0] > agreeing[1] - agreeing[0]


def test_a_mean_has_the_interval_of_its_spread():
    values = np.random.default_rng(5).normal(3.0, 1.0, 400)
    low, high = mean_interval(values.tolist())
    assert low < values.mean() < high
    assert high - low == pytest.approx(2 * 1.96 / 20, rel=0.15)
    assert mean_interval([2.0, 2.0]) == (2.0, 2.0)
    assert mean_interval(values.tolist()) == (low, high)
