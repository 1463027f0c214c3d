import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.rotation import CRITIC_INPUTS, PLANES
from grasping_invisible.runtime.workspace import Workspace
from grasping_invisible.training.critic_batch import CROP, example
from grasping_invisible.training.packed_maps import PackedMaps
from grasping_invisible.training.transitions import Transition


def transition(kind: gi.MotionKind, row: int, column: int, rotation: int) -> Transition:
    """The goal is a block around the action's own cell."""
    labels = np.zeros((224, 224), np.uint8)
    labels[max(0, 2 * row - 6) : 2 * row + 8, max(0, 2 * column - 6) : 2 * column + 8] = 1
    height = np.where(labels > 0, 0.05, 0.0).astype(np.float32)
    before = Heightmaps(1, np.full((224, 224, 3), 128, np.uint8), height, labels, Workspace())
    return Transition(PackedMaps.of(before), 1, kind, rotation, row, column, 0.5, False, None, False, True, "run", 0)


cells = st.integers(8, 103)


@given(row=cells, column=cells, rotation=st.integers(0, 15), seed=st.integers(0, 1000))
def test_the_pixel_stays_on_what_the_action_was_aimed_at(row: int, column: int, rotation: int, seed: int) -> None:
    """However an example is turned, cropped and mirrored, the mask plane is full at the executed pixel."""
    kind = gi.GRASP if seed % 2 else gi.PUSH
    item = transition(kind, row, column, rotation)
    for rng in (None, np.random.default_rng(seed)):
        for count in CRITIC_INPUTS.values():
            planes, (at_row, at_column) = example(item, count, rng)
            assert planes.shape == (count, *((160, 160) if rng is None else (CROP, CROP)))
            assert planes[-1, at_row, at_column] > 0.95


@pytest.mark.parametrize("rotation", range(0, 16, 3))
def test_a_push_points_to_the_right_whatever_the_augmentation(rotation: int) -> None:
    """A block ahead of the push lies to the right of its pixel, in mirrored examples too."""
    angle = 2 * np.pi * rotation / 16
    row, column = round(56 - 12 * np.sin(angle)), round(56 + 12 * np.cos(angle))
    ahead = transition(gi.PUSH, row, column, rotation)
    push = Transition(ahead.seen, 1, gi.PUSH, rotation, 56, 56, 0.25, False, None, False, False, "run", 0)
    for seed in range(4):
        planes, (at_row, at_column) = example(push, PLANES, np.random.default_rng(seed))
        assert planes[4, at_row, at_column + 12] > 0.95
        assert planes[4, at_row, at_column - 12] == 0
