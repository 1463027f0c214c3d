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


def view_of(frame: RgbdFrame, workspace: Workspace) -> View:
    """What a frame's depth image shows of the workspace."""
    row, column, heights = _parts_in(frame, workspace)
    clutter = heights <= MAX_HEIGHT
    row, column, heights = row[clutter], column[clutter], heights[clutter]
    seen = np.zeros((PARTS, PARTS), np.bool_)
    seen[row, column] = True
    floors = {}
    half = PARTS // 2
    for (down, right), name in np.ndenumerate(QUARTERS):
        quarter = seen[down * half :, right * half :][:half, :half]
        if quarter.mean() >= LEAST_SHARE:
            inside = (row // half == down) & (column // half == right)
            floors[str(name)] = float(np.percentile(heights[inside], FLOOR_PERCENTILE))
    return View(float(seen.mean()), floors)


def check_view(frame: RgbdFrame, workspace: Workspace) -> None:
    """Raises `RobotError` where a frame shows next to nothing: a target that is not seen in it has not gone.

    And where something stands in the workspace that is too tall for heightmaps: its place would look free.
    """
    share = view_of(frame, workspace).share
    if share < LEAST_SHARE:
        raise RobotError(
            f"the depth image shows {share:.0%} of the workspace, and {LEAST_SHARE:.0%} are the least to act on; "
            "gi-robot check looks into it"
        )
    if frame.color[::8, ::8].std() < LEAST_CONTRAST:
        raise RobotError("the colour image is of one colour all over: is the lens covered?")
    tall = _tall_place(frame, workspace)
    if tall is not None:
        raise RobotError(
            f"something at x {tall[0]:.2f}, y {tall[1]:.2f} m is more than {MAX_HEIGHT:g} m above the table: too tall "
            "to be seen as clutter; take it away"
        )


def _tall_place(frame: RgbdFrame, workspace: Workspace) -> tuple[float, float] | None:
    """Where something stands that is taller than heightmaps show, (x, y) in metres, base frame, if anywhere."""
    row, column, heights = _parts_in(frame, workspace)
    above = (heights > MAX_HEIGHT) & (column >= HAND_PARTS)
    tall = np.zeros((PARTS, PARTS), np.uint8)
    tall[row[above], column[above]] = 1
    _, _, statistics, centroids = cv2.connectedComponentsWithStats(tall, connectivity=8)
    areas = statistics[1:, cv2.CC_STAT_AREA]  # without what is not tall
    if not len(areas) or areas.max() < TALL_PARTS:
        return None
    middle_column, middle_row = (float(middle) + 0.5 for middle in centroids[1 + areas.argmax()])
    size = workspace.cells * workspace.resolution / PARTS
    return workspace.low[0] + middle_column * size, workspace.high[1] - middle_row * size


def _parts_in(frame: RgbdFrame, workspace: Workspace) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float32]]:
    """Row and column among `PARTS` of points over the workspace, and height above the table, metres; (P,) each."""
    rows, columns, heights = points_in(frame, workspace, max(1, frame.depth.shape[0] // SAMPLED))
    row, column = (at.astype(np.intp) * PARTS // workspace.cells for at in (rows, columns))
    return row, column, heights
