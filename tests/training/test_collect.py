from pathlib import Path

from grasping_invisible.data.labelled_steps import labelled_steps
from grasping_invisible.data.steps import steps
from grasping_invisible.training.collect import Collection, collect_scene, draw_scene
from grasping_invisible.training.collect_cli import main


def test_a_scene_leaves_one_complete_log_that_training_can_read(tmp_path: Path):
    collection = Collection(tmp_path, scenes=2, seed=3, motions=2)
    number = collection.numbers[0]
    counts = collect_scene(collection, number)
    assert counts.failure is None
    assert [path.name for path in tmp_path.iterdir()] == [collection.log_path(number).name]
    assert collection.missing == [collection.numbers[1]]
    logged = list(steps(collection.log_path(number)))
    assert len(logged) == counts.motions >= 1
    assert all(step.heightmaps and step.next_heightmaps and step.outcome and step.result for step in logged)
    assert all(step.truth is not None and step.start is not None for step in logged)
    assert any(step.label.goals for step in labelled_steps(collection.log_path(number)))


def test_scenes_depend_on_stage_and_number_alone():
    assert draw_scene(1, 5) == draw_scene(1, 5)
    assert draw_scene(1, 5) != draw_scene(1, 6)
    grey = [sum(item.color == "grey" for item in draw_scene(stage, 7).objects) for stage in (1, 2)]
    assert 2 <= grey[0] <= 5 <= grey[1] <= 9


def test_acting_greedily_needs_models(tmp_path: Path, capsys):
    assert main(["--out", str(tmp_path), "--epsilon", "0.5"]) == 2
    assert "--models" in capsys.readouterr().err
    assert main(["--out", str(tmp_path), "--scenes", "0"]) == 2
    assert main(["--out", str(tmp_path), "--seed", "-1"]) == 2
