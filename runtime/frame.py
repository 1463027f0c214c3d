"""What a fixed RGB-D camera gives: images, intrinsics and pose, all of one instant."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Camera:
    """A calibrated pinhole camera.

    `intrinsics`: 3 x 3, pixels. `base_from_camera`: 4 x 4, takes points of the optical frame (x right,
    y down, z forward, metres) to the base frame.
    """

    width: int
    height: int
    intrinsics: NDArray[np.float64]
    base_from_camera: NDArray[np.float64]


@dataclass(frozen=True)
class RgbdFrame:
    """One RGB-D image.

    `color`: (height, width, 3) uint8, RGB. `depth`: (height, width) float32, metres along the optical axis,
    0 where there is no reading, registered to `color`. `stamp_ns`: the robot's clock.
    """

    stamp_ns: int
    color: NDArray[np.uint8]
    depth: NDArray[np.float32]
    camera: Camera
