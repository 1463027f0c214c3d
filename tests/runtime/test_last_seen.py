import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.last_seen import CARRIED, cells_around, last_seen_after
from grasping_invisible.runtime.workspace import Workspace

RED = (0.5, 0.0, 0.05, 0.05, "red")


def test_a_push_past_the_target_may_have_taken_it_along_or_not(decision, perceived):
    stayed, taken = last_seen_after((), perceived(RED), decision(gi.PUSH, 0.44, 0.0, 0.0))
    assert stayed == pytest.approx((0.5, 0.0), abs=0.003)
    assert taken == pytest.approx((0.44 + 0.10 + CARRIED, 0.0), abs=0.003)


@pytest.mark.parametrize("passing_by", [(gi.PUSH, 0.44, 0.1), (gi.PUSH, 0.56, 0.0), (gi.GRASP, 0.5, 0.0)])
def test_a_motion_that_does_not_push_it_leaves_it_where_it_was(decision, perceived, passing_by):
    (stayed,) = last_seen_after((), perceived(RED), decision(*passing_by))
    assert stayed == pytest.approx((0.5, 0.0), abs=0.003)


def test_a_little_of_it_counts_as_much(decision, perceived):
    perception = perceived((0.5, 0.0, 0.05, 0.05, "grey"))
    hint = np.zeros_like(perception.mask)
    row, column = perception.maps.workspace.cell_of(0.6, 0.1)
    hint[int(row), int(column)] = True
    (place,) = last_seen_after(((0.4, 0.0),), replace(perception, hint=hint), decision(gi.PUSH, 0.4, -0.1, 0.0))
    assert place == pytest.approx((0.6, 0.1), abs=0.003)


def test_while_nothing_shows_places_move_on_with_pushes(decision, perceived):
    nothing = perceived((0.5, 0.0, 0.05, 0.05, "grey"))
    places = last_seen_after(((0.5, 0.0),), nothing, decision(gi.PUSH, 0.5, 0.1, 0.0))
    assert places == ((0.5, 0.0),)
    places = last_seen_after(places, nothing, decision(gi.PUSH, 0.5, -0.06, math.pi / 2))
    assert places[0] == (0.5, 0.0)
    assert places[1] == pytest.approx((0.5, -0.06 + 0.10 + CARRIED))
    for _ in range(5):
        places = last_seen_after(places, nothing, decision(gi.PUSH, 0.44, 0.0, 0.0))
    assert len(places) == 3


@given(x=st.floats(0.35, 0.7), y=st.floats(-0.2, 0.2))
def test_the_cells_around_a_place_lie_around_it(x, y):
    workspace = Workspace()
    around = cells_around(((x, y),), workspace)
    row, column = workspace.cell_of(x, y)
    assert around[int(row), int(column)]
    far = [math.dist(workspace.cell_center(*cell), (x, y)) for cell in np.argwhere(around)]
    assert max(far) <= 0.03 + 1e-9


def test_without_places_there_are_no_cells():
    assert not cells_around((), Workspace()).any()
