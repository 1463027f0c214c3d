from dataclasses import replace

import numpy as np
import pytest

from grasping_invisible.data.action_grid import RAISED
from grasping_invisible.runtime.explorer import best_push, explore
from grasping_invisible.runtime.explorer_maps import FACTORS, exploration_maps
from grasping_invisible.runtime.memory import Memory
from grasping_invisible.runtime.motion import FINGERTIPS, TIPS_ABOVE, cell_position, pushes_towards
from grasping_invisible.runtime.situation import situation_of

SHAPE = (16, 112, 112)
ANY = np.ones(SHAPE, bool)


def rng():
    return np.random.default_rng(0)


@pytest.fixture
def two_heaps(table_with):
    """Two equal heaps, 0.24 m apart."""
    return table_with((0.38, 0.0, 0.06, 0.05, "grey"), (0.62, 0.0, 0.06, 0.05, "grey"))


def test_the_posterior_is_the_product_of_its_factors(two_heaps):
    q_push = np.random.default_rng(1).uniform(-1, 1, SHAPE).astype(np.float32)
    maps = exploration_maps(two_heaps, q_push, ((0.4, 0.0),))
    np.testing.assert_array_equal(maps.agnostic, np.maximum(q_push, 0))
    np.testing.assert_allclose(maps.posterior, maps.failure * maps.clutter * maps.agnostic, rtol=1e-6)
    assert maps.posterior.min() >= 0


@pytest.mark.parametrize(
    ("method", "factors"),
    [
        ("clutter-prior", ["clutter"]),
        ("agnostic-push", ["agnostic"]),
        ("clutter+agnostic", ["clutter", "agnostic"]),
    ],
)
def test_ablations_leave_factors_out(two_heaps, method, factors):
    assert method in FACTORS
    q_push = np.random.default_rng(1).random(SHAPE, np.float32)
    maps = exploration_maps(two_heaps, q_push, ((0.4, 0.0),), method)
    expected = np.prod([getattr(maps, name) for name in factors], axis=0)
    np.testing.assert_allclose(maps.posterior, expected, rtol=1e-6)


def test_it_avoids_the_place_where_it_failed(two_heaps):
    q_push = np.ones(SHAPE, np.float32)
    first, _ = best_push(exploration_maps(two_heaps, q_push, ()), ANY, rng())
    failed = cell_position(first.row, first.column, two_heaps.workspace)
    second, _ = best_push(exploration_maps(two_heaps, q_push, (failed,)), ANY, rng())
    x, y = cell_position(second.row, second.column, two_heaps.workspace)
    assert np.hypot(x - failed[0], y - failed[1]) > 0.1


def test_only_allowed_pushes_are_chosen(two_heaps):
    maps = exploration_maps(two_heaps, np.ones(SHAPE, np.float32), ())
    allowed = np.zeros(SHAPE, bool)
    allowed[5, 50:60, 50:60] = True
    choice, _ = best_push(maps, allowed, rng())
    assert allowed[choice.rotation, choice.row, choice.column]


def test_without_edges_the_critic_decides(table_with):
    q_push = np.zeros(SHAPE, np.float32)
    q_push[2, 30, 40] = 0.4
    choice, by = best_push(exploration_maps(table_with(), q_push, ()), ANY, rng())
    assert (choice.rotation, choice.row, choice.column) == (2, 30, 40)
    assert by == "agnostic push and failures"


def test_with_a_critic_that_sees_nothing_the_edges_decide(two_heaps):
    choice, by = best_push(exploration_maps(two_heaps, np.full(SHAPE, -1, np.float32), ()), ANY, rng())
    assert by == "clutter and failures"
    assert choice.value > 0.5


def test_with_nothing_to_go_by_it_still_keeps_away_from_failures(table_with):
    choice, by = best_push(exploration_maps(table_with(), np.zeros(SHAPE, np.float32), ((0.3, -0.2),)), ANY, rng())
    assert by == "failures alone"
    assert choice.value == pytest.approx(1.0, abs=0.01)


@pytest.fixture
def hinting(situation, set_models):
    """Two heaps, in one of which, at x metres, a little of the target shows."""

    def build(x: float, memory: Memory = Memory(), height: float = 0.05, glimpsed: bool = False):  # noqa: B008
        perception = situation((0.42, 0.0, 0.05, 0.05, "grey"), (0.64, 0.0, 0.05, 0.05, "grey")).perception
        row, column = perception.maps.workspace.cell_of(x, 0.0)
        hint = np.zeros_like(perception.mask)
        hint[int(row) - 3 : int(row) + 3, int(column) - 3 : int(column) + 3] = True
        glimpse = hint & glimpsed
        return situation_of(
            replace(perception, hint=hint, glimpse=glimpse, hint_height=height), "red", memory, set_models, 0
        )

    return build


@pytest.mark.parametrize("x", [0.42, 0.64])
def test_it_pushes_where_a_little_of_the_target_shows(hinting, x):
    there = hinting(x)
    proposal = explore(there)
    assert proposal.choice.of(pushes_towards(there.hint.cells, there.maps.workspace))
    assert "a little of it shows there" in proposal.why


@pytest.mark.parametrize("x", [0.42, 0.64])
def test_it_pushes_where_the_target_was_last_seen(situation, x):
    there = situation(
        (0.42, 0.0, 0.05, 0.05, "grey"), (0.64, 0.0, 0.05, 0.05, "grey"), memory=Memory(last_seen=((x, 0.0),))
    )
    proposal = explore(there)
    assert proposal.choice.of(pushes_towards(there.hint.cells, there.maps.workspace))
    assert "last seen" in proposal.why


def test_a_hint_that_pushes_acted_near_in_vain_is_left_aside(hinting):
    assert "shows" not in explore(hinting(0.42, Memory(failed_pushes=((0.35, 0.0), (0.42, 0.07), (0.49, 0.0))))).why


def test_what_lies_on_the_target_is_pushed_off_it(hinting):
    there = hinting(0.42, height=0.02, glimpsed=True)
    proposal = explore(there)
    assert proposal.choice.level == RAISED
    assert proposal.choice.of(there.heights) - FINGERTIPS == pytest.approx(0.02 + TIPS_ABOVE)
    assert "under something" in proposal.why
    # As low as it is, there is nothing on it to be pushed off.
    assert "under something" not in explore(hinting(0.42, height=0.05, glimpsed=True)).why
