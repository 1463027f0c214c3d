"""Crops of renders as a real camera might have taken them: scale, light, colour cast, noise, blur, compression."""

import cv2
import numpy as np
from numpy.typing import NDArray

from grasping_invisible.training.patches import patches
from grasping_invisible.training.renders import Views

SCALES = (0.7, 1.5)  # of a crop; below 1 the image grows
SMALLEST_PATCH = 10  # pixels of a patch that crops are drawn around


def draw_crop(rng: np.random.Generator, piles: list[Views], size: int) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """One augmented square crop, (size, size, 3) uint8 RGB, and its labels, (size, size) uint8.

    Two crops in three are centred near a pixel of some block, so that the table does not fill the batch; half of these
    near a patch, a small one rather than a large one.
    """
    pile = piles[rng.integers(len(piles))]
    view = int(rng.integers(len(pile.color)))
    window = _window(rng, pile.labels[view], size)
    color = cv2.resize(pile.color[view][window], (size, size), interpolation=cv2.INTER_AREA)
    labels = cv2.resize(pile.labels[view][window], (size, size), interpolation=cv2.INTER_NEAREST)
    if rng.random() < 0.5:
        color, labels = color[:, ::-1], labels[:, ::-1]
    return distort(rng, np.ascontiguousarray(color, np.uint8)), np.ascontiguousarray(labels, np.uint8)


def distort(rng: np.random.Generator, color: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Change an image (H, W, 3) uint8 as optics, exposure, sensor and compression do. One in six is left alone."""
    if rng.random() < 1 / 6:
        return color
    image = color.astype(np.float32)
    if rng.random() < 0.5:
        image *= _shading(rng, image.shape[:2])[..., None]
    gain = rng.uniform(0.75, 1.2) * rng.uniform(0.94, 1.06, 3)
    image = image * gain.astype(np.float32) + np.float32(rng.uniform(-12, 12))
    if rng.random() < 0.4:
        image = cv2.GaussianBlur(image, (0, 0), rng.uniform(0.4, 1.3))
    if rng.random() < 0.7:
        image = image + rng.standard_normal(image.shape, np.float32) * np.float32(rng.uniform(1, 9))
    image = np.clip(image, 0, 255).astype(np.uint8)
    if rng.random() < 0.3:
        _, packed = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(50, 95))])
        image = np.asarray(cv2.imdecode(packed, cv2.IMREAD_COLOR), np.uint8)
    return image


def _window(rng: np.random.Generator, labels: NDArray[np.uint8], size: int) -> tuple[slice, slice]:
    """A square of the image, to be resized to `size`."""
    height, width = labels.shape
    side = min(int(size * rng.uniform(*SCALES)), height, width)
    middle = rng.integers(0, (height, width))
    share = rng.random()
    if share < 2 / 3:
        rows, columns = np.nonzero(labels if share < 1 / 3 else _some_patch(rng, labels))
        if len(rows):
            chosen = rng.integers(len(rows))
            middle = np.array([rows[chosen], columns[chosen]]) + rng.integers(-side // 3, side // 3 + 1, 2)
    top = int(np.clip(middle[0] - side // 2, 0, height - side))
    left = int(np.clip(middle[1] - side // 2, 0, width - side))
    return slice(top, top + side), slice(left, left + side)


def _some_patch(rng: np.random.Generator, labels: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """The mask of one patch, drawn in inverse proportion to its width, about; empty where there is none."""
    masks = [mask for _, mask in patches(labels) if np.count_nonzero(mask) >= SMALLEST_PATCH]
    if not masks:
        return np.zeros_like(labels, np.bool_)
    odds = np.array([np.count_nonzero(mask) for mask in masks]) ** -0.5
    return masks[rng.choice(len(masks), p=odds / odds.sum())]


def _shading(rng: np.random.Generator, shape: tuple[int, int]) -> NDArray[np.float32]:
    """Uneven light: a few soft patches, (H, W) float32 around 1."""
    patches = rng.uniform(0.75, 1.15, (4, 4)).astype(np.float32)
    return np.asarray(cv2.resize(patches, shape[::-1], interpolation=cv2.INTER_CUBIC), np.float32)
