"""Patches: connected pixels of one target class in a label image."""

from collections.abc import Iterator

import cv2
import numpy as np
from numpy.typing import NDArray


def patches(labels: NDArray[np.uint8]) -> Iterator[tuple[int, NDArray[np.bool_]]]:
    """Class index and mask, (H, W) bool, of each patch in (H, W) uint8 labels; diagonal neighbours are connected."""
    for index in np.unique(labels[labels > 0]):
        count, numbers = cv2.connectedComponents((labels == index).astype(np.uint8), connectivity=8)
        for number in range(1, count):
            yield int(index), numbers == number
