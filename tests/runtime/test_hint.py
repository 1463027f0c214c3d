from dataclasses import replace

import numpy as np
import pytest

from grasping_invisible.runtime.hint import Hint, hint_to_follow, raised_tips
from grasping_invisible.runtime.memory import Memory
from grasping_invisible.runtime.motion import RAISED_TIPS, TIPS_ABOVE, pushes_towards


@pytest.fixture
def glanced(perceived):
    """A heap in which a little of the target shows."""
    perception = perceived((0.5, 0.0, 0.05, 0.05, "grey"))
    hint = np.zeros_like(perception.mask)
    row, column = perception.maps.workspace.cell_of(0.5, 0.0)
    hint[int(row) - 2 : int(row) + 2, int(column) - 2 : int(column) + 2] = True
    return replace(perception, hint=hint, hint_height=0.02)


def test_a_raised_push_passes_just_above_what_shows_and_others_do_not(glanced):
    tips = raised_tips(glanced, Hint(glanced.hint))
    towards = pushes_towards(glanced.hint, glanced.maps.workspace)
    assert tips[towards] == pytest.approx(0.02 + TIPS_ABOVE)
    assert tips[~towards] == pytest.approx(RAISED_TIPS)


def test_it_is_never_raised_higher_than_others(glanced):
    assert raised_tips(replace(glanced, hint_height=0.12), Hint(glanced.hint)) == pytest.approx(RAISED_TIPS)


def test_without_a_hint_it_is_like_all_others(glanced):
    assert raised_tips(glanced, Hint(np.zeros_like(glanced.hint))) == pytest.approx(RAISED_TIPS)


def test_a_raised_push_passes_just_above_a_low_target_in_view(perceived):
    low, high = (perceived((0.5, 0.0, 0.05, top, "red")) for top in (0.024, 0.08))
    tips = raised_tips(low, Hint(low.hint))
    assert tips[pushes_towards(low.mask, low.maps.workspace)] == pytest.approx(0.024 + TIPS_ABOVE, abs=1e-3)
    assert raised_tips(high, Hint(high.hint)) == pytest.approx(RAISED_TIPS)


def test_a_hint_counts_until_three_pushes_acted_near_it_in_vain(glanced):
    near = ((0.43, 0.0), (0.5, 0.07), (0.57, 0.0))
    for failed_pushes, followed in (((), True), (near[:2], True), (near, False), ((*near[:2], (0.5, 0.2)), True)):
        hint = hint_to_follow(glanced, Memory(failed_pushes=failed_pushes))
        assert hint.cells.any() == followed
    assert hint_to_follow(replace(glanced, glimpse=glanced.hint), Memory(failed_pushes=near)).cells.any()


def test_where_nothing_shows_the_place_where_it_last_did_is_looked_at(perceived):
    perception = perceived((0.5, 0.0, 0.05, 0.05, "grey"))
    assert not hint_to_follow(perception, Memory()).cells.any()
    memory = Memory(last_seen=((0.5, 0.0), (0.6, 0.1)))
    there = hint_to_follow(perception, memory)
    assert there.cells[cell(perception, 0.5, 0.0)]
    assert there.cells[cell(perception, 0.6, 0.1)]
    assert not there.cells[cell(perception, 0.4, 0.0)]
    assert raised_tips(perception, there) == pytest.approx(RAISED_TIPS)  # how high it lies is not known
    in_vain = replace(memory, failed_pushes=((0.5, 0.07), (0.6, 0.07), (0.43, 0.0)))
    assert there.places == memory.last_seen
    assert not hint_to_follow(perception, in_vain).cells.any()


def test_what_shows_goes_before_what_did(glanced):
    there = hint_to_follow(glanced, Memory(last_seen=((0.4, 0.1),)))
    np.testing.assert_array_equal(there.cells, glanced.hint)


def test_a_target_in_view_is_not_looked_for(perceived):
    seen = perceived((0.5, 0.0, 0.05, 0.05, "red"))
    assert seen.target_seen
    assert not hint_to_follow(seen, Memory(last_seen=((0.4, 0.1),))).cells.any()


def cell(perception, x, y):
    row, column = perception.maps.workspace.cell_of(x, y)
    return int(row), int(column)
