import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.sim_robot import piles
from grasping_invisible.sim_robot.blocks import CYLINDER_LENGTH
from grasping_invisible.sim_robot.piles import Lying
from grasping_invisible.sim_robot.scene import Scene
from grasping_invisible.sim_robot.world import World

rng_seeds = st.integers(0, 2**32)


@given(rng_seeds, st.sampled_from([1, 2]))
def test_a_roof_covers_the_middle_and_rests_on_the_walls(seed: int, blocks: int) -> None:
    rng = np.random.default_rng(seed)
    hidden = piles.lay(piles.block_kind("cylinder"), rng)
    walls = piles.surround(hidden, 4, hidden.size[2], rng)
    roof = piles.roof([hidden, *walls], hidden, blocks, rng)
    assert len(roof) == blocks
    assert not any(one.overlaps(other) for one in roof for other in roof if one is not other)
    for block in roof:
        assert block.center[2] - block.size[2] / 2 >= CYLINDER_LENGTH
    assert covered_share(hidden, roof) > 0.9


@given(rng_seeds)
def test_a_roof_of_three_has_one_on_the_seam_of_the_others(seed: int) -> None:
    rng = np.random.default_rng(seed)
    hidden = piles.lay(piles.block_kind("cylinder"), rng)
    walls = piles.surround(hidden, 4, hidden.size[2], rng)
    *below, third = piles.roof([hidden, *walls], hidden, 3, rng)
    assert len(below) == 2
    for block in below:
        assert block.overlaps(third)
        assert third.center[2] - third.size[2] / 2 >= block.top


@given(rng_seeds)
def test_what_lies_low_can_be_covered(seed: int) -> None:
    rng = np.random.default_rng(seed)
    low = piles.lay_low(rng)
    assert low.size[2] <= piles.LOW
    assert covered_share(low, piles.roof([low], low, 1, rng)) > 0.8


def test_what_is_too_broad_for_one_block_is_covered_by_two() -> None:
    rng = np.random.default_rng(0)
    for size in ((0.060, 0.056, 0.040), (0.050, 0.150, 0.030), (0.090, 0.095, 0.020)):
        broad = Lying(piles.block_kind("cube"), piles.UPRIGHT, size).at(0.0, 0.0)
        for blocks in (1, 2, 3):
            roof = piles.roof([broad], broad, blocks, rng)
            assert len(roof) == max(blocks, 2)
            assert covered_share(broad, roof[:2]) > 0.85


def test_what_no_two_blocks_cover_is_bad_input() -> None:
    with pytest.raises(BadInput, match="no two blocks cover a target of 120 x 110 mm"):
        piles.coverable((0.120, 0.110, 0.030))


def covered_share(hidden: Lying, roof: list[Lying]) -> float:
    """Of the footprint's bounding box, by samples of 1 mm."""
    x, y = (
        np.arange(hidden.center[axis] - hidden.size[axis] / 2, hidden.center[axis] + hidden.size[axis] / 2, 0.001)
        for axis in (0, 1)
    )
    covered = np.zeros((len(y), len(x)), bool)
    for block in roof:
        across, down = (np.abs(at - block.center[axis]) <= block.size[axis] / 2 for axis, at in ((0, x), (1, y)))
        covered |= down[:, None] & across
    return float(covered.mean())


@pytest.mark.parametrize("shape", piles.SHAPES)
def test_a_block_rests_on_the_table(shape: str) -> None:
    block = piles.lay(piles.block_kind(shape), np.random.default_rng(0))
    assert block.center[2] - block.size[2] / 2 == pytest.approx(piles.LIFT)


@pytest.mark.parametrize("arches", [1, 2])
def test_a_cradled_cylinder_stays_where_it_is(arches: int) -> None:
    pile = piles.cradled(arches, np.random.default_rng(arches))
    assert [block.kind.shape for block in pile] == ["cylinder", *["arch"] * arches]
    colors = ["red", "grey", "grey"]
    objects = tuple(piles.as_object(block, color, 0.0, 0.0, 0.4) for block, color in zip(pile, colors, strict=False))
    world = World(Scene(name="cradled", target="red", objects=objects), None)
    try:
        before = np.array([state.position for state in world.object_states()])
        assert world.settle(2.0)
        moved = np.array([state.position for state in world.object_states()]) - before
    finally:
        world.close()
    assert np.abs(moved).max() < 0.003


@given(rng_seeds)
def test_what_stands_around_a_pile_stands_beside_all_of_it(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pile = piles.cradled(2, rng)
    for block in piles.surround(piles.around(pile), 4, 0.0, rng):
        assert not any(block.overlaps(other) for other in pile)
