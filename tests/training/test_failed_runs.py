from dataclasses import replace
from pathlib import Path

import pytest

from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.run_names import OUTSIDE
from grasping_invisible.runtime.loop import Goal
from grasping_invisible.sim_robot.scene import Scene, SceneObject, save_scene
from grasping_invisible.training.evaluation import Trial, run_trial
from grasping_invisible.training.evaluation_methods import METHODS
from grasping_invisible.training.failed_motions import Fault
from grasping_invisible.training.failed_runs import Cause, failure_of, read_runs


def cause_of(run):
    failure = failure_of(run)
    return None if failure is None else failure.cause


@pytest.mark.parametrize("ended", ["grasped", "found"])
def test_a_run_that_reached_its_goal_did_not_fail(steps, ended):
    assert cause_of(steps.run(steps.step(gi.PUSH), ended=ended)) is None


@pytest.mark.parametrize("ended", ["PUSH 3 ended in a fault", None])
def test_a_run_that_was_cut_short(steps, ended):
    assert cause_of(steps.run(steps.step(gi.PUSH), ended=ended)) is Cause.ROBOT


def test_something_else_that_was_taken_for_the_target(steps):
    wrong = steps.step(gi.GRASP, holding=True, target_grasped=True, after=steps.truth(500, held="other"))
    assert cause_of(steps.run(wrong, ended="grasped")) is Cause.MISJUDGED
    right = steps.step(gi.GRASP, holding=True, target_grasped=True, after=steps.truth(500, held="cube"))
    assert cause_of(steps.run(right, ended="grasped")) is None


def test_a_target_that_was_thrown_away(steps):
    thrown = steps.step(gi.GRASP, holding=True, after=steps.truth(0, x=-0.2, y=0.38))
    assert cause_of(steps.run(thrown, steps.step(gi.PUSH, seen=False))) is Cause.MISJUDGED


def test_a_target_that_was_pushed_out(steps):
    out = steps.truth(0, x=0.53, y=0.3)
    pushed = steps.step(gi.PUSH, seen_after=False, after=out)
    later = steps.step(gi.PUSH, seen=False, truth=out, after=out)
    for run in (steps.run(pushed, later), steps.run(pushed, ended=OUTSIDE)):
        failure = failure_of(run)
        assert failure is not None
        assert failure.cause is Cause.GONE
        assert failure.step is pushed


def test_a_target_that_was_taken_to_have_left(steps):
    assert cause_of(steps.run(steps.step(gi.PUSH), ended=OUTSIDE)) is Cause.GIVEN_UP


@pytest.mark.parametrize(
    ("pixels", "truly", "cause"),
    [(0, 0, Cause.NEVER_UNCOVERED), (0, 400, Cause.NOT_SEGMENTED), (400, 400, Cause.COVERED)],
)
def test_a_target_that_was_never_seen_from_above(steps, pixels, truly, cause):
    hidden = [steps.step(gi.PUSH, seen=False, seen_after=False) for _ in range(3)]
    glimpsed = steps.step(gi.PUSH, seen=False, seen_after=False, pixels=pixels, truth=steps.truth(truly))
    failure = failure_of(steps.run(*hidden, glimpsed, hidden[0]))
    assert failure is not None
    assert failure.cause is cause
    assert (failure.step is glimpsed) == (cause is not Cause.NEVER_UNCOVERED)


def test_something_else_that_was_chased(steps):
    nothing = steps.truth(0)
    mistaken = [steps.step(gi.GRASP, status=gi.BLOCKED, truth=nothing, after=nothing) for _ in range(2)]
    assert cause_of(steps.run(steps.step(gi.PUSH), *mistaken)) is Cause.MISTAKEN


def test_a_target_that_was_found_with_the_last_motions(steps):
    hidden = [steps.step(gi.PUSH, seen=False, seen_after=False) for _ in range(12)]
    uncovering = steps.step(gi.PUSH, seen=False, seen_after=True)
    grasp = steps.step(gi.GRASP, status=gi.BLOCKED)
    assert cause_of(steps.run(*hidden, uncovering, grasp, grasp)) is Cause.LATE
    assert cause_of(steps.run(*hidden[:11], uncovering, grasp, grasp, grasp)) is Fault.BLOCKED


def test_otherwise_the_most_frequent_fault_since_it_was_seen(steps):
    blocked, beside = steps.step(gi.GRASP, status=gi.BLOCKED), steps.step(gi.GRASP)
    idle, useful = steps.step(gi.PUSH, changed=False), steps.step(gi.PUSH, freed=True)
    unseen = steps.step(gi.PUSH, seen=False, changed=False, seen_after=False)
    failure = failure_of(steps.run(unseen, unseen, unseen, blocked, useful, beside, blocked, idle))
    assert failure is not None
    assert failure.cause is Fault.BLOCKED
    assert failure.step is blocked
    assert cause_of(steps.run(blocked, beside)) is Fault.BESIDE  # the latest of equal ones
    assert cause_of(steps.run(useful, useful)) is Cause.BUDGET


def test_suites_are_told_by_scene_and_allowance(steps):
    assert steps.run().suite == "invisible"
    steps.start.max_motions = 5
    assert steps.run().suite == "exploration"
    steps.start.scene, steps.start.max_motions = "coordination-00", 15
    assert steps.run().suite == "coordination"
    steps.start.scene = "mine"
    assert steps.run().suite == "mine"
    assert steps.run().method == "explorer, coordinator"


def test_a_real_run_that_has_to_fail(tmp_path: Path):
    """A slab as wide as the table cannot be grasped, whatever is tried."""
    slab = SceneObject(mesh=str(_slab(tmp_path)), color="red", position=(0.0, 0.0, 0.02))
    save_scene(Scene(name="slab", target="red", max_motions=2, objects=(slab,)), tmp_path / "slab.toml")
    trial = Trial(str(tmp_path / "slab.toml"), "slab", 0, Goal.GRASP, 2)
    result = run_trial(trial, None, METHODS["ours"], tmp_path / "slab-0.mcap")
    assert not result.success
    (run,) = read_runs(tmp_path / "slab-0.mcap")
    assert len(run.steps) == 2
    failure = failure_of(run)
    assert failure is not None
    assert isinstance(failure.cause, Cause | Fault)
    assert failure.cause not in (Cause.ROBOT, Cause.MISJUDGED)


def test_a_real_run_without_any_motion_counts(tmp_path: Path):
    log = tmp_path / "coordination-07-0.mcap"
    result = run_trial(Trial("coordination-07", "coordination-07", 0, Goal.FIND, 2), None, METHODS["ours"], log)
    assert (result.success, result.motions) == (True, 0)
    (run,) = read_runs(log)
    assert (run.start.scene, run.steps) == ("coordination-07", ())
    assert failure_of(run) is None
    assert cause_of(replace(run, summary=None)) is Cause.ROBOT


def _slab(folder: Path) -> Path:
    import trimesh

    path = folder / "slab.stl"
    trimesh.creation.box((0.3, 0.3, 0.04)).export(path)
    return path
