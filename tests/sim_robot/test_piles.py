import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from grasping_invisible.sim_robot import piles
from grasping_invisible.sim_robot.blocks import CYLINDER_LENGTH
from grasping_invisible.sim_robot.piles import Lying

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
