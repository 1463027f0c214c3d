import numpy as np
import pytest

from grasping_invisible.data.action_grid import LOW, RAISED
from grasping_invisible.runtime.choice import Choice, best_action, best_value

SHAPE = (16, 112, 112)


@pytest.fixture
def values() -> np.ndarray:
    values = np.zeros(SHAPE, np.float32)
    values[3, 10, 20] = 0.75
    values[7, 30, 40] = 0.5
    return values


def test_the_greatest_allowed_value_wins(values):
    allowed = np.ones(SHAPE, bool)
    assert best_action(values, allowed, np.random.default_rng(0)) == Choice(3, 10, 20, 0.75)
    allowed[3] = False
    assert best_action(values, allowed, np.random.default_rng(0)) == Choice(7, 30, 40, 0.5)


def test_a_push_is_chosen_with_its_height(values):
    allowed = np.ones((2, *SHAPE), bool)
    pushes = np.stack([values, 2 * values])
    choice = best_action(pushes, allowed, np.random.default_rng(0))
    assert choice == Choice(3, 10, 20, 1.5, RAISED)
    assert choice is not None
    assert (choice.of(pushes), choice.of(values)) == (1.5, 0.75)
    # What is the same for both heights is drawn from.
    drawn = [best_action(values, allowed, np.random.default_rng(seed)) for seed in range(20)]
    assert {choice.level for choice in drawn if choice} == {LOW, RAISED}


def test_negative_values_can_win(values):
    assert best_value(values - 5, np.ones(SHAPE, bool)) == -4.25


def test_nothing_allowed(values):
    none = np.zeros(SHAPE, bool)
    assert best_action(values, none, np.random.default_rng(0)) is None
    assert best_value(values, none) is None


def test_ties_are_drawn_from_the_seed():
    flat, allowed = np.ones(SHAPE, np.float32), np.ones(SHAPE, bool)
    choices = [best_action(flat, allowed, np.random.default_rng(seed)) for seed in (1, 1, 2)]
    assert choices[0] == choices[1] != choices[2]
