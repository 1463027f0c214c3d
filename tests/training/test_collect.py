import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from grasping_invisible.data.cli import main as gi_log
from grasping_invisible.data.dataset.cli import main as gi_dataset
from grasping_invisible.data.labelled_steps import labelled_steps
from grasping_invisible.data.steps import steps
from grasping_invisible.runtime.bundle import load_bundle, shipped_models
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.training.collect import Collection, collect, collect_scene, draw_scene
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
    assert main(["--out", str(tmp_path), "--seed", "0"]) == 2


@pytest.mark.parametrize("more", [["--stage", "1"], ["--motions", "8"], ["--epsilon", "1"], ["--on-policy"]])
def test_branching_takes_no_settings_that_it_would_not_heed(more: list[str], tmp_path: Path, capsys):
    assert main(["--out", str(tmp_path), "--scenes", "1", "--branch", *more]) == 2
    assert "leave out --stage, --motions, --epsilon and --on-policy" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def collected(folder: Path, *, scenes: int = 1, **settings) -> list[str]:
    """Collects and names the logs that were made."""
    before = set(folder.glob("*.mcap"))
    assert all(count.failure is None for count in collect(Collection(folder, scenes, motions=1, **settings), 1))
    return sorted(path.name for path in set(folder.glob("*.mcap")) - before)


def test_a_folder_takes_more_scenes_and_other_seeds_and_no_other_settings(tmp_path: Path):
    assert collected(tmp_path) == ["scene-001000000.mcap"]
    settings = (tmp_path / "collection.json").read_bytes()
    assert collected(tmp_path, scenes=2) == ["scene-001000001.mcap"]
    assert collected(tmp_path, seed=2) == ["scene-002000000.mcap"]
    there = {path.name for path in tmp_path.iterdir()}
    bundle = load_bundle().sha256[:12]
    for other, difference in (
        (Collection(tmp_path, 9, motions=1, stage=2), "stage 1 instead of 2"),
        (Collection(tmp_path, 9, motions=1, branch=True), "branch false instead of true"),
        (Collection(tmp_path, 9, stage=2), "stage 1 instead of 2, motions 1 instead of 8"),
        (
            Collection(tmp_path, 9, motions=1, models=shipped_models(), epsilon=0.5, on_policy=True),
            "epsilon 1.0 instead of 0.5, on_policy false instead of true, bundle_sha256 null instead of " + bundle,
        ),
    ):
        said = f"{tmp_path} was collected with {difference}; give --out another folder"
        with pytest.raises(BadInput, match=f"^{re.escape(said)}$"):
            collect(other, 1)
    assert {path.name for path in tmp_path.iterdir()} == there
    assert (tmp_path / "collection.json").read_bytes() == settings


def test_logs_from_before_settings_were_noted_get_them(tmp_path: Path):
    collection = Collection(tmp_path, 1)
    log = collection.log_path(collection.numbers[0])
    log.write_bytes(b"a log")
    assert collected(tmp_path, stage=2) == []
    assert json.loads((tmp_path / "collection.json").read_text())["stage"] == 2
    assert {path.name for path in tmp_path.iterdir()} == {log.name, "collection.json"}


@pytest.mark.parametrize("content", ["", "{}", '{"stage": 1, "mine": 2}', "\xff"])
def test_a_file_of_that_name_by_another_is_left_alone(content: str, tmp_path: Path, capsys):
    (tmp_path / "collection.json").write_text(content, encoding="latin-1")
    assert main(["--out", str(tmp_path), "--scenes", "1"]) == 2
    said = capsys.readouterr().err.splitlines()[-1]
    assert said.startswith(f"gi-collect: {tmp_path / 'collection.json'} is not what gi-collect writes: ")
    assert (tmp_path / "collection.json").read_text(encoding="latin-1") == content


def test_whoever_reads_logs_passes_over_the_settings(record, practice, tmp_path: Path, capsys):
    record(tmp_path / "scene-001000000.mcap", practice("scene-0/red", 0))
    assert collected(tmp_path) == []
    assert (tmp_path / "collection.json").is_file()
    assert gi_log(["ls", str(tmp_path)]) == gi_log(["relabel", str(tmp_path)]) == 0
    assert gi_dataset(["rebuild", str(tmp_path), "--out", str(tmp_path.parent / "dataset"), "--workers", "1"]) == 0
    assert "1 of 1 logs read" in " ".join(capsys.readouterr().out.split())


def kill_a_worker(process: subprocess.Popen[str]) -> None:
    """What a system does that is out of memory."""
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
    worker = next(child for child in children if "spawn_main" in Path(f"/proc/{child}/cmdline").read_text())
    os.kill(int(worker), signal.SIGKILL)


@pytest.mark.parametrize(
    ("end", "code", "said"),
    [
        (kill_a_worker, 3, "a worker process was killed or crashed, likely out of memory or in the simulator; "),
        (lambda process: process.send_signal(signal.SIGINT), 130, "interrupted; the same command goes on from here"),
        (lambda process: process.send_signal(signal.SIGTERM), 130, "interrupted; the same command goes on from here"),
    ],
    ids=["a killed worker", "SIGINT", "SIGTERM"],
)
def test_a_worker_that_dies_or_a_signal_ends_it_at_once(
    end: Callable[[subprocess.Popen[str]], None], code: int, said: str, tmp_path: Path
):
    command = [sys.executable, "-m", "grasping_invisible.training.collect_cli", "--out", tmp_path / "logs"]
    process = subprocess.Popen(
        [*command, "--scenes", "1000", "--workers", "2"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    while process.poll() is None and not list(tmp_path.glob("logs/*.partial")):
        time.sleep(0.01)
    end(process)
    _, complaints = process.communicate(timeout=30)
    assert process.returncode == code, complaints
    assert "Traceback" not in complaints
    assert complaints.splitlines()[-1].startswith(f"gi-collect: {said}")
