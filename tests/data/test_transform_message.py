import numpy as np
import pytest
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from hypothesis import given
from hypothesis import strategies as st

from grasping_invisible.data.errors import BadMessage
from grasping_invisible.data.transform_message import (
    decode_transform,
    encode_transforms,
    quaternion_of,
    rotation_of,
)

unit = st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda q: np.linalg.norm(q) > 0.1)


@given(unit)
def test_quaternion_and_matrix_agree_both_ways(values: list[float]) -> None:
    quaternion = np.array(values) / np.linalg.norm(values)
    matrix = rotation_of(quaternion)
    assert np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(matrix) == pytest.approx(1.0)
    assert np.allclose(rotation_of(quaternion_of(matrix)), matrix, atol=1e-9)
    assert abs(float(quaternion_of(matrix) @ quaternion)) == pytest.approx(1.0)


def test_quarter_turn_about_z_takes_x_to_y() -> None:
    half = np.sqrt(0.5)
    assert np.allclose(rotation_of(np.array([0.0, 0.0, half, half])) @ [1, 0, 0], [0, 1, 0])


def test_pose_survives_the_message() -> None:
    pose = np.eye(4)
    pose[:3, :3] = rotation_of(np.array([0.5, -0.5, 0.5, 0.5]))
    pose[:3, 3] = 0.95, -0.1, 0.62
    message = encode_transforms({"panda_link1": np.eye(4), "camera": pose}, 5)
    assert np.allclose(decode_transform(message, "camera"), pose)


def test_of_several_poses_in_a_message_the_latest_counts() -> None:
    moved = np.eye(4)
    moved[0, 3] = 0.5
    for poses in ((np.eye(4), 3), (moved, 7)), ((moved, 7), (np.eye(4), 3)):
        message = FrameTransforms()
        for pose, stamp in poses:
            message.transforms.extend(encode_transforms({"camera": pose}, stamp).transforms)
        assert np.allclose(decode_transform(message, "camera"), moved)


def test_missing_frame_names_what_there_is() -> None:
    with pytest.raises(BadMessage, match="panda_link0 to panda_link1"):
        decode_transform(encode_transforms({"panda_link1": np.eye(4)}, 5), "camera")


def test_unnormalised_rotation_is_refused() -> None:
    message = encode_transforms({"camera": np.eye(4)}, 5)
    message.transforms[0].rotation.w = 3.0
    with pytest.raises(BadMessage, match="length 1"):
        decode_transform(message, "camera")
