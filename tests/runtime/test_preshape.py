import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from grasping_invisible.runtime.preshape import (
    CLEARANCE,
    FULLY_OPEN,
    MAX_OPENING,
    MAX_SHIFT,
    MIN_OPENING,
    preshape,
)
from grasping_invisible.runtime.workspace import Workspace

SPACE = Workspace()
MIDDLE = (0.53, 0.02)
x_of_cells, y_of_cells = (
    SPACE.low[0] + (np.arange(SPACE.cells) + 0.5) * SPACE.resolution,
    SPACE.high[1] - (np.arange(SPACE.cells)[:, None] + 0.5) * SPACE.resolution,
)


def block(length: float, breadth: float, yaw: float = 0.0, middle: tuple[float, float] = MIDDLE) -> np.ndarray:
    """The mask of a block whose long side lies along `yaw`."""
    x, y = x_of_cells - middle[0], y_of_cells - middle[1]
    along, across = x * math.cos(yaw) + y * math.sin(yaw), y * math.cos(yaw) - x * math.sin(yaw)
    return (np.abs(along) <= length / 2) & (np.abs(across) <= breadth / 2)


@pytest.mark.parametrize("yaw", [0.0, math.pi / 8, math.pi / 2, -2.5])
@pytest.mark.parametrize("aside", [-0.01, 0.0, 0.008])
def test_fingers_are_centred_on_the_target_and_fit_it(yaw: float, aside: float) -> None:
    cell = MIDDLE[0] + aside * math.cos(yaw), MIDDLE[1] + aside * math.sin(yaw)
    fingers = preshape(block(0.05, 0.05, yaw), SPACE, cell, yaw)
    assert fingers.shift == pytest.approx(-aside, abs=0.002)
    assert fingers.opening == pytest.approx(0.05 + 2 * CLEARANCE, abs=0.004)


def test_a_narrow_target_leaves_room_for_what_is_not_seen_of_it() -> None:
    assert preshape(block(0.01, 0.05), SPACE, MIDDLE, 0.0).opening == MIN_OPENING


def test_a_grasp_far_off_the_middle_opens_farther_or_fully() -> None:
    plate = block(0.04, 0.05)
    off = preshape(plate, SPACE, (MIDDLE[0] + 0.02, MIDDLE[1]), 0.0)
    assert off.shift == -MAX_SHIFT
    assert off.opening == pytest.approx(0.04 + 2 * (0.008 + CLEARANCE), abs=0.004)
    edge = preshape(block(0.07, 0.05), SPACE, (MIDDLE[0] + 0.035, MIDDLE[1]), 0.0)
    assert (edge.shift, edge.opening) == (-MAX_SHIFT, 0.0)


def test_what_is_too_broad_or_not_there_is_grasped_fully_open_where_it_was_aimed() -> None:
    assert preshape(block(0.1, 0.05), SPACE, MIDDLE, 0.0) == FULLY_OPEN
    assert preshape(block(0.05, 0.05), SPACE, (MIDDLE[0] + 0.1, MIDDLE[1]), 0.0) == FULLY_OPEN
    assert preshape(np.zeros((SPACE.cells, SPACE.cells), bool), SPACE, MIDDLE, 0.0) == FULLY_OPEN


def test_of_two_pieces_the_nearer_one_is_closed_on() -> None:
    legs = block(0.02, 0.05) | block(0.02, 0.05, middle=(MIDDLE[0] + 0.06, MIDDLE[1]))
    fingers = preshape(legs, SPACE, (MIDDLE[0] + 0.004, MIDDLE[1]), 0.0)
    assert fingers.shift == pytest.approx(-0.004, abs=0.002)
    assert fingers.opening == pytest.approx(0.02 + 2 * CLEARANCE, abs=0.004)


@given(st.floats(0.01, 0.12), st.floats(0.01, 0.12), st.floats(-4, 4), st.floats(-0.05, 0.05), st.floats(-4, 4))
@example(0.0625, 0.03125, 1.0, 0.0, 0.0)
def test_half_a_turn_is_the_same_grasp_and_the_limits_hold(length, breadth, lies, aside, yaw) -> None:
    mask = block(length, breadth, lies)
    cell = MIDDLE[0] + aside, MIDDLE[1]
    one, other = preshape(mask, SPACE, cell, yaw), preshape(mask, SPACE, cell, yaw + math.pi)
    assert one.opening == pytest.approx(other.opening, abs=1e-9)
    assert one.shift == pytest.approx(-other.shift, abs=1e-9)
    assert abs(one.shift) <= MAX_SHIFT
    assert one.opening == 0.0 or MIN_OPENING <= one.opening <= MAX_OPENING


@given(st.floats(0.01, 0.1), st.floats(-0.02, 0.02), st.floats(-4, 4))
@example(0.03, -0.012, math.pi / 4)
def test_no_grasp_is_moved_out_of_the_workspace(length, aside, yaw) -> None:
    edge = SPACE.low[1]
    strip = block(length, 0.006, middle=(MIDDLE[0] + aside, edge + 0.003))
    x, y = MIDDLE[0], edge + 0.002  # in the outermost row of the action grid
    fingers = preshape(strip, SPACE, (x, y), yaw)
    assert SPACE.contains(x + fingers.shift * math.cos(yaw), y + fingers.shift * math.sin(yaw))
