"""How cluttered the surroundings of the target are (paper, sections IV-B and V-B)."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

BORDER_WIDTH = 0.020  # metres around the target that a finger needs
# Between the mask and the border, metres: the outermost points of the target itself, where a segmenter is
# unsure.
GUARD_WIDTH = 0.002
GROUND_HEIGHT = 0.008  # metres; below this a cell is table, within the depth camera's noise


@dataclass(frozen=True)
class TargetBorder:
    """Counts of heightmap cells in and around the target.

    `occupied`: o_b, border cells with something on them. `border`: the sum of m_b. `target`: the sum of m_t.
    """

    occupied: int
    border: int
    target: int

    @property
    def ratio(self) -> float:
        """Border occupancy ratio r_b = o_b / sum(m_b), 0 to 1."""
        return self.occupied / self.border if self.border else 0.0

    @property
    def norm(self) -> float:
        """Border occupancy norm n_b = o_b / sum(m_t)."""
        return self.occupied / self.target if self.target else 0.0


def target_border(height: NDArray[np.float32], mask: NDArray[np.bool_], resolution: float = 0.002) -> TargetBorder:
    """Measure the border of the target; all counts are 0 where there is no target.

    `height`: (N, N), metres above the table. `mask`: (N, N) bool, the target's cells. `resolution`: metres a
    cell. A border cell is occupied when whatever lies in it stands higher than `GROUND_HEIGHT`, be it beside
    the target or on top of it; cells that the camera does not see are 0 high and count as free.
    """
    around = border_mask(mask, resolution)
    return TargetBorder(
        occupied=int(np.count_nonzero(around & (height > GROUND_HEIGHT))),
        border=int(np.count_nonzero(around)),
        target=int(np.count_nonzero(mask)),
    )


def border_mask(mask: NDArray[np.bool_], resolution: float = 0.002) -> NDArray[np.bool_]:
    """The target border m_b, (N, N) bool: beyond the guard and within the border width of the mask."""
    if not mask.any():
        return np.zeros(mask.shape, np.bool_)
    distance = resolution * distance_to(mask)
    tolerance = 1e-3 * resolution  # distances are float32
    return (distance > GUARD_WIDTH + tolerance) & (distance <= BORDER_WIDTH + tolerance)


def distance_to(mask: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Euclidean distance, in cells, of every cell to the nearest cell of a mask that is not empty."""
    distance = cv2.distanceTransform((~mask).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return np.asarray(distance, np.float32)
