import numpy as np
import pytest

from grasping_invisible.runtime.errors import RobotError
from grasping_invisible.runtime.frame import Camera, RgbdFrame
from grasping_invisible.runtime.view import check_view, view_of
from grasping_invisible.runtime.workspace import Workspace

WORKSPACE = Workspace()
HEIGHT = 0.8


def frame(depth: float = HEIGHT, camera_height: float = HEIGHT) -> RgbdFrame:
    """From straight above the middle of the workspace, of a table with a board on it."""
    x, y, z = WORKSPACE.center
    pose = np.array([[0.0, -1, 0, x], [-1, 0, 0, y], [0, 0, -1, z + camera_height], [0, 0, 0, 1]])
    camera = Camera(320, 240, np.array([[300.0, 0, 159.5], [0, 300.0, 119.5], [0, 0, 1]]), pose)
    color = np.full((240, 320, 3), 90, np.uint8)
    color[100:140, 100:200] = 200
    return RgbdFrame(1, color, np.full((240, 320), depth, np.float32), camera)


def test_a_whole_view_has_its_floor_at_the_table() -> None:
    view = view_of(frame(), WORKSPACE)
    assert view.share > 0.95
    assert view.floor == pytest.approx(0.0, abs=1e-6)
    check_view(frame(), WORKSPACE)


@pytest.mark.parametrize("off", [-0.15, 0.05])
def test_a_camera_at_another_height_shows_the_table_off(off: float) -> None:
    assert view_of(frame(camera_height=HEIGHT + off), WORKSPACE).floor == pytest.approx(off, abs=1e-6)


def test_the_share_is_of_what_is_measured() -> None:
    half = frame()
    half.depth[:, :160] = 0.0
    assert view_of(half, WORKSPACE).share == pytest.approx(0.5, abs=0.05)


def test_a_blind_camera_is_an_error() -> None:
    with pytest.raises(RobotError, match="the depth image shows 0% of the workspace"):
        check_view(frame(depth=0.0), WORKSPACE)
    dark = frame()
    dark.color[:] = 0
    with pytest.raises(RobotError, match="is the lens covered"):
        check_view(dark, WORKSPACE)
