import math

import numpy as np
import pytest

from grasping_invisible.runtime.frame import Camera, RgbdFrame
from grasping_invisible.runtime.perception import (
    MIN_PATCH_PIXELS,
    MIN_TARGET_PIXELS,
    perceive,
    target_patches,
)
from grasping_invisible.runtime.workspace import Workspace

# A camera 0.6 m over the middle of the workspace, looking down: about one millimetre a pixel.
CAMERA = Camera(
    640,
    480,
    np.array([[600.0, 0, 320], [0, 600, 240], [0, 0, 1]]),
    np.array([[1.0, 0, 0, 0.53], [0, -1, 0, 0], [0, 0, -1, 0.6], [0, 0, 0, 1]]),
)


class Painted:
    """A segmenter that sees what it is given."""

    def __init__(self, *patches: tuple[slice, slice], label: int = 1) -> None:
        self.labels = np.zeros((480, 640), np.uint8)
        for patch in patches:
            self.labels[patch] = label

    def segment(self, color: np.ndarray) -> np.ndarray:
        return self.labels


def perceived(segmenter: Painted, target: str = "red", unmeasured: tuple[slice, slice] | None = None):
    frame = RgbdFrame(3, np.zeros((480, 640, 3), np.uint8), np.full((480, 640), 0.57, np.float32), CAMERA)
    if unmeasured is not None:
        frame.depth[unmeasured] = 0
    return perceive(frame, segmenter, target, Workspace())


def test_a_target_is_seen_where_it_is():
    seen = perceived(Painted(np.s_[230:250, 310:330]))
    assert seen.target_seen
    assert seen.target_pixels == 400
    rows, columns = np.nonzero(seen.mask)
    # 30 mm high, under the camera's axis: the middle of the workspace.
    assert abs(rows.mean() - 111.5) < 1.5
    assert abs(columns.mean() - 111.5) < 1.5
    assert seen.maps.height[112, 112] == pytest.approx(0.03, abs=1e-4)
    assert set(seen.stage_ms) == {"segment", "project"}


def test_another_colour_is_not_the_target():
    seen = perceived(Painted(np.s_[230:250, 310:330], label=2))
    assert not seen.target_seen
    assert seen.target_pixels == 0
    assert (seen.maps.labels == 2).any()


def test_speckle_is_not_a_target():
    speckle = [np.s_[y : y + 5, x : x + 5] for y in (100, 200, 300) for x in (100, 200, 300, 400)]
    seen = perceived(Painted(*speckle))
    assert MIN_PATCH_PIXELS > 25
    assert not seen.target_seen
    assert seen.target_pixels == 0
    assert not (seen.maps.labels == 1).any()
    assert (seen.labels == 1).sum() == 25 * 12  # the segmentation is kept as it was


def test_speckle_beside_a_target_is_removed_from_its_mask():
    seen = perceived(Painted(np.s_[230:250, 310:330], np.s_[100:104, 200:204]))
    assert seen.target_pixels == 400
    rows, _ = np.nonzero(seen.mask)
    assert rows.min() > 90


def test_a_single_patch_must_be_large_enough():
    assert MIN_PATCH_PIXELS <= 49 < MIN_TARGET_PIXELS
    seen = perceived(Painted(np.s_[230:237, 310:317]))
    assert seen.target_pixels == 49
    assert not seen.target_seen


def test_a_target_beside_the_workspace_is_not_seen():
    seen = perceived(Painted(np.s_[230:250, 610:638]))
    assert seen.target_pixels == 20 * 28
    assert not seen.target_seen
    assert not seen.target_found


def test_a_target_under_something_else_is_found_but_cannot_be_acted_on():
    """Seen askew, the red side of a block lies below the edge of what is on top of it."""
    tilt = math.radians(45)
    pose = np.eye(4)
    pose[:3, :3] = [[1, 0, 0], [0, -math.sin(tilt), math.cos(tilt)], [0, -math.cos(tilt), -math.sin(tilt)]]
    pose[:3, 3] = (0.53, -0.4, 0.4)
    camera = Camera(640, 480, CAMERA.intrinsics, pose)
    depth = np.full((480, 640), 5.0, np.float32)  # far away
    side, lid = np.s_[240:260, 300:340], np.s_[180:240, 290:350]
    depth[side] = 0.55
    # Above every point of the side, and higher.
    depth[lid] = 0.55 - (240 - np.arange(180, 240))[:, None] * 0.0012
    frame = RgbdFrame(3, np.zeros((480, 640, 3), np.uint8), depth, camera)
    alone = RgbdFrame(3, frame.color, np.where(Painted(side).labels > 0, depth, 5.0).astype(np.float32), camera)
    assert perceive(alone, Painted(side), "red", Workspace()).target_seen
    under = perceive(frame, Painted(side), "red", Workspace())
    assert not under.target_seen
    assert under.target_found
    rows, columns = np.nonzero(under.glimpse)
    seen_rows, seen_columns = np.nonzero(perceive(alone, Painted(side), "red", Workspace()).mask)
    assert math.dist((rows.mean(), columns.mean()), (seen_rows.mean(), seen_columns.mean())) < 2  # cells of 2 mm
    highest = perceive(alone, Painted(side), "red", Workspace())
    assert under.hint_height == pytest.approx(highest.maps.height[highest.mask].max(), abs=0.003)


@pytest.mark.parametrize(("pixels", "hint"), [(4, True), (3, False)])
def test_a_few_pixels_are_a_hint_and_speckle_is_none(pixels, hint):
    seen = perceived(Painted(np.s_[230:231, 310 : 310 + pixels]))
    assert not seen.target_found
    assert seen.hint.any() == hint
    assert not seen.glimpse.any()


def test_patches_touching_at_a_corner_are_one():
    image = np.zeros((40, 40), bool)
    image[0:4, 0:5] = image[4:8, 5:10] = True
    assert target_patches(image).sum() == 40
    image[8, 39] = True
    assert target_patches(image).sum() == 40
    assert not target_patches(np.zeros((40, 40), bool)).any()


def test_a_target_is_beyond_the_workspace_where_it_is_measured_and_no_part_of_it_is_near() -> None:
    middle, far, near = np.s_[200:230, 300:330], np.s_[200:230, 595:625], np.s_[200:230, 560:590]  # it ends at 556
    assert perceived(Painted(far)).target_beyond
    assert not perceived(Painted(near)).target_beyond  # it may reach in, under something
    assert not perceived(Painted(near, far)).target_beyond
    assert not perceived(Painted(middle, far)).target_beyond
    assert not perceived(Painted(middle), unmeasured=middle).target_beyond  # it lies nobody knows where
    assert not perceived(Painted(far), unmeasured=far).target_beyond
    assert not perceived(Painted(np.s_[200:209, 600:611])).target_beyond  # 99 pixels
