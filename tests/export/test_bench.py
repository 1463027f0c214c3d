"""The benchmarks measure something: small ones of each, as a person or a program would run them."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from grasping_invisible.data.cli import main as gi_log
from grasping_invisible.data.labelled_steps import labelled_steps
from grasping_invisible.data.log_check import check_log
from grasping_invisible.export import bench_decide
from grasping_invisible.export.bench_cli import main
from grasping_invisible.export.bench_logs import STEPS, LogMaker
from grasping_invisible.runtime.errors import RobotError


def measured(capsys: pytest.CaptureFixture[str], *arguments: str, code: int = 0) -> dict[str, Any]:
    assert main([*arguments, "--json"]) == code
    said = json.loads(capsys.readouterr().out)
    assert said["machine"]["cores"] >= 1
    assert said["machine"]["libraries"]["onnxruntime"]
    return said


def test_a_decision_is_timed_by_stage_on_one_and_two_threads(capsys: pytest.CaptureFixture[str]) -> None:
    said = measured(capsys, "decide", "--decisions", "2")
    assert [(times["policy"], times["threads"]) for times in said["times"]] == [
        ("coordinator", 2),
        ("explorer", 2),
        ("coordinator", 1),
        ("explorer", 1),
    ]
    for times in said["times"]:
        assert 0 < times["least"] <= times["median"] <= times["p99"]
        assert {"segment", "project", "critic"} <= times["stages"].keys()
        assert sum(times["stages"].values()) <= 2 * times["median"]


def test_a_person_gets_a_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["decide", "--decisions", "1"]) == 0
    said = capsys.readouterr().out
    for words in ("coordination-02", "explorer", "median ms", "Python 3", "onnxruntime"):
        assert words in said


def test_a_robot_that_fails_is_code_3(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def refuse(*_: object) -> None:
        raise RobotError("the scene does not come to rest")

    monkeypatch.setattr(bench_decide, "SimRobot", refuse)
    assert main(["decide", "--decisions", "1"]) == 3
    assert capsys.readouterr().err.splitlines()[-1] == "gi-bench: the scene does not come to rest"


def test_recording_is_measured_and_its_log_is_whole(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = measured(capsys, "recorder", "--seconds", "2", "--hz", "5", "--out", str(tmp_path))
    assert (said["dropped"], said["frames_lost"], said["check"]) == (0, 0, [])
    assert said["frames"] >= 5
    assert said["decisions"] >= 1
    assert 0 < said["wait_p50"] <= said["wait_p99"] <= said["wait_max"]
    assert 0 < said["cpu_writer"] <= said["cpu_all"]
    (log,) = tmp_path.glob("*.mcap")
    assert said["log_bytes"] == log.stat().st_size > 1_000_000
    assert gi_log(["check", str(log)]) == 0


def test_too_little_room_is_said_before_the_start(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["recorder", "--seconds", "900000", "--hz", "60", "--out", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"gi-bench: {tmp_path} has ")
    assert said.count("\n") == 1


def test_rebuilding_is_measured_in_full_with_one_more_and_without_a_change(
    capsys: pytest.CaptureFixture[str],
) -> None:
    said = measured(capsys, "rebuild", "--sizes", "2")
    assert [(it["kind"], it["logs"]) for it in said["growth"]] == [("all", 2), ("one more", 3), ("no change", 3)]
    assert said["growth"][0]["read_bytes"] > said["growth"][1]["read_bytes"] > said["growth"][2]["read_bytes"] == 0
    assert said["growth"][2]["shards_written"] == 0
    assert {it["transitions"] for it in said["speed"]} == {said["growth"][0]["transitions"]}


def test_generated_logs_are_whole_and_teach(tmp_path: Path) -> None:
    first, second = (LogMaker(3).write(tmp_path / name, 7) for name in ("a", "b"))
    assert first.read_bytes() == second.read_bytes()
    assert first.read_bytes() != LogMaker(3).write(tmp_path / "c", 8).read_bytes()
    problems = check_log(first).problems
    assert problems == []
    assert len(list(labelled_steps(first))) == STEPS


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["nothing"],
        ["recorder", "--hz", "0"],
        ["recorder", "--seconds", "-1"],
        ["decide", "--decisions", "0"],
        ["decide", "--seed", "-1"],
        ["rebuild", "--seed", "-1"],
    ],
)
def test_bad_usage_is_code_2(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    assert "usage: gi-bench" in capsys.readouterr().err


def test_ctrl_c_ends_recording_with_the_figures_so_far(tmp_path: Path) -> None:
    recorder = [sys.executable, "-m", "grasping_invisible.export.bench_cli", "recorder", "--json", "--hz", "5"]
    command = [*recorder, "--seconds", "500", "--out", str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        deadline = time.monotonic() + 300
        while sum(path.stat().st_size for path in tmp_path.glob("*.mcap")) < 5_000_000:
            assert process.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.1)
        process.send_signal(signal.SIGINT)
        said, complaints = process.communicate(timeout=60)
    assert process.returncode == 130, complaints
    assert "Traceback" not in complaints
    figures = json.loads(said)
    assert 0 < figures["seconds"] < 300
    assert figures["frames"] > 0
    assert figures["check"] == []
