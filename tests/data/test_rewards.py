import math

import numpy as np
import pytest

from grasping_invisible.data import rewards


def scene(*neighbour_columns: slice) -> tuple[np.ndarray, np.ndarray]:
    """Height and mask of a 40 mm target in the middle, with neighbours 30 mm high at some columns."""
    mask = np.zeros((224, 224), bool)
    mask[100:120, 100:120] = True
    height = np.where(mask, 0.04, 0.0).astype(np.float32)
    for columns in neighbour_columns:
        height[100:120, columns] = 0.03
    return height, mask


CROWDED = scene(slice(121, 140))
FREE = scene()
HIDDEN = (FREE[0], np.zeros((224, 224), bool))
THROUGH = {"start": (110.0, 70.0), "yaw": 0.0, "length": 0.1}
PAST = {"start": (60.0, 70.0), "yaw": 0.0, "length": 0.1}


@pytest.mark.parametrize(
    ("before", "after", "push", "reward"),
    [
        (CROWDED, FREE, THROUGH, 0.5),
        (CROWDED, FREE, PAST, 0.5),  # freed, whatever it was aimed at
        (CROWDED, CROWDED, THROUGH, 0.25),
        (FREE, CROWDED, THROUGH, 0.25),
        (CROWDED, CROWDED, PAST, 0.0),
        (CROWDED, HIDDEN, THROUGH, 0.25),  # lost from sight is not freed
        (HIDDEN, FREE, THROUGH, 0.0),
    ],
)
def test_push_rewards(before, after, push, reward):
    assert rewards.push_reward(*before, *after, **push) == reward


def test_a_border_must_be_freed_by_more_than_noise():
    enough = round(rewards.FREED_AREA / 0.002**2)
    before, mask = FREE[0].copy(), FREE[1]
    ring = before[100:120, 121:129]
    for cells, reward in ((enough, 0.5), (enough - 1, 0.0)):
        ring[:] = 0.0
        ring.flat[:cells] = 0.03
        assert rewards.push_reward(before, mask, *FREE, **PAST) == reward


def test_burying_a_part_of_the_target_frees_nothing():
    mask = FREE[1]
    height = np.full((224, 224), 0.04, np.float32)
    half = mask.copy()
    half[:, 110:] = False
    assert rewards.freed_cells(height, mask, height, half) > 100
    assert rewards.push_reward(height, mask, height, half, **PAST) == 0.0


@pytest.mark.parametrize(
    ("start", "yaw", "length", "passes"),
    [
        ((110, 90), 0.0, 50, True),
        ((110, 90), 0.0, 9, False),  # ends before it
        ((110, 90), math.pi, 50, False),  # goes the other way
        ((130, 110), math.pi / 2, 50, True),  # up the image: towards +y
        ((130, 110), -math.pi / 2, 50, False),
        ((130, 90), math.pi / 4, 50, True),
        ((110, 110), 0.0, 50, True),  # starts on it
        ((110, 220), 0.0, 50, False),  # leaves the map
    ],
)
def test_push_vectors(start, yaw, length, passes):
    assert rewards.push_passes(FREE[1], start, yaw, length) is passes


@pytest.mark.parametrize(
    ("row", "column", "grasped", "reward"),
    [(110, 110, True, 1.0), (110, 110, False, 0.5), (110, 90, False, 0.0), (-3, 500, False, 0.0)],
)
def test_grasp_rewards(row, column, grasped, reward):
    assert rewards.grasp_reward(FREE[1], row, column, grasped) == reward


def test_freed_cells_count_the_difference():
    assert rewards.freed_cells(*CROWDED, *FREE) == 20 * 9
    assert rewards.freed_cells(*FREE, *CROWDED) == -20 * 9
    assert rewards.freed_cells(*CROWDED, *HIDDEN) == 0
