from dataclasses import replace

import pytest

from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.training.failed_motions import Fault, fault_of, saw_target


@pytest.mark.parametrize(
    ("what", "fault"),
    [
        ({"status": gi.BLOCKED}, Fault.BLOCKED),
        ({"status": gi.UNREACHABLE}, Fault.UNREACHABLE),
        ({}, Fault.BESIDE),
        ({"holding": True}, Fault.OTHER),
        ({"holding": True, "target_grasped": True}, None),
    ],
)
def test_grasps(steps, what, fault):
    assert fault_of(steps.step(gi.GRASP, **what)) is fault


def test_a_target_that_moved_without_being_held_slipped(steps):
    moved = steps.step(gi.GRASP, truth=steps.truth(500), after=steps.truth(500, x=0.56))
    assert fault_of(moved) is Fault.SLIPPED


@pytest.mark.parametrize(
    ("what", "fault"),
    [
        ({"changed": False}, Fault.NO_EFFECT),
        ({"seen_after": False}, Fault.HID),
        ({"freed": True}, None),
        ({}, Fault.MISSED),
        ({"seen": False}, None),  # one of an exploration
        ({"status": gi.UNREACHABLE}, Fault.UNREACHABLE),
    ],
)
def test_pushes(steps, what, fault):
    assert fault_of(steps.step(gi.PUSH, **what)) is fault


def test_a_push_that_moved_target_and_neighbours_together(steps):
    moved = steps.step(gi.PUSH, truth=steps.truth(500), after=steps.truth(500, y=0.04))
    assert fault_of(moved) is Fault.GROUP


def test_a_push_of_a_target_that_stands_free_was_needless(steps):
    steps.walled = False
    assert fault_of(steps.step(gi.PUSH, freed=True)) is Fault.NEEDLESS


def test_a_motion_whose_end_is_not_in_the_log_is_no_fault(steps):
    step = steps.step(gi.GRASP)
    assert fault_of(type(step)(decision=step.decision, start=step.start)) is None


def test_seen_is_seen_from_above_as_well(steps):
    assert saw_target(steps.step(gi.PUSH, seen=True))
    assert not saw_target(steps.step(gi.PUSH, seen=False, pixels=500))


def test_a_push_that_buries_a_part_of_the_target_frees_nothing(steps):
    """Its border gets shorter, so that less of it is occupied."""
    buried = replace(steps.step(gi.PUSH), next_heightmaps=steps.maps(1, 200))
    assert fault_of(buried) is Fault.MISSED


def test_a_motion_is_judged_by_what_its_run_is_after(steps):
    """A run may be after another colour than its scene is made for."""
    before, after = steps.truth(500), steps.truth(500)
    for truth in (before, after):
        truth.target_color = "blue"
        truth.objects.add(name="lid", color="blue", position=gi.Point(x=0.4, y=0.0, z=0.03))
    after.objects[0].position.x = 0.56
    assert fault_of(steps.step(gi.GRASP, truth=before, after=after)) is Fault.SLIPPED
