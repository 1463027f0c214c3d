import numpy as np
import pytest

from grasping_invisible.data.calibration_message import decode_calibration, encode_calibration
from grasping_invisible.data.errors import BadMessage

K = np.array([[615.0, 0.0, 319.5], [0.0, 615.0, 239.5], [0.0, 0.0, 1.0]])


def test_intrinsics_survive_the_message() -> None:
    message = encode_calibration(K, 640, 480, 7)
    assert np.array_equal(decode_calibration(message), K)
    assert (message.width, message.height) == (640, 480)


def test_distorted_or_incomplete_calibration_is_refused() -> None:
    distorted = encode_calibration(K, 640, 480, 7)
    distorted.D[0] = 0.1
    with pytest.raises(BadMessage, match="undistorted"):
        decode_calibration(distorted)
    short = encode_calibration(K, 640, 480, 7)
    del short.K[8]
    with pytest.raises(BadMessage, match="9 finite numbers"):
        decode_calibration(short)


@pytest.mark.parametrize(("place", "value"), [(0, 0.0), (3, 615.0), (4, 1e300), (6, 1.0), (8, 2.0)])
def test_intrinsics_that_are_no_pinhole_cameras_are_refused(place: int, value: float) -> None:
    message = encode_calibration(K, 640, 480, 7)
    message.K[1] = 615.0  # pixels may be askew, but then the other must not be
    decode_calibration(message)
    message.K[place] = value
    with pytest.raises(BadMessage, match="pinhole"):
        decode_calibration(message)
