import struct
import zlib

import numpy as np
import pytest
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage

from grasping_invisible.data.clock import to_ns
from grasping_invisible.data.errors import BadMessage
from grasping_invisible.data.images import (
    decode_color,
    decode_depth,
    decode_labels,
    encode_color,
    encode_depth,
    encode_labels,
)

RNG = np.random.default_rng(1)
COLOR = RNG.integers(0, 256, (48, 64, 3), dtype=np.uint8)


def test_png_colour_is_lossless_and_keeps_its_stamp() -> None:
    message = encode_color(COLOR, 1_234_567_890_123)
    assert message.format == "png"
    assert to_ns(message.timestamp) == 1_234_567_890_123
    np.testing.assert_array_equal(decode_color(message), COLOR)


def test_jpeg_colour_keeps_the_order_of_channels() -> None:
    red = np.zeros((32, 32, 3), np.uint8)
    red[..., 0] = 220
    message = encode_color(red, 0, jpeg_quality=90)
    assert message.format == "jpeg"
    np.testing.assert_allclose(decode_color(message).reshape(-1, 3).mean(0), (220, 0, 0), atol=4)


def test_depth_is_kept_to_half_a_millimetre() -> None:
    depth = RNG.uniform(0.2, 2.0, (48, 64)).astype(np.float32)
    message = encode_depth(depth, 0)
    assert (message.encoding, message.width, message.height, message.step) == ("16UC1", 64, 48, 128)
    np.testing.assert_allclose(decode_depth(message), depth, atol=0.000501)


def test_depth_without_a_reading_is_zero() -> None:
    depth = np.array([[np.nan, np.inf, -1.0, 0.0]], np.float32)
    assert not decode_depth(encode_depth(depth, 0)).any()


def test_a_decoded_depth_image_encodes_to_the_same_bytes() -> None:
    message = encode_depth(RNG.uniform(0, 60, (20, 30)).astype(np.float32), 0)
    assert encode_depth(decode_depth(message), 0).data == message.data


def test_labels_are_lossless() -> None:
    labels = RNG.integers(0, 8, (48, 64), dtype=np.uint8)
    np.testing.assert_array_equal(decode_labels(encode_labels(labels, 0)), labels)


@pytest.mark.parametrize("data", [b"", b"not an image", b"\x89PNG\r\n\x1a\n" + bytes(40)])
def test_damaged_images_are_bad_messages(data: bytes) -> None:
    message = encode_color(COLOR, 0)
    message.data = data
    with pytest.raises(BadMessage):
        decode_color(message)
    with pytest.raises(BadMessage):
        decode_labels(message)


def test_a_colour_image_is_no_label_image() -> None:
    with pytest.raises(BadMessage, match="one plane"):
        decode_labels(encode_color(COLOR, 0))


@pytest.mark.parametrize("change", [{"encoding": "32FC1"}, {"step": 7}, {"height": 49}, {"data": b""}])
def test_depth_that_is_not_what_it_says_is_a_bad_message(change: dict[str, object]) -> None:
    message = encode_depth(np.ones((48, 64), np.float32), 0)
    for name, value in change.items():
        setattr(message, name, value)
    with pytest.raises(BadMessage, match="16UC1"):
        decode_depth(message)


def picture_of(width: int, height: int, kind: str) -> CompressedImage:
    """A small picture whose head says that it is of another size."""
    message = encode_color(np.zeros((8, 8, 3), np.uint8), 0, jpeg_quality=None if kind == "png" else 90)
    data = bytearray(message.data)
    if kind == "png":
        struct.pack_into(">II", data, 16, width, height)
        struct.pack_into(">I", data, 29, zlib.crc32(data[12:29]))
    else:
        struct.pack_into(">HH", data, data.find(b"\xff\xc0") + 5, height, width)
    return CompressedImage(data=bytes(data), format=kind)


@pytest.mark.parametrize("kind", ["png", "jpeg"])
def test_a_picture_that_promises_to_fill_the_memory_is_not_decoded(kind: str) -> None:
    assert decode_color(picture_of(8, 8, kind)).shape == (8, 8, 3)
    with pytest.raises(BadMessage, match="of up to 16777216 pixels"):
        decode_color(picture_of(30_000, 20_000, kind))
