from pathlib import Path

import pytest
from msgspec.structs import replace

from grasping_invisible.data.log_check import check_log
from grasping_invisible.runtime.bundle import load_bundle
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.runtime.loop import Goal
from grasping_invisible.runtime.replay import replay_log
from grasping_invisible.sim_robot.scene import Scene, SceneObject, load_scene, save_scene
from grasping_invisible.training.evaluation import Trial, run_trial, task_sha256_of, trials_of
from grasping_invisible.training.evaluation_methods import method_named
from grasping_invisible.training.failed_runs import read_runs


def test_suites_are_the_papers():
    exploration, coordination, invisible = (
        trials_of(suite, 2, 1) for suite in ("exploration", "coordination", "invisible")
    )
    assert len(exploration) == len(invisible) == 8
    assert len(coordination) == 16
    assert {trial.goal for trial in exploration} == {Goal.FIND}
    assert {trial.max_motions for trial in exploration} == {3, 5}  # 2 x clusters - 1
    assert {trial.max_motions for trial in coordination} == {5}
    assert {(trial.goal, trial.max_motions) for trial in invisible} == {(Goal.GRASP, 15)}
    assert {trial.seed for trial in exploration} == {1000, 1001}


def test_evaluations_of_two_seeds_share_no_run():
    assert len({trial.seed for seed in (0, 1) for trial in trials_of("invisible", 1000, seed)}) == 2000
    with pytest.raises(BadInput, match=r"--runs must be at most 1000, not 1001: the next --seed begins there"):
        trials_of("invisible", 1001, 0)


def test_an_unknown_suite_is_answered_with_the_known_ones():
    with pytest.raises(BadInput, match="exploration, coordination, invisible"):
        trials_of("nothing", 1, 0)


def test_two_scenes_of_one_name_are_refused(tmp_path: Path):
    for file in ("one.toml", "other.toml"):
        save_scene(load_scene("coordination-00"), tmp_path / file)
    with pytest.raises(BadInput, match=r"one\.toml and .*other\.toml both hold a scene named "):
        trials_of(str(tmp_path), 1, 0)


def test_a_task_is_told_by_what_is_run_and_not_by_names(tmp_path: Path):
    mesh = tmp_path / "mug.stl"
    mesh.write_bytes(b"a mug")
    scene = Scene(name="a", target="red", objects=(SceneObject(mesh=str(mesh), color="red", position=(0, 0, 0.02)),))
    task = task_sha256_of(scene, Goal.GRASP, 5)
    elsewhere = replace(scene.objects[0], mesh=str(mesh.rename(tmp_path / "cup.stl")))
    assert task_sha256_of(replace(scene, name="b", objects=(elsewhere,)), Goal.GRASP, 5) == task
    others = [
        task_sha256_of(replace(scene, objects=(elsewhere,)), Goal.FIND, 5),
        task_sha256_of(replace(scene, objects=(elsewhere,)), Goal.GRASP, 6),
        task_sha256_of(replace(scene, objects=(replace(elsewhere, position=(0, 0.01, 0.02)),)), Goal.GRASP, 5),
    ]
    (tmp_path / "cup.stl").write_bytes(b"a bowl")
    others.append(task_sha256_of(replace(scene, objects=(elsewhere,)), Goal.GRASP, 5))
    assert len({task, *others}) == 5
    with pytest.raises(BadInput, match=r"mug.stl cannot be read"):
        task_sha256_of(scene, Goal.GRASP, 5)


def test_the_log_of_a_run_is_whole_and_every_decision_in_it_replays(tmp_path: Path):
    trial = Trial("exploration-03", "exploration-03", 3, Goal.FIND, 2)
    log = tmp_path / "exploration-03-3.mcap"
    result = run_trial(trial, None, method_named("mechanical-search"), log)
    assert list(tmp_path.iterdir()) == [log]
    assert check_log(log).problems == []
    (run,) = read_runs(log)
    assert (run.start.scene, run.start.seed, run.start.max_motions) == ("exploration-03", 3, 2)
    assert run.suite == "exploration"
    assert run.method == "mechanical-search, mechanical-search"
    assert len(run.steps) == result.motions == len(result.decision_ms)
    assert run.summary is not None
    assert run.summary.ended_because == ("found" if result.success else "budget")
    assert run.last_truth is not None
    replayed = replay_log(log, load_bundle(threads=1))
    assert replayed.checked == result.motions
    assert replayed.identical
