import numpy as np
import pytest

from grasping_invisible.runtime.errors import RobotError
from grasping_invisible.runtime.frame import Camera, RgbdFrame
from grasping_invisible.runtime.view import QUARTERS, check_view, view_of
from grasping_invisible.runtime.workspace import Workspace

WORKSPACE = Workspace()
HEIGHT = 0.8


def frame(depth: float = HEIGHT, camera_height: float = HEIGHT, tilt: float = 0.0) -> RgbdFrame:
    """From straight above the middle of the workspace, of a table with a board on it.

    `tilt`: radians by which the camera is said to look farther ahead than it does.
    """
    x, y, z = WORKSPACE.center
    pose = np.array([[0.0, -1, 0, x], [-1, 0, 0, y], [0, 0, -1, z + camera_height], [0, 0, 0, 1]])
    # About the middle of the table.
    about = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -HEIGHT], [0, 0, 0, 1]])
    turn = np.eye(4)
    turn[1:3, 1:3] = [[np.cos(tilt), -np.sin(tilt)], [np.sin(tilt), np.cos(tilt)]]
    pose = pose @ np.linalg.inv(about) @ turn @ about
    camera = Camera(320, 240, np.array([[300.0, 0, 159.5], [0, 300.0, 119.5], [0, 0, 1]]), pose)
    color = np.full((240, 320, 3), 90, np.uint8)
    color[100:140, 100:200] = 200
    return RgbdFrame(1, color, np.full((240, 320), depth, np.float32), camera)


def test_a_whole_view_has_its_floor_at_the_table() -> None:
    view = view_of(frame(), WORKSPACE)
    assert view.share > 0.95
    assert view.floors == pytest.approx(dict.fromkeys(QUARTERS[0] + QUARTERS[1], 0.0), abs=1e-6)
    check_view(frame(), WORKSPACE)


@pytest.mark.parametrize("off", [-0.15, 0.05])
def test_a_camera_at_another_height_shows_the_table_off(off: float) -> None:
    floors = view_of(frame(camera_height=HEIGHT + off), WORKSPACE).floors
    assert list(floors.values()) == pytest.approx([off] * 4, abs=1e-6)


def test_a_tilted_camera_shows_one_side_high_and_the_other_low() -> None:
    floors = view_of(frame(tilt=np.radians(-2.2)), WORKSPACE).floors
    assert floors["near left"] == pytest.approx(floors["near right"], abs=1e-3)
    assert abs(floors["far left"] - floors["near left"]) > 0.007
    assert max(map(abs, floors.values())) > 0.007


def test_the_share_is_of_what_is_measured() -> None:
    half = frame()
    half.depth[:, :160] = 0.0
    view = view_of(half, WORKSPACE)
    assert view.share == pytest.approx(0.5, abs=0.05)
    assert sorted(view.floors) == ["far right", "near right"]


def test_what_is_too_tall_for_heightmaps_is_an_error_and_not_free_table() -> None:
    tall = frame()
    tall.depth[100:140, 140:180] = HEIGHT - 0.35
    with pytest.raises(RobotError, match=r"something at x 0\.5\d, y -?0\.0\d m is more than 0\.3 m above the table"):
        check_view(tall, WORKSPACE)
    tall.depth[100:140, 140:180] = HEIGHT - 0.28
    check_view(tall, WORKSPACE)
    speckled = frame()
    speckled.depth[8::40, 8::40] = HEIGHT - 0.35
    check_view(speckled, WORKSPACE)


def test_an_arm_that_waits_over_the_near_edge_is_no_clutter() -> None:
    waiting = frame()
    waiting.depth[228:, 130:190] = HEIGHT - 0.32
    check_view(waiting, WORKSPACE)
    waiting.depth[208:, 130:190] = HEIGHT - 0.32
    with pytest.raises(RobotError, match="too tall"):
        check_view(waiting, WORKSPACE)


def test_a_blind_camera_is_an_error() -> None:
    with pytest.raises(RobotError, match="the depth image shows 0% of the workspace"):
        check_view(frame(depth=0.0), WORKSPACE)
    dark = frame()
    dark.color[:] = 0
    with pytest.raises(RobotError, match="is the lens covered"):
        check_view(dark, WORKSPACE)
