"""How much of the workspace a camera frame shows: of what nobody saw, nothing can be decided or judged."""

from dataclasses import dataclass

import numpy as np

from grasping_invisible.runtime.errors import RobotError
from grasping_invisible.runtime.frame import RgbdFrame
from grasping_invisible.runtime.heightmap import points_in
from grasping_invisible.runtime.workspace import Workspace

LEAST_SHARE = 0.2  # of the workspace, that a frame has to measure
LEAST_CONTRAST = 1.0  # standard deviation of a colour image, of 255; a lens that is covered has less
PARTS = 32  # along each side of the workspace, of which it is asked whether they are seen
SAMPLED = 120  # rows of pixels, about, that are enough for that
FLOOR_PERCENTILE = 10.0


@dataclass(frozen=True)
class View:
    """`share`: of the workspace that a frame measures, 0 to 1. `floor`: metres above the table top, negative below it,
    of the lower parts of what it measures there; 0 where that is nothing.
    """

    share: float
    floor: float


def view_of(frame: RgbdFrame, workspace: Workspace) -> View:
    """What a frame's depth image shows of the workspace."""
    rows, columns, heights = points_in(frame, workspace, max(1, frame.depth.shape[0] // SAMPLED))
    if not len(heights):
        return View(0.0, 0.0)
    to_part = PARTS / workspace.cells
    seen = np.zeros((PARTS, PARTS), np.bool_)
    seen[(rows * to_part).astype(np.intp), (columns * to_part).astype(np.intp)] = True
    return View(float(seen.mean()), float(np.percentile(heights, FLOOR_PERCENTILE)))


def check_view(frame: RgbdFrame, workspace: Workspace) -> None:
    """Raises `RobotError` where a frame shows next to nothing: a target that is not seen in it has not gone."""
    share = view_of(frame, workspace).share
    if share < LEAST_SHARE:
        raise RobotError(
            f"the depth image shows {share:.0%} of the workspace, and {LEAST_SHARE:.0%} are the least to act on; "
            "gi-robot check looks into it"
        )
    if frame.color[::8, ::8].std() < LEAST_CONTRAST:
        raise RobotError("the colour image is of one colour all over: is the lens covered?")
