import errno
from collections.abc import Callable
from pathlib import Path

import pytest
from rich.console import Console

from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.sim_robot.scene import Scene, SceneObject, save_scene
from grasping_invisible.training.evaluate import Evaluation, evaluate
from grasping_invisible.training.stored_results import ResultsFile, read_results

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


def test_suites_whose_files_begin_alike_have_folders_of_their_own(scene, measure: Measure, tmp_path: Path):
    for suite in ("scenes.v1", "scenes.v2"):
        measure(scene(tmp_path / suite / "one.toml").parent)
    assert {log.split("/")[3] for log in logs_below(tmp_path)} == {"scenes.v1-ours", "scenes.v2-ours"}


def test_a_log_that_is_there_is_never_overwritten(scene, measure: Measure, tmp_path: Path):
    measure(scene(tmp_path / "a" / "one.toml").parent)
    (log,) = tmp_path.rglob("*.mcap")
    before = log.read_bytes()
    scene(tmp_path / "s" / "a" / "one.toml")
    with pytest.raises(BadInput, match=r"lone-0\.mcap exists already; logs are never overwritten"):
        measure(tmp_path / "s" / "a", results=tmp_path / "results.jsonl")
    assert log.read_bytes() == before
    assert read_results(tmp_path / "results.jsonl") == []


def test_scenes_whose_logs_would_have_one_name_are_refused(scene, measure: Measure, tmp_path: Path):
    scene(tmp_path / "s" / "one.toml", "a b")
    scene(tmp_path / "s" / "two.toml", "a/b")
    with pytest.raises(BadInput, match=r"both make log .*a-b-0\.mcap; rename one"):
        measure(tmp_path / "s")


@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt()])
def test_a_run_whose_result_could_not_be_kept_is_made_again(
    error: BaseException, scene, measure: Measure, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    def fail(*_: object) -> None:
        raise error

    suite, results = scene(tmp_path / "one.toml"), tmp_path / "results.jsonl"
    with monkeypatch.context() as patch:
        patch.setattr(ResultsFile, "add", fail)
        with pytest.raises(type(error)):
            measure(suite, results=results)
    assert {Path(log).name for log in logs_below(tmp_path)} == {"lone-0.partial"}
    measure(suite, results=results)
    assert {Path(log).name for log in logs_below(tmp_path)} == {"lone-0.mcap"}
    assert len(read_results(results)) == 1


def test_an_interrupted_evaluation_goes_on_beside_its_logs(scene, measure: Measure, tmp_path: Path):
    suite = scene(tmp_path / "s" / "one.toml").parent
    results = tmp_path / "results.jsonl"
    measure(suite, results=results)
    (done,) = tmp_path.rglob("*.mcap")
    before = done.read_bytes()
    scene(suite / "two.toml", "other")
    done.with_name("other-0.partial").write_bytes(b"a run that was cut short")
    measure(suite, results=results)
    assert [stored.result.scene for stored in read_results(results)] == ["lone", "other"]
    assert done.read_bytes() == before
    assert {path.name for path in done.parent.iterdir()} == {"lone-0.mcap", "other-0.mcap"}
