import numpy as np
import pytest

from grasping_invisible.data.classes import CLASSES
from grasping_invisible.data.clock import to_timestamp
from grasping_invisible.data.heightmap_message import HeightmapArrays, encode_heightmaps
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.steps import LoggedStep
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.workspace import Workspace
from grasping_invisible.training.transitions import Transition, grasped_class, transitions_of

RED, BLUE = CLASSES.index("red"), CLASSES.index("blue")
RED_AT, BLUE_AT = (56, 40), (56, 70)  # rows and columns of the action grid


def scene(*blocks: tuple[int, tuple[int, int]], stamp_ns: int = 1) -> Heightmaps:
    """50 mm cubes of some classes, each around a cell of the action grid."""
    labels = np.zeros((224, 224), np.uint8)
    for index, (row, column) in blocks:
        labels[2 * row - 12 : 2 * row + 13, 2 * column - 12 : 2 * column + 13] = index
    height = np.where(labels > 0, 0.05, 0.0).astype(np.float32)
    return Heightmaps(stamp_ns, np.zeros((224, 224, 3), np.uint8), height, labels, Workspace())


BEFORE = scene((RED, RED_AT), (BLUE, BLUE_AT))


def step(
    kind: gi.MotionKind,
    row: int,
    column: int,
    rotation: int = 0,
    object_grasped: bool = False,
    target_grasped: bool = False,
) -> LoggedStep:
    return LoggedStep(
        decision=gi.Decision(kind=kind, row=row, column=column, rotation=rotation),
        start=gi.RunStart(target_color="red"),
        outcome=gi.MotionOutcome(status=gi.COMPLETED, holding=object_grasped),
        result=gi.StepResult(object_grasped=object_grasped, target_grasped=target_grasped),
    )


def learned(logged: LoggedStep, after: Heightmaps | None) -> dict[str, Transition]:
    found = transitions_of(logged, BEFORE, after, "run")
    return {CLASSES[transition.goal]: transition for transition in found}


def test_a_grasped_target_ends_the_episode() -> None:
    found = learned(step(gi.GRASP, *RED_AT, object_grasped=True, target_grasped=True), scene((BLUE, BLUE_AT)))
    assert list(found) == ["red"]
    assert (found["red"].reward, found["red"].success, found["red"].after) == (1.0, True, None)
    assert found["red"].aimed


def test_a_failed_grasp_of_the_target_earns_its_aim() -> None:
    found = learned(step(gi.GRASP, *RED_AT), BEFORE)
    assert (found["red"].reward, found["red"].success) == (0.5, False)
    assert found["red"].after is BEFORE


def test_grasping_something_else_is_a_success_in_hindsight() -> None:
    found = learned(step(gi.GRASP, *BLUE_AT, object_grasped=True), scene((RED, RED_AT)))
    assert set(found) == {"red", "blue"}
    assert found["red"].reward == 0.0
    assert (found["blue"].reward, found["blue"].success, found["blue"].hindsight) == (1.0, True, True)


def test_failing_to_grasp_something_else_is_no_success() -> None:
    found = learned(step(gi.GRASP, *BLUE_AT), BEFORE)
    assert (found["blue"].reward, found["blue"].success) == (0.5, False)


def test_what_was_held_must_have_vanished() -> None:
    """Something was held, but the blue block is where it was: it was another one."""
    found = learned(step(gi.GRASP, *BLUE_AT, object_grasped=True), BEFORE)
    assert not found["blue"].success


@pytest.mark.parametrize(
    ("row", "column", "rotation", "rewards"),
    [
        (56, 20, 0, {"red": 0.25}),  # to the right, into red
        (56, 48, 0, {"red": 0.0, "blue": 0.25}),  # between them, to the right, into blue
        (20, 20, 0, {"red": 0.0}),  # past both
    ],
)
def test_pushes_teach_about_what_they_pass(row: int, column: int, rotation: int, rewards: dict[str, float]) -> None:
    found = learned(step(gi.PUSH, row, column, rotation), BEFORE)
    assert {color: transition.reward for color, transition in found.items()} == rewards


def test_a_push_that_frees_the_target_earns_more() -> None:
    crowded = scene((RED, RED_AT), (BLUE, (56, 53)))
    logged = step(gi.PUSH, 56, 30)
    (red, *_) = transitions_of(logged, crowded, scene((RED, RED_AT), (BLUE, (90, 90))), "run")
    assert (CLASSES[red.goal], red.reward) == ("red", 0.5)


def test_what_was_grasped_at_the_very_edge_is_known() -> None:
    before = scene()
    before.labels[:13, :13] = BLUE
    decision = gi.Decision(kind=gi.GRASP, row=0, column=0)
    assert grasped_class(before, scene(), decision) == BLUE


@pytest.mark.parametrize("status", [gi.UNREACHABLE, gi.STOPPED, gi.FAULT])
def test_a_motion_that_was_not_made_teaches_nothing(status: gi.MotionStatus) -> None:
    logged = step(gi.PUSH, 56, 20)
    assert logged.outcome is not None
    logged.outcome.status = status
    assert learned(logged, BEFORE) == {}


def test_messages_survive_the_way_through_a_log() -> None:
    """What `transitions_of` is given by `read_transitions` is what was written."""
    from grasping_invisible.training.transitions import _maps

    arrays = HeightmapArrays(5, 0, BEFORE.color, BEFORE.height, BEFORE.labels, 0.002, Workspace().center)
    maps = _maps(encode_heightmaps(arrays))
    assert maps is not None
    assert maps.workspace == Workspace()
    np.testing.assert_array_equal(maps.labels, BEFORE.labels)
    assert _maps(gi.Heightmaps(stamp=to_timestamp(5)), maps) is maps
