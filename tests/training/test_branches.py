from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

from grasping_invisible.data.heightmap_message import HeightmapArrays, decode_heightmaps
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.steps import LoggedStep, steps
from grasping_invisible.training import branches
from grasping_invisible.training.branches import Standing, draw_branched_scene
from grasping_invisible.training.collect import Collection, SceneCounts, collect_scene
from grasping_invisible.training.collect_cli import main

PUSHES = {Standing.HIDDEN: 3, Standing.STUCK: 3, Standing.FREE: 1}


@pytest.fixture(scope="module")
def branched(tmp_path_factory: pytest.TempPathFactory) -> tuple[SceneCounts, list[LoggedStep]]:
    folder: Path = tmp_path_factory.mktemp("branched")
    with pytest.MonkeyPatch.context() as patch:
        for name, few in (("STATES", 2), ("MOST_STATES", 3), ("GRASPS", 4), ("GRASPS_AFTER", 1), ("TARGETS_TRIED", 2)):
            patch.setattr(branches, name, few)
        patch.setattr(branches, "PUSHES", PUSHES)
        collection = Collection(folder, scenes=1, seed=11, branch=True)
        counts = collect_scene(collection, collection.numbers[0])
    return counts, list(steps(collection.log_path(collection.numbers[0])))


def tried_first(logged: list[LoggedStep]) -> list[LoggedStep]:
    """What was tried for the first target in the first state."""
    first = logged[0]
    assert first.start is not None
    return [
        step
        for step in logged
        if step.decision.frame_stamp == first.decision.frame_stamp
        and step.start is not None
        and step.start.target_color == first.start.target_color
    ]


def test_every_motion_tried_is_a_run_of_one_step(branched: tuple[SceneCounts, list[LoggedStep]]):
    counts, logged = branched
    assert counts.failure is None
    assert len(logged) == counts.motions >= 10
    assert all(step.start and step.heightmaps and step.outcome and step.result for step in logged)
    ids = [step.start.run_id for step in logged if step.start]
    assert len(set(ids)) == len(ids)
    assert {run_id.split("/")[0] for run_id in ids} == {"branch-11000000"}


def test_a_scene_is_left_after_some_states_and_not_before(branched: tuple[SceneCounts, list[LoggedStep]]):
    _, logged = branched
    pushed_from = {step.decision.frame_stamp.ToNanoseconds() for step in logged if step.decision.kind == gi.PUSH}
    assert 2 <= len(pushed_from) <= 3


def test_motions_from_one_state_start_from_one_frame_and_differ(branched: tuple[SceneCounts, list[LoggedStep]]):
    _, logged = branched
    first = tried_first(logged)
    grasps, pushes = ([step for step in first if step.decision.kind == kind] for kind in (gi.GRASP, gi.PUSH))
    freed = any(step.result and step.result.target_grasped for step in grasps)
    standing = Standing.HIDDEN if not grasps else Standing.FREE if freed else Standing.STUCK
    assert len(grasps) in (0, 4)
    assert len(pushes) == PUSHES[standing]
    chosen = {(s.decision.kind, s.decision.rotation, s.decision.row, s.decision.column) for s in first}
    assert len(chosen) == len(first)


def test_all_that_is_tried_from_a_state_starts_from_what_was_seen_there(
    branched: tuple[SceneCounts, list[LoggedStep]],
):
    """But for the speckle of the target, which is removed, labels are those of the frame whose depth they lie on."""
    _, logged = branched
    states: dict[int, dict[str, HeightmapArrays]] = defaultdict(dict)
    for step in logged:
        assert step.start is not None
        assert step.heightmaps is not None
        frame = step.decision.frame_stamp.ToNanoseconds()
        states[frame][step.start.target_color] = decode_heightmaps(step.heightmaps)
    of_two = [list(seen.values()) for seen in states.values() if len(seen) > 1]
    assert of_two
    for one, other in of_two:
        assert np.array_equal(one.height, other.height)
        assert np.count_nonzero(one.labels != other.labels) < 20


def test_a_push_shows_what_it_led_to_and_a_grasp_what_it_held(branched: tuple[SceneCounts, list[LoggedStep]]):
    counts, logged = branched
    reached = (gi.COMPLETED, gi.BLOCKED)
    for step in logged:
        assert step.outcome is not None
        assert step.result is not None
        shows_after = step.decision.kind == gi.PUSH and step.outcome.status in reached
        assert (step.next_heightmaps is not None) == shows_after
        assert step.decision.kind == gi.GRASP or not step.result.object_grasped
    assert counts.grasps == sum(step.result.target_grasped for step in logged if step.result)


def test_scenes_depend_on_their_number_alone():
    assert draw_branched_scene(4) == draw_branched_scene(4)
    assert draw_branched_scene(4) != draw_branched_scene(5)


def test_branching_chooses_its_motions_by_itself(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    assert main(["--out", str(tmp_path), "--branch", "--epsilon", "0.5"]) == 2
    assert "--epsilon" in capsys.readouterr().err


def test_the_best_grasps_know_how_many_failed_before_them(branched: tuple[SceneCounts, list[LoggedStep]]):
    _, logged = branched
    first = tried_first(logged)
    random, best = [], []
    for index, step in enumerate(step for step in first if step.decision.kind == gi.GRASP):
        (random if index < 2 else best).append(step)
    assert len(random) == len(best) == 2
    failures = 0
    assert all(step.decision.memory.consecutive_grasp_failures == 0 for step in random)
    for step in best:
        assert step.decision.memory.consecutive_grasp_failures == failures
        failures = 0 if step.result and step.result.target_grasped else failures + 1
