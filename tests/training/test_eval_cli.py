"""`gi-eval` from the command line, on a scene that takes a moment."""

import json
from pathlib import Path

import pytest
from msgspec.structs import replace

from grasping_invisible.data.log_reader import read_messages
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.recorder import Recorder, RecordingSettings
from grasping_invisible.data.topics import BY_KEY, RUN_SUMMARY
from grasping_invisible.runtime.bundle import shipped_models
from grasping_invisible.sim_robot.scene import Scene, SceneObject, save_scene
from grasping_invisible.training.eval_cli import main


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    cube = SceneObject(shape="cube", color="red", position=(0.0, 0.0, 0.026))
    # Called otherwise than its file: results go by the scene's own name.
    save_scene(Scene(name="lone", target="red", max_motions=2, objects=(cube,)), tmp_path / "a_cube.toml")
    return tmp_path / "a_cube.toml"


def test_a_scene_file_is_measured_logged_compared_and_goes_on(scene: Path, tmp_path: Path, capsys):
    results = tmp_path / "results.jsonl"
    arguments = ["run", "--suite", str(scene), "--runs", "1", "--workers", "1", "--json", "--results", str(results)]
    assert main([*arguments, "--log-dir", str(tmp_path / "logs")]) == 0
    summary = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert (summary["runs"], summary["method"], summary["seed"]) == (1, "ours", 0)
    assert set(summary["scenes"]) == {"lone"}
    assert summary["success_rate"] == summary["confirmed_rate"] == 1.0  # held, and so out of the camera's view
    assert summary["success_interval"][0] <= summary["success_rate"] <= summary["success_interval"][1]
    kept = results.read_text()

    assert main(arguments) == 0  # nothing is left to run
    assert results.read_text() == kept
    assert json.loads(capsys.readouterr().out.splitlines()[-1]) == summary

    as_it_was = scene.read_text()
    scene.write_text(as_it_was.replace("red", "blue"))
    assert main(arguments) == 2
    assert "holds results of 'lone' as it was before it changed" in capsys.readouterr().err
    scene.write_text(as_it_was)

    assert main([*arguments, "--method", "rand"]) == 2
    assert "holds results of ours by bundle" in capsys.readouterr().err

    assert main(["compare", str(results), str(results), "--json"]) == 0
    compared = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert compared["overall"]["pairs"] == 1
    assert compared["verdict"] == "no difference beyond noise"

    assert main(["failures", str(tmp_path / "logs"), "--out", str(tmp_path / "why")]) == 0
    assert "## lone: explorer, coordinator" in (tmp_path / "why" / "failures.md").read_text()
    assert f"of {summary['runs']} runs failed" in capsys.readouterr().out


def test_names_are_printed_as_they_are(scene: Path, tmp_path: Path, capsys):
    scene.write_text(scene.read_text().replace('"lone"', '"[/] [red]a"'))
    results, suite = tmp_path / "results.jsonl", scene.rename(tmp_path / "s[v2].toml")
    arguments = ["run", "--suite", str(suite), "--runs", "1", "--workers", "1", "--name", "[b]mine"]
    assert main([*arguments, "--results", str(results)]) == 0
    assert main(["compare", str(results), str(results)]) == 0
    bar_and_table, comparison = (text for text in capsys.readouterr().out.split("1: ", 1))
    assert bar_and_table.count("s[v2].toml, [b]mine") == 2
    assert "[/] [red]a" in bar_and_table
    assert "as [b]mine by" in comparison
    assert "[/] [red]a" in comparison


def test_copies_of_a_log_are_one_run_and_its_damage_is_said(scene: Path, tmp_path: Path, capsys):
    logs = tmp_path / "logs"
    assert main(["run", "--suite", str(scene), "--runs", "1", "--workers", "1", "--log-dir", str(logs)]) == 0
    (log,) = logs.rglob("*.mcap")
    whole = log.read_bytes()
    (logs / "a_cut_copy.mcap").write_bytes(whole[: len(whole) * 2 // 3])
    (logs / "text.mcap").write_text("no log")
    with Recorder(logs / "in_parts.mcap", RecordingSettings(part_bytes=len(whole) // 4)) as recorder:
        for logged in read_messages(log):
            recorder.put(BY_KEY[logged.topic], logged.message.SerializeToString(), logged.log_time_ns)
    assert (logs / "in_parts.001.mcap").exists()

    capsys.readouterr()
    assert main(["failures", str(logs), "--out", str(tmp_path / "why")]) == 0
    said = capsys.readouterr()
    assert "of 1 runs failed" in said.out
    assert "the robot, the link or the physics failed" not in said.out
    complaints = said.err.replace("\n", "")
    assert complaints.count("damaged: ") == 1
    assert "a_cut_copy.mcap" in complaints
    assert complaints.count("left out: ") == 1

    assert main(["failures", str(logs / "a_cut_copy.mcap"), "--out", str(tmp_path / "why")]) == 0
    assert "damaged: " in capsys.readouterr().err


def test_one_damaged_log_does_not_end_the_report(record, practice, tmp_path: Path, capsys):
    def log(name: str, config: str = "", picture: bytes | None = None) -> None:
        messages = [*practice(name, 1), (RUN_SUMMARY, gi.RunSummary(run_id=name, ended_because="budget"))]
        for _, message in messages:
            if isinstance(message, gi.RunStart):
                message.config_toml = config
            if isinstance(message, gi.Heightmaps) and picture is not None:
                message.labels_png = picture
            if isinstance(message, gi.Decision):
                message.policy = "explorer"
        record(tmp_path / "logs" / f"{name}.mcap", messages)

    (tmp_path / "logs").mkdir()
    log("a-later-version", config="[policy]\nexploration = 'by-ear'\n")
    log("b-picture", picture=b"damaged")
    log("c-whole")
    assert main(["failures", str(tmp_path / "logs"), "--out", str(tmp_path / "why")]) == 0
    said = capsys.readouterr()
    assert "1 of 1 runs failed." in said.out
    complaints = "".join(said.err.split())
    assert complaints.count("damaged:") == 2
    assert "a-later-version.mcap:theconfigurationofruna-later-version:exploration'by-ear'isunknown" in complaints
    assert f"damaged:{tmp_path / 'logs' / 'b-picture.mcap'}:" in complaints


def test_two_bundles_are_compared_on_the_same_runs(scene: Path, tmp_path: Path, capsys):
    models = ["--models", str(shipped_models()), "--models", str(shipped_models())]
    kept = ["--results", str(tmp_path / "kept"), "--workers", "1", "--json"]
    assert main(["compare", "--suite", str(scene), "--runs", "1", *models, *kept]) == 0
    compared = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert compared["overall"]["first"] == compared["overall"]["second"]
    (file,) = (tmp_path / "kept").iterdir()  # the same bundle twice
    assert file.name.startswith("a_cube-ours-")


def test_files_of_different_tasks_are_not_compared(results_file, result_of, capsys):
    runs = [result_of("a", seed, True, 2) for seed in range(3)]
    files = [
        results_file("mine", method, runs, task_sha256=task)
        for method, task in (("ours", "a" * 64), ("rand", "b" * 64), ("vpg", None))
    ]
    ours, rand, vpg = map(str, files)
    assert main(["compare", ours, vpg]) == main(["compare", vpg, rand]) == 0
    assert main(["compare", ours, rand]) == 2
    said = "gi-eval: the two files hold runs of 'a' from before and after it changed, which are not the same task"
    assert capsys.readouterr().err.splitlines() == [said]
    longer = results_file("mine", "mask-vpg", [replace(run, max_motions=6) for run in runs])
    assert main(["compare", vpg, str(longer)]) == 2
    assert capsys.readouterr().err.splitlines() == [said]


def test_a_file_that_holds_a_run_twice_is_not_compared(results_file, result_of, capsys):
    once = results_file("mine", "ours", [result_of("a", 0, True, 2)])
    twice = results_file("mine", "rand", [result_of("a", 0, True, 2), result_of("a", 0, False, 5)])
    assert main(["compare", str(once), str(twice)]) == 2
    assert f"the results hold a run of {twice} twice" in capsys.readouterr().err


def test_tables_of_stored_results(results_file, result_of, tmp_path: Path, capsys):
    file = results_file("coordination", "ours", [result_of("coordination-00", 0, True, 2)])
    assert main(["tables", str(file.parent), "--out", str(tmp_path / "out")]) == 0
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"tables.md", "coordination.png"}
    assert capsys.readouterr().out.strip() == (tmp_path / "out" / "tables.md").read_text().strip()


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["run", "--suite", "coordination", "--method", "magic"], "clutter-prior"),
        (["run", "--suite", "nothing"], "exploration, coordination, invisible"),
        (["run", "--suite", "coordination", "--runs", "0"], "--runs must be at least 1"),
        (["run", "--suite", "coordination", "--runs", "1001"], "--runs must be at most 1000, not 1001"),
        (["protocol", "--runs", "1001", "--out", "out"], "--runs must be at most 1000, not 1001"),
        (["run", "--suite", "coordination", "--workers", "0"], "--workers must be at least 1"),
        (["run", "--suite", "coordination", "--models", "nowhere"], "no model bundle"),
        (["compare", "one.jsonl"], "two files of results, or --models twice"),
        (["compare", "--models", "a", "--models", "b"], "--models needs --suite"),
        (["compare", "one.jsonl", "two.jsonl"], "one.jsonl"),
        (["tables", ".", "--out", "out"], "holds no results"),
        (["note", "."], "holds no results"),
        (["failures", ".", "--out", "out"], "no .mcap logs in ."),
        (["failures", "no.mcap", "--out", "out"], "no.mcap does not exist"),
        (["protocol", "--models", "nowhere", "--out", "out"], "no model bundle"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(arguments, complaint, tmp_path: Path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    said = capsys.readouterr().err
    assert complaint in said
    assert "Traceback" not in said
    assert said.strip().splitlines()[-1].startswith("gi-eval: ")
