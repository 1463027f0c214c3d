import json
from pathlib import Path

import pytest

from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.runtime.loop import Goal
from grasping_invisible.sim_robot.scene import Scene, SceneObject, save_scene
from grasping_invisible.training.eval_cli import main
from grasping_invisible.training.evaluation import trials_of


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


def test_unknown_names_are_answered_with_the_known_ones(capsys):
    with pytest.raises(BadInput, match="exploration, coordination, invisible"):
        trials_of("nothing", 1, 0)
    assert main(["run", "--suite", "coordination", "--method", "magic"]) == 2
    assert "clutter-prior" in capsys.readouterr().err


def test_a_scene_file_is_measured_and_the_results_are_kept(tmp_path: Path, capsys):
    cube = SceneObject(shape="cube", color="red", position=(0.0, 0.0, 0.026))
    # Called otherwise than its file: results go by the scene's own name.
    save_scene(Scene(name="lone", target="red", max_motions=2, objects=(cube,)), tmp_path / "a_cube.toml")
    arguments = ["run", "--suite", str(tmp_path / "a_cube.toml"), "--runs", "1", "--json"]
    arguments += ["--results", str(tmp_path / "results.jsonl")]
    assert main(arguments) == 0
    summary = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert summary["runs"] == 1
    assert set(summary["scenes"]) == {"lone"}
    assert summary["success_interval"][0] <= summary["success_rate"] <= summary["success_interval"][1]
    kept = (tmp_path / "results.jsonl").read_text()
    assert main(arguments) == 0  # nothing is left to run
    assert (tmp_path / "results.jsonl").read_text() == kept
    assert json.loads(capsys.readouterr().out.splitlines()[-1]) == summary
