import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from grasping_invisible.data.calibration_message import encode_calibration
from grasping_invisible.data.images import CAMERA_FRAME, encode_color, encode_depth
from grasping_invisible.data.topics import CAMERA_INFO, COLOR_IMAGE, DEPTH_IMAGE, OUTCOME, TRANSFORMS, Topic
from grasping_invisible.data.transform_message import encode_transforms
from grasping_invisible.runtime.errors import RobotError
from grasping_invisible.runtime.frame_sets import FrameSets

K = np.array([[30.0, 0, 7.5], [0, 30.0, 5.5], [0, 0, 1]])


def parts(stamp: int, depth_shape: tuple[int, int] = (12, 16)) -> list[tuple[Topic, bytes]]:
    return [
        (COLOR_IMAGE, encode_color(np.full((12, 16, 3), 9, np.uint8), stamp).SerializeToString()),
        (DEPTH_IMAGE, encode_depth(np.ones(depth_shape, np.float32), stamp).SerializeToString()),
        (CAMERA_INFO, encode_calibration(K, 16, 12, stamp).SerializeToString()),
        (TRANSFORMS, encode_transforms({CAMERA_FRAME: np.eye(4)}, stamp).SerializeToString()),
    ]


def filled(*messages: tuple[Topic, bytes]) -> FrameSets:
    sets = FrameSets()
    for topic, payload in messages:
        sets.add(topic, payload)
    return sets


@given(st.permutations(parts(5) + parts(9)))
def test_any_order_of_arrival_gives_the_earliest_complete_set(messages: list[tuple[Topic, bytes]]) -> None:
    sets = filled(*messages)
    for since, stamp in ((0, 5), (5, 5), (6, 9), (9, 9)):
        found = sets.first_since(since)
        assert found is not None
        assert found.decode().stamp_ns == stamp
    assert sets.first_since(10) is None


def test_parts_of_different_frames_are_never_put_together() -> None:
    sets = filled(*parts(5)[:2], *parts(6)[2:])
    assert sets.first_since(0) is None
    assert len(sets.missing_since(0)) == 2


def test_transforms_have_the_stamp_of_the_latest_of_them() -> None:
    *images, (_, _) = parts(5)
    poses = encode_transforms({CAMERA_FRAME: np.eye(4)}, 5)
    poses.transforms.insert(0, encode_transforms({"bolted_down": np.eye(4)}, 1).transforms[0])
    assert filled(*images, (TRANSFORMS, poses.SerializeToString())).first_since(5) is not None


def test_what_is_missing_is_named() -> None:
    sets = filled(*parts(5)[:3])
    assert sets.missing_since(0) == [TRANSFORMS.key]
    assert len(sets.missing_since(6)) == 4


def test_old_sets_are_forgotten() -> None:
    sets = filled(*[message for stamp in range(1, 36) for message in parts(stamp)])
    found = sets.first_since(0)
    assert found is not None
    assert found.decode().stamp_ns == 4


def test_damaged_and_foreign_messages_are_left_out() -> None:
    sets = filled((COLOR_IMAGE, b"\xff\xff\xff"), (OUTCOME, b""), *parts(5)[1:])
    assert sets.missing_since(0) == [COLOR_IMAGE.key]


def test_parts_that_do_not_fit_are_an_error_with_both_sizes() -> None:
    found = filled(*parts(5, depth_shape=(6, 8))).first_since(0)
    assert found is not None
    with pytest.raises(RobotError, match="colour is 16 x 12 but depth is 8 x 6"):
        found.decode()


def test_a_damaged_image_is_an_error() -> None:
    broken = encode_color(np.zeros((12, 16, 3), np.uint8), 5)
    broken.data = b"not a picture"
    found = filled((COLOR_IMAGE, broken.SerializeToString()), *parts(5)[1:]).first_since(0)
    assert found is not None
    with pytest.raises(RobotError, match="cannot be used"):
        found.decode()
