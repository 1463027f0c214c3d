"""What the robot makes of one camera frame: labels, heightmaps, and where the target is, if it is seen."""

from dataclasses import dataclass, replace
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.classes import CLASSES
from grasping_invisible.runtime.frame import RgbdFrame
from grasping_invisible.runtime.heightmap import Heightmaps, project, shown_points
from grasping_invisible.runtime.stopwatch import Stopwatch
from grasping_invisible.runtime.workspace import Workspace

# Below these the target counts as not seen: a segmenter's speckle must not end an exploration. At the usual
# distance a pixel covers a little over one square millimetre of the table.
MIN_PATCH_PIXELS = 30  # of one connected patch; smaller ones are ignored
MIN_HINT_PIXELS = 4  # of one connected patch: where to look for the target, until it is seen
MIN_TARGET_PIXELS = 100  # of all remaining patches together
MIN_TARGET_CELLS = 16  # of the heightmap, after projection: the target lies in the workspace
BEYOND = 0.03  # metres outside the workspace, half of a large target: what shows no nearer has left it


class Segmenter(Protocol):
    """Whatever labels the pixels of an image."""

    def segment(self, color: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Class index of every pixel, (H, W) uint8, of an (H, W, 3) uint8 RGB image."""
        ...


@dataclass(frozen=True)
class Perception:
    """One frame, understood.

    `labels`: (H, W) uint8 class index of every pixel, as segmented. `maps`: heightmaps; the target's speckle
    is removed from their labels. `mask`: (N, N) bool, the target's heightmap cells, all false when it is not
    seen. `patches`: (H, W) bool, the target's pixels in the image, without speckle, wherever they lie. `target_beyond`:
    they are of something that lies farther than `BEYOND` outside the workspace. `stage_ms`: time each stage took.
    `glimpse`: (N, N) bool, the cells over which it shows in the image, though from above something else covers it; all
    false when it is seen, or not at all. `hint`: the same for however little of it, too little to count; `hint_height`:
    how far up above the table it reaches there, metres.
    """

    labels: NDArray[np.uint8]
    maps: Heightmaps
    mask: NDArray[np.bool_]
    patches: NDArray[np.bool_]
    target_beyond: bool
    glimpse: NDArray[np.bool_]
    hint: NDArray[np.bool_]
    hint_height: float
    stage_ms: dict[str, float]

    @property
    def target_pixels(self) -> int:
        """How much of the target shows in the image."""
        return int(np.count_nonzero(self.patches))

    @property
    def target_found(self) -> bool:
        """Whether the target shows at all, be it only its side, with something lying on top of it."""
        return self.target_seen or self.target_glimpsed

    @property
    def target_glimpsed(self) -> bool:
        """Whether it shows in the image and lies in the workspace, but under something else."""
        return bool(self.glimpse.any())

    @property
    def target_seen(self) -> bool:
        """Whether enough of the target shows from above to act on it."""
        return bool(self.mask.any())


def perceive(frame: RgbdFrame, segmenter: Segmenter, target: str, workspace: Workspace) -> Perception:
    """Segment a frame and project it. `target`: a name in `CLASSES`."""
    watch = Stopwatch()
    index = CLASSES.index(target)
    labels = segmenter.segment(frame.color)
    watch.lap("segment")
    is_target = labels == index
    patches = target_patches(is_target)
    cleaned = labels.copy()
    cleaned[is_target & ~patches] = 0
    maps = project(frame, cleaned, workspace)
    pixels = int(np.count_nonzero(patches))
    mask = maps.labels == index
    if pixels < MIN_TARGET_PIXELS or np.count_nonzero(mask) < MIN_TARGET_CELLS:
        mask = np.zeros_like(mask)
    glimpse = hint = np.zeros_like(mask)
    hint_height = 0.0
    if not mask.any() and is_target.any():
        shown = shown_points(frame, target_patches(is_target, MIN_HINT_PIXELS), workspace)
        hint, hint_height = shown.over > 0, shown.height
    beyond = False
    if not mask.any() and pixels >= MIN_TARGET_PIXELS:
        points = shown_points(frame, patches, workspace).over
        glimpse = points > 0 if points.sum() >= MIN_TARGET_PIXELS else glimpse
        beyond = not points.any() and _lies_beyond(frame, patches, workspace)
    watch.lap("project")
    return Perception(labels, maps, mask, patches, beyond, glimpse, hint, hint_height, watch.laps)


def _lies_beyond(frame: RgbdFrame, patches: NDArray[np.bool_], workspace: Workspace) -> bool:
    """Whether enough of the target is measured, and nothing of it within `BEYOND` of the workspace."""
    if np.count_nonzero(frame.depth[patches] > 0) < MIN_TARGET_PIXELS:
        return False
    reach = replace(workspace, size=workspace.size + 2 * BEYOND)
    return not shown_points(frame, patches, reach).over.any()


def target_patches(is_target: NDArray[np.bool_], smallest: int = MIN_PATCH_PIXELS) -> NDArray[np.bool_]:
    """The target's pixels, (H, W) bool, without connected patches of fewer than `smallest`."""
    if not is_target.any():
        return is_target
    x, y, width, height = cv2.boundingRect(is_target.astype(np.uint8))
    box = np.s_[y : y + height, x : x + width]
    _, patch, statistics, _ = cv2.connectedComponentsWithStats(is_target[box].astype(np.uint8), connectivity=8)
    large = np.asarray(statistics)[:, cv2.CC_STAT_AREA] >= smallest
    large[0] = False  # what is not target
    patches = np.zeros_like(is_target)
    patches[box] = large[np.asarray(patch, np.intp)]
    return patches
