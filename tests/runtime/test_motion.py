import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from grasping_invisible.data.action_grid import LOW, PUSH_LENGTH, RAISED, ROTATIONS, feasible_grasps, rotation_angle
from grasping_invisible.runtime import motion
from grasping_invisible.runtime.rotation import action_grid
from grasping_invisible.runtime.workspace import Workspace

WORKSPACE = Workspace()


def cell_at(x: float, y: float) -> tuple[int, int]:
    return action_grid(WORKSPACE).cell_of(x, y)


@given(row=st.integers(0, 111), column=st.integers(0, 111))
def test_cells_and_positions_agree(row, column):
    x, y = motion.cell_position(row, column, WORKSPACE)
    assert WORKSPACE.contains(x, y)
    assert cell_at(x, y) == (row, column)
    # The cell of the action grid is the one over these cells of the heightmap.
    assert tuple(index // 2 for index in WORKSPACE.cell_of(x - 1e-4, y + 1e-4)) == (row, column)


@pytest.mark.parametrize(("top", "height"), [(0.1, 0.07), (0.05, 0.02), (0.025, 0.015), (0.0, 0.015)])
def test_a_grasp_reaches_down_the_sides(table_with, top, height):
    maps = table_with((0.5, 0.0, 0.05, top, "red"))
    assert motion.grasp_height(maps, *cell_at(0.5, 0.0)) == pytest.approx(height)


def test_a_grasp_at_an_edge_still_finds_the_top(table_with):
    maps = table_with((0.5, 0.0, 0.05, 0.08, "red"))
    assert motion.grasp_height(maps, *cell_at(0.5 - 0.0229, 0.0)) == pytest.approx(0.05)


def test_a_wild_reading_does_not_lift_a_grasp(table_with):
    maps = table_with((0.5, 0.0, 0.05, 0.08, "red"))
    row, column = WORKSPACE.cell_of(0.5, 0.0)
    maps.height[row, column] = 0.3
    assert motion.grasp_height(maps, *cell_at(0.5, 0.0)) == pytest.approx(0.05)


def test_grasps_at_the_corners_of_the_workspace_have_a_height(table_with):
    for cell in ((0, 0), (111, 111), (0, 111)):
        assert motion.grasp_height(table_with(), *cell) == pytest.approx(motion.MIN_TCP_HEIGHT)


def test_a_push_starts_low_on_the_table_and_high_on_a_block(table_with):
    maps = table_with((0.5, 0.0, 0.06, 0.05, "grey"))
    heights = motion.push_heights(maps)[LOW]
    assert heights[0][cell_at(0.40, 0.0)] == pytest.approx(0.015)
    assert heights[0][cell_at(0.5, 0.0)] == pytest.approx(0.05 + 0.003 + 0.008)  # clear of it with the fingertips


def test_the_wide_side_of_the_fingers_lies_across_the_push(table_with):
    heights = motion.push_heights(table_with((0.5, 0.0, 0.04, 0.05, "grey")))[LOW]
    beside = cell_at(0.5, -0.038)  # 18 mm from the block's side
    assert heights[0][beside] == pytest.approx(0.061)  # along +x: the wide side reaches the block
    assert heights[4][beside] == pytest.approx(0.015)  # along +y: the narrow side does not


def test_a_wild_reading_does_not_lift_a_push(table_with):
    maps = table_with()
    maps.height[100, 100] = 0.25
    assert motion.push_heights(maps)[LOW].max() == pytest.approx(0.015)


@pytest.mark.parametrize("k", range(ROTATIONS))
def test_pushes_towards_a_block_are_feasible_and_pushes_away_from_it_are_not(table_with, k):
    maps = table_with((0.5, 0.0, 0.05, 0.05, "grey"))
    feasible = motion.feasible_pushes(maps, motion.push_heights(maps))[LOW]
    yaw = rotation_angle(k)
    before = cell_at(0.5 - 0.07 * math.cos(yaw), -0.07 * math.sin(yaw))
    behind = cell_at(0.5 + 0.07 * math.cos(yaw), 0.07 * math.sin(yaw))
    assert feasible[k][before]
    assert not feasible[k][behind]


@pytest.mark.parametrize(
    ("before", "aside", "moves"),
    [(0.08, 0.0, True), (0.115, 0.0, True), (0.132, 0.0, False), (0.08, 0.025, True), (0.08, 0.045, False)],
)
def test_a_push_that_only_touches_a_block_is_left_out(table_with, before, aside, moves):
    """`before`, `aside`: where it starts, metres from the middle of a block of 5 cm."""
    maps = table_with((0.5, 0.0, 0.05, 0.05, "grey"))
    feasible = motion.feasible_pushes(maps, motion.push_heights(maps))[LOW]
    assert feasible[0][cell_at(0.5 - before, aside)] == moves


def test_a_push_over_a_flat_top_meets_nothing_but_a_second_storey_does(table_with):
    block = (0.5, 0.0, 0.2, 0.05, "grey")
    flat = table_with(block)
    stacked = table_with(block, (0.56, 0.0, 0.05, 0.10, "grey"))
    on_top = cell_at(0.5, 0.0)
    assert not motion.feasible_pushes(flat, motion.push_heights(flat))[:, 0, *on_top].any()
    assert motion.feasible_pushes(stacked, motion.push_heights(stacked))[LOW, 0, *on_top]


def test_a_raised_push_takes_the_roof_and_leaves_what_it_stands_on(table_with):
    house = table_with((0.5, 0.0, 0.06, 0.10, "grey"))
    heights = motion.push_heights(house)
    before, on_top = cell_at(0.42, 0.0), cell_at(0.5, 0.0)
    assert heights[RAISED, 0, *before] - motion.FINGERTIPS == pytest.approx(motion.RAISED_TIPS)
    assert motion.feasible_pushes(house, heights)[:, 0, *before].all()
    # Where the low push is as high, the raised one is the same.
    assert heights[RAISED, 0, *on_top] == heights[LOW, 0, *on_top]
    assert not motion.feasible_pushes(house, heights)[RAISED, 0, *on_top]


def test_a_raised_push_can_be_made_lower(table_with):
    stack = table_with((0.5, 0.0, 0.05, 0.10, "grey"))
    before = cell_at(0.42, 0.0)
    heights = motion.push_heights(stack, raised_tips=0.03)
    assert heights[RAISED, 0, *before] - motion.FINGERTIPS == pytest.approx(0.03)
    assert motion.feasible_pushes(stack, heights)[:, 0, *before].all()


def test_a_raised_push_passes_over_what_a_hand_can_take_whole(table_with):
    block = table_with((0.5, 0.0, 0.06, 0.05, "grey"))
    feasible = motion.feasible_pushes(block, motion.push_heights(block))
    assert feasible[LOW].any()
    assert not feasible[RAISED].any()


def test_an_empty_table_offers_no_push(table_with):
    maps = table_with()
    assert not motion.feasible_pushes(maps, motion.push_heights(maps)).any()


@given(k=st.integers(0, 15), row=st.integers(0, 111), column=st.integers(0, 111))
def test_pushes_end_well_inside_the_workspace(k, row, column):
    x, y = motion.cell_position(row, column, WORKSPACE)
    yaw = rotation_angle(k)

    def to_the_edge(ahead: float) -> float:
        at = x + ahead * math.cos(yaw), y + ahead * math.sin(yaw)
        return min(*np.subtract(at, WORKSPACE.low[:2]), *np.subtract(WORKSPACE.high[:2], at))

    margins = to_the_edge(PUSH_LENGTH) - motion.PUSH_END_INSET, to_the_edge(PUSH_LENGTH + motion.PUSH_AHEAD)
    if min(map(abs, margins)) > 1e-6:
        assert motion.ends_inside(WORKSPACE)[k, row, column] == (min(margins) > 0)


def test_a_push_along_the_edge_is_allowed_and_one_towards_it_is_not():
    x, y = WORKSPACE.high[0] - 0.04, WORKSPACE.center[1]
    inside = motion.ends_inside(WORKSPACE)
    assert inside[4][cell_at(x, y - 0.05)]
    assert not inside[0][cell_at(x - PUSH_LENGTH, y)]  # it would end there, and drive what it meets out
    assert inside[0][cell_at(x - PUSH_LENGTH - motion.PUSH_AHEAD, y)]


@pytest.mark.parametrize(
    ("k", "before", "aside", "towards"),
    [
        (0, 0.08, 0.0, True),
        (0, 0.08, 0.06, False),
        (8, 0.08, 0.0, False),
        (4, 0.08, 0.0, False),
        (8, 0.048, 0.0, False),  # starts beside it and goes away
        (6, 0.048, 0.0, False),
        (8, 0.034, 0.0, True),  # the same, from the border
    ],
)
def test_only_pushes_that_pass_the_target_are_for_it(table_with, k, before, aside, towards):
    x, y, _ = WORKSPACE.center
    mask = table_with((x, y, 0.04, 0.05, "red")).labels == 1
    row, column = cell_at(x - before, y + aside)
    assert motion.pushes_towards(mask, WORKSPACE)[k, row, column] == towards


def test_no_motion_starts_above_what_the_arm_may_reach(table_with):
    x, y, _ = WORKSPACE.center
    pile = (x, y, 0.06, 0.26, "red")  # what stands on it could be pushed, were it not so high
    maps = table_with(pile, (x + 0.06, y, 0.04, 0.29, "red"), (x - 0.12, y, 0.04, 0.05, "red"))
    heights = motion.push_heights(maps)
    on_top = cell_at(x, y)
    assert heights[LOW, 0, *on_top] > motion.MAX_TCP_HEIGHT
    assert not motion.feasible_pushes(maps, heights)[:, 0, *on_top].any()
    assert not motion.open_pushes(WORKSPACE, heights)[:, 0, *on_top].any()

    aimed = feasible_grasps(maps.labels == 1, WORKSPACE.resolution)
    low = motion.low_grasps(maps, aimed)
    for row, column in np.argwhere(aimed[0]):
        assert low[0, row, column] == (motion.grasp_height(maps, row, column) <= motion.MAX_TCP_HEIGHT)
    assert (aimed & ~low).any()
    assert low[:, *cell_at(x - 0.12, y)].all()


def test_a_single_wild_reading_does_not_forbid_a_grasp(table_with):
    maps = table_with((0.5, 0.0, 0.05, 0.05, "red"))
    maps.height[WORKSPACE.cell_of(0.5, 0.0)] = 0.3
    aimed = feasible_grasps(maps.labels == 1, WORKSPACE.resolution)
    np.testing.assert_array_equal(motion.low_grasps(maps, aimed), aimed)


def test_a_target_is_not_pushed_where_it_may_leave_the_workspace():
    mask = np.zeros((WORKSPACE.cells, WORKSPACE.cells), np.bool_)
    _, high_y = WORKSPACE.high
    row, column = (int(at) for at in WORKSPACE.cell_of(WORKSPACE.center[0], high_y - 0.06))
    mask[row - 5 : row + 5, column - 5 : column + 5] = True
    pushes = np.ones((2, 16, 112, 112), np.bool_)
    place = WORKSPACE.middle_of(mask)
    kept = motion.keeping_inside(pushes, (place,), WORKSPACE)
    assert kept[:, [0, 1, 8, 12]].all()  # along the edge and away from it
    assert not kept[:, [3, 4, 5]].any()  # over it
    outwards = np.zeros_like(pushes)
    outwards[:, 4] = True
    np.testing.assert_array_equal(motion.keeping_inside(outwards, (place,), WORKSPACE), outwards)


def test_what_shows_of_a_target_may_lie_some_way_from_its_middle():
    """And it may be in one of several places."""
    x, high_y = WORKSPACE.center[0], WORKSPACE.high[1]
    pushes = np.ones((2, 16, 112, 112), np.bool_)
    near, far = (x, high_y - PUSH_LENGTH - 0.01), (x, high_y - PUSH_LENGTH - 0.02)
    assert not motion.keeping_inside(pushes, (near,), WORKSPACE)[:, 4].any()
    assert motion.keeping_inside(pushes, (far,), WORKSPACE)[:, 4].all()
    assert not motion.keeping_inside(pushes, (far, near), WORKSPACE)[:, 4].any()


def test_the_hand_comes_down_between_what_is_as_tall(table_with):
    """The fingers would reach the table beside a block, and the hand would meet what stands 8 cm to the side."""
    x, y, _ = WORKSPACE.center
    k, start = 0, cell_at(x - 0.06, y)

    def can_be_made(*around):
        maps = table_with((x, y, 0.04, 0.05, "red"), *around)
        return motion.feasible_pushes(maps, motion.push_heights(maps))[LOW, k, *start]

    assert can_be_made()
    assert not can_be_made((x - 0.06, y + 0.08, 0.03, 0.08, "grey"))
    assert not can_be_made((x - 0.06, y - 0.08, 0.03, 0.08, "grey"))
    assert can_be_made((x - 0.06, y + 0.08, 0.03, 0.05, "grey"))  # the hand stays above it
    assert can_be_made((x - 0.06, y + 0.13, 0.03, 0.08, "grey"))
    assert can_be_made((x - 0.12, y, 0.03, 0.08, "grey"))  # behind the hand, which is narrow that way
