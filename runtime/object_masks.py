"""Which cells belong together as one object, told by steps in height and by colour classes alone."""

import cv2
import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.target_border import GROUND_HEIGHT
from grasping_invisible.runtime.heightmap import Heightmaps

STEP = 0.008  # metres of height between neighbouring cells that part two objects
SMALLEST = 1.6e-4  # square metres, 40 cells; smaller patches are edges and shadows


def object_masks(maps: Heightmaps) -> list[NDArray[np.bool_]]:
    """Masks, (N, N) bool each, of the objects that can be told apart, the largest visible one first.

    Blocks of one height and no class that touch each other count as one.
    """
    above = np.asarray(cv2.medianBlur(maps.height, 3), np.float32)
    around = np.ones((3, 3), np.uint8)
    step = cv2.morphologyEx(above, cv2.MORPH_GRADIENT, around) > STEP
    seam = cv2.morphologyEx(maps.labels, cv2.MORPH_GRADIENT, around) > 0
    inner = (above > GROUND_HEIGHT) & ~step & ~seam
    count, patches, statistics, _ = cv2.connectedComponentsWithStats(inner.astype(np.uint8), connectivity=4)
    areas = np.asarray(statistics)[:, cv2.CC_STAT_AREA]
    fewest = SMALLEST / maps.workspace.resolution**2
    large = sorted((patch for patch in range(1, count) if areas[patch] >= fewest), key=lambda patch: -areas[patch])
    # What the parting took from each patch's rim, it gets back.
    grown = [cv2.dilate((np.asarray(patches) == patch).astype(np.uint8), around) > 0 for patch in large]
    return [mask & (above > GROUND_HEIGHT) for mask in grown]
