"""How much of the workspace a camera frame shows: of what nobody saw, nothing can be decided or judged."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from grasping_invisible.runtime.errors import RobotError
from grasping_invisible.runtime.frame import RgbdFrame
from grasping_invisible.runtime.heightmap import MAX_HEIGHT, points_in
from grasping_invisible.runtime.workspace import Workspace

LEAST_SHARE = 0.2  # of the workspace, that a frame has to measure
LEAST_CONTRAST = 1.0  # standard deviation of a colour image, of 255; a lens that is covered has less
PARTS = 32  # along each side of the workspace, of which it is asked whether they are seen
SAMPLED = 120  # rows of pixels, about, that are enough for that
FLOOR_PERCENTILE = 10.0
# Adjoining parts, 12 cm2, that are too tall to be clutter: of less, depth cameras see some where nothing is.
TALL_PARTS = 6
HAND_PARTS = 4  # at the workspace's near edge, 5.6 cm: so far an arm that waits at home may reach over it
# Of the heightmap's rows and columns, as somebody behind the arm sees them: rows begin at the left, columns at the arm.
QUARTERS = (("near left", "far left"), ("near right", "far right"))


@dataclass(frozen=True)
class View:
    """`share`: of the workspace that a frame measures, 0 to 1. `floors`: of each quarter of which it measures enough,
    by its name, the height of the lower parts of what is there: metres above the table top, negative below it.
    """

    share: float
    floors: dict[str, float]


@dataclass(frozen=True, eq=False)
class _Points:
    """Points over the workspace: `row` and `column` among `PARTS`, `height` above the table, metres; (P,) each."""

    row: NDArray[np.intp]
    column: NDArray[np.intp]
    height: NDArray[np.float32]

    def that(self, are: NDArray[np.bool_]) -> "_Points":
        """Some of them, by a (P,) mask."""
        return _Points(self.row[are], self.column[are], self.height[are])

    def parts(self) -> NDArray[np.bool_]:
        """Over which parts of the workspace they are, (`PARTS`, `PARTS`)."""
        parts = np.zeros((PARTS, PARTS), np.bool_)
        parts[self.row, self.column] = True
        return parts


def view_of(frame: RgbdFrame, workspace: Workspace) -> View:
    """What a frame's depth image shows of the workspace."""
    points = _clutter(_points_of(frame, workspace))
    seen = points.parts()
    floors = {}
    half = PARTS // 2
    for (down, right), name in np.ndenumerate(QUARTERS):
        quarter = seen[down * half :, right * half :][:half, :half]
        if quarter.mean() >= LEAST_SHARE:
            inside = points.that((points.row // half == down) & (points.column // half == right))
            floors[str(name)] = float(np.percentile(inside.height, FLOOR_PERCENTILE))
    return View(float(seen.mean()), floors)


def check_view(frame: RgbdFrame, workspace: Workspace) -> None:
    """Raises `RobotError` where a frame shows next to nothing: a target that is not seen in it has not gone.

    And where something stands in the workspace that is too tall for heightmaps: its place would look free.
    """
    points = _points_of(frame, workspace)
    share = _clutter(points).parts().mean()
    if share < LEAST_SHARE:
        raise RobotError(
            f"the depth image shows {share:.0%} of the workspace, and {LEAST_SHARE:.0%} are the least to act on; "
            "gi-robot check looks into it"
        )
    if frame.color[::8, ::8].std() < LEAST_CONTRAST:
        raise RobotError("the colour image is of one colour all over: is the lens covered?")
    tall = _tall_place(points, workspace)
    if tall is not None:
        raise RobotError(
            f"something at x {tall[0]:.2f}, y {tall[1]:.2f} m is more than {MAX_HEIGHT:g} m above the table: too tall "
            "to be seen as clutter; take it away"
        )


def _clutter(points: _Points) -> _Points:
    """Those that heightmaps show."""
    return points.that(points.height <= MAX_HEIGHT)


def _tall_place(points: _Points, workspace: Workspace) -> tuple[float, float] | None:
    """Where something stands that is taller than heightmaps show, (x, y) in metres, base frame, if anywhere."""
    tall = points.that((points.height > MAX_HEIGHT) & (points.column >= HAND_PARTS)).parts()
    _, _, statistics, centroids = cv2.connectedComponentsWithStats(tall.astype(np.uint8), connectivity=8)
    areas = statistics[1:, cv2.CC_STAT_AREA]  # without what is not tall
    if not len(areas) or areas.max() < TALL_PARTS:
        return None
    middle_column, middle_row = (float(middle) + 0.5 for middle in centroids[1 + areas.argmax()])
    size = workspace.size / PARTS
    return workspace.low[0] + middle_column * size, workspace.high[1] - middle_row * size


def _points_of(frame: RgbdFrame, workspace: Workspace) -> _Points:
    rows, columns, heights = points_in(frame, workspace, max(1, frame.depth.shape[0] // SAMPLED))
    row, column = (at.astype(np.intp) * PARTS // workspace.cells for at in (rows, columns))
    return _Points(row, column, heights)
