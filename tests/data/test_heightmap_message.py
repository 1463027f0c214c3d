import numpy as np
import pytest

from grasping_invisible.data.classes import CLASSES
from grasping_invisible.data.errors import BadMessage
from grasping_invisible.data.heightmap_message import HeightmapArrays, decode_heightmaps, encode_heightmaps

RNG = np.random.default_rng(2)
MAPS = HeightmapArrays(
    stamp_ns=42,
    step=3,
    color=RNG.integers(0, 256, (24, 24, 3), dtype=np.uint8),
    height=RNG.uniform(0, 0.3, (24, 24)).astype(np.float32),
    labels=RNG.integers(0, 8, (24, 24), dtype=np.uint8),
    resolution=0.002,
    center=(0.5, 0.0, 0.0),
)


def test_there_and_back() -> None:
    message = encode_heightmaps(MAPS)
    assert tuple(message.classes) == CLASSES
    maps = decode_heightmaps(message)
    assert (maps.stamp_ns, maps.step, maps.resolution, maps.center) == (42, 3, 0.002, (0.5, 0.0, 0.0))
    np.testing.assert_array_equal(maps.color, MAPS.color)
    np.testing.assert_array_equal(maps.labels, MAPS.labels)
    np.testing.assert_allclose(maps.height, MAPS.height, atol=0.000051)


def test_a_decoded_message_encodes_to_the_same_bytes() -> None:
    message = encode_heightmaps(MAPS)
    assert encode_heightmaps(decode_heightmaps(message)) == message


@pytest.mark.parametrize("field", ["color_png", "height_png", "labels_png"])
def test_a_damaged_or_exchanged_plane_is_a_bad_message(field: str) -> None:
    message = encode_heightmaps(MAPS)
    setattr(message, field, b"junk")
    with pytest.raises(BadMessage):
        decode_heightmaps(message)


def test_a_shape_that_does_not_fit_is_a_bad_message() -> None:
    message = encode_heightmaps(MAPS)
    message.rows = 25
    with pytest.raises(BadMessage, match="25"):
        decode_heightmaps(message)
