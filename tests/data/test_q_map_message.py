import numpy as np
import pytest

from grasping_invisible.data.errors import BadMessage
from grasping_invisible.data.q_map_message import QMapArrays, decode_q_maps, encode_q_maps

RNG = np.random.default_rng(3)


def maps_of(push: np.ndarray, grasp: np.ndarray) -> QMapArrays:
    return QMapArrays(stamp_ns=7, step=1, push=push.astype(np.float32), grasp=grasp.astype(np.float32))


def test_there_and_back_within_half_a_level() -> None:
    maps = maps_of(RNG.normal(0, 1, (2, 16, 12, 10)), RNG.uniform(0, 0.2, (16, 12, 10)))
    restored = decode_q_maps(encode_q_maps(maps))
    assert (restored.stamp_ns, restored.step, restored.push.shape) == (7, 1, (2, 16, 12, 10))
    for before, after in ((maps.push, restored.push), (maps.grasp, restored.grasp)):
        np.testing.assert_allclose(after, before, atol=float(np.ptp(before)) / 509)


def test_the_best_action_keeps_the_best_value() -> None:
    maps = maps_of(RNG.normal(0, 1, (2, 16, 12, 10)), np.zeros((16, 12, 10)))
    restored = decode_q_maps(encode_q_maps(maps))
    assert restored.push.flat[maps.push.argmax()] == restored.push.max()


def test_maps_of_one_value_are_kept() -> None:
    restored = decode_q_maps(encode_q_maps(maps_of(np.full((2, 2, 3, 4), 0.25), np.zeros((2, 3, 4)))))
    np.testing.assert_array_equal(restored.push, np.float32(0.25))
    np.testing.assert_array_equal(restored.grasp, 0)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_values_that_are_not_finite_are_refused(bad: float) -> None:
    push = np.zeros((2, 2, 3, 4))
    push[1, 1, 1, 1] = bad
    with pytest.raises(ValueError, match="finite"):
        encode_q_maps(maps_of(push, np.zeros((2, 3, 4))))


def test_what_was_logged_before_pushes_had_heights_has_one() -> None:
    message = encode_q_maps(maps_of(np.ones((1, 2, 3, 4)), np.ones((2, 3, 4))))
    message.ClearField("push_levels")
    assert decode_q_maps(message).push.shape == (1, 2, 3, 4)


def test_stacks_of_different_shapes_are_refused() -> None:
    with pytest.raises(ValueError, match="differ in shape"):
        encode_q_maps(maps_of(np.ones((2, 2, 3, 4)), np.ones((2, 3, 5))))


def test_a_damaged_stack_is_a_bad_message() -> None:
    message = encode_q_maps(maps_of(np.ones((2, 2, 3, 4)), np.ones((2, 3, 4))))
    message.rotations = 3
    with pytest.raises(BadMessage):
        decode_q_maps(message)


@pytest.mark.parametrize("bad", [np.nan, -np.inf])
def test_bounds_that_are_not_finite_are_a_bad_message(bad: float) -> None:
    message = encode_q_maps(maps_of(np.ones((2, 2, 3, 4)), np.ones((2, 3, 4))))
    message.grasp_min = bad
    with pytest.raises(BadMessage, match="not finite"):
        decode_q_maps(message)
