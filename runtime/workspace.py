"""The workspace on the table and its grid of heightmap cells.

Frames: base frame `panda_link0`, metres, z up. Heightmaps are images seen from above with +x to the
right and +y up: row 0 lies at the largest y, column 0 at the smallest x.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Workspace:
    """A square on the table top, `size` metres wide, cut into cells of `resolution` metres.

    `center` is its middle on the table top in the base frame, metres.
    """

    center: tuple[float, float, float] = (0.53, 0.0, 0.0)
    size: float = 0.448
    resolution: float = 0.002

    @property
    def cells(self) -> int:
        """Cells along one side of a heightmap (224)."""
        return round(self.size / self.resolution)

    @property
    def low(self) -> tuple[float, float]:
        """Smallest x and y inside, base frame, metres."""
        return self.center[0] - self.size / 2, self.center[1] - self.size / 2

    @property
    def high(self) -> tuple[float, float]:
        """Largest x and y inside, base frame, metres."""
        return self.center[0] + self.size / 2, self.center[1] + self.size / 2

    def contains(self, x: float, y: float, inset: float = 0.0) -> bool:
        """Whether a point of the base frame lies over the workspace, and so far inside its edge; metres."""
        (low_x, low_y), (high_x, high_y) = self.low, self.high
        return low_x + inset <= x < high_x - inset and low_y + inset < y <= high_y - inset

    def cell_center(self, row: float, column: float) -> tuple[float, float]:
        """The (x, y) in the base frame, metres, of the middle of a cell."""
        return (
            self.low[0] + (column + 0.5) * self.resolution,
            self.high[1] - (row + 0.5) * self.resolution,
        )

    def cell_centers(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The x of the middles of every column's cells, (N,), and the y of every row's, (N, 1); base frame, metres."""
        cells = np.arange(self.cells) + 0.5
        x = self.low[0] + cells * self.resolution
        y = self.high[1] - cells[:, None] * self.resolution
        return np.asarray(x, np.float64), np.asarray(y, np.float64)

    def middle_of(self, cells: NDArray[np.bool_]) -> tuple[float, float]:
        """The (x, y) in the base frame, metres, of the middle of some heightmap cells, (N, N), not all false."""
        row, column = np.argwhere(cells).mean(axis=0)
        return self.cell_center(float(row), float(column))

    def cell_of(self, x: float, y: float) -> tuple[int, int]:
        """The (row, column) of the cell holding a point of the base frame; may lie outside the grid."""
        return (
            int(np.floor((self.high[1] - y) / self.resolution)),
            int(np.floor((x - self.low[0]) / self.resolution)),
        )
