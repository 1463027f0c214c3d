from collections.abc import Callable
from pathlib import Path

import pytest
from rich.console import Console

from grasping_invisible.sim_robot.scene import Scene, SceneObject, save_scene
from grasping_invisible.training.evaluate import Evaluation, evaluate

Measure = Callable[..., None]


@pytest.fixture
def scene() -> Callable[..., Path]:
    """Writes a scene file that a run is made of in a moment."""

    def write(path: Path, name: str = "lone") -> Path:
        path.parent.mkdir(parents=True, exist_ok=True)
        cube = SceneObject(shape="cube", color="red", position=(0.0, 0.0, 0.026))
        save_scene(Scene(name=name, target="red", max_motions=1, objects=(cube,)), path)
        return path

    return write


@pytest.fixture
def measure(tmp_path: Path) -> Measure:
    """Makes one run of each scene, with its log below `logs`."""

    def run(suite: Path, **more) -> None:
        evaluation = Evaluation(str(suite), "ours", 1, log_dir=tmp_path / "deep" / "er" / "logs", **more)
        evaluate(evaluation, 1, Console(quiet=True))

    return run


def logs_below(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.suffix in (".mcap", ".partial")}


def test_no_name_leads_out_of_the_log_folder(scene, measure: Measure, tmp_path: Path):
    measure(scene(tmp_path / "scenes" / "one.toml", "../../esc"), name="x/../../y")
    assert logs_below(tmp_path) == {"deep/er/logs/one.toml-x-..-..-y/..-..-esc-0.mcap"}
