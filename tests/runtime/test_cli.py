"""`gi-runtime` as a process: with the simulator as its child, and with everything one can get wrong."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeVar

import pytest

from grasping_invisible.data.clock import to_ns
from grasping_invisible.data.log_reader import LogReader, read_messages
from grasping_invisible.data.topics import COMMAND, DECISION, OUTCOME, RUN_SUMMARY, TRUTH

SCENE = "coordination-00"
T = TypeVar("T")


def start(tmp_path: Path, *arguments: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "grasping_invisible.runtime.cli", "--log-dir", str(tmp_path / "runs"), *arguments]
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path, env=environment
    )


def finished(tmp_path: Path, *arguments: str) -> tuple[int, str, str]:
    process = start(tmp_path, *arguments)
    out, err = process.communicate(timeout=120)
    return process.returncode, out, err


def only_log(tmp_path: Path) -> Path:
    (log,) = (tmp_path / "runs").glob("*.mcap")
    return log


def is_alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def child_of(process: subprocess.Popen[str]) -> int:
    """The simulator's process id, as soon as there is one."""
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
    return int(eventually(lambda: children.read_text().split(), every=0.001)[0])


def eventually(find: Callable[[], T], seconds: float = 60.0, every: float = 0.05) -> T:
    deadline = time.monotonic() + seconds
    while not (found := find()):
        assert time.monotonic() < deadline
        time.sleep(every)
    return found


def is_moving(tmp_path: Path) -> bool:
    """Whether the log tells that a decision was made: its motion is under way."""
    logs = list((tmp_path / "runs").glob("*.mcap"))
    return bool(logs) and any(True for _ in read_messages(logs[0], [DECISION.key]))


@pytest.fixture
def running(tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    process = start(tmp_path, "--scene", SCENE, "--json")
    yield process
    process.kill()
    process.communicate()


def test_a_run_sums_up_and_the_same_seed_decides_the_same(tmp_path: Path) -> None:
    decisions = []
    for attempt in ("first", "second"):
        folder = tmp_path / attempt
        folder.mkdir()
        code, out, err = finished(folder, "--scene", SCENE, "--seed", "3", "--max-motions", "1", "--json")
        assert code in (0, 1), err
        summary = json.loads(out.splitlines()[-1])
        assert list(summary) == [
            "grasped",
            "found",
            "motions",
            "ended_because",
            "target",
            "scene",
            "seed",
            "log",
            "decision_ms",
        ]
        assert summary["ended_because"] == ("grasped" if code == 0 else "budget")
        assert (summary["scene"], summary["seed"], summary["motions"]) == (SCENE, 3, 1)
        assert summary["grasped"] == (code == 0)
        assert 0 < summary["decision_ms"]["p50"] <= summary["decision_ms"]["p99"]
        assert "at x" in err
        log = only_log(folder)
        assert summary["log"].endswith(log.name)
        reader = LogReader(log)
        messages = [logged.message for logged in reader.messages([DECISION.key])]
        assert reader.complete
        assert len(messages) == 1
        *_, outcome = (logged.message.ended for logged in reader.messages([OUTCOME.key]))  # pyright: ignore
        *_, truth = (logged.message.stamp for logged in reader.messages([TRUTH.key]))  # pyright: ignore
        assert to_ns(truth) >= to_ns(outcome)  # what the last motion led to is there
        for message in messages:
            for clock in ("stamp", "frame_stamp", "stages"):
                message.ClearField(clock)
        decisions.append([message.SerializeToString(deterministic=True) for message in messages])
    assert decisions[0] == decisions[1]


def test_a_whole_run_ends_with_the_target_in_the_gripper(tmp_path: Path) -> None:
    code, out, err = finished(tmp_path, "--scene", "coordination-06", "--seed", "1", "--json")
    summary = json.loads(out.splitlines()[-1])
    assert code == 0, err
    assert summary["grasped"]
    assert summary["found"]
    assert 1 <= summary["motions"] <= 5
    *_, truth = (logged.message.held_object for logged in read_messages(only_log(tmp_path), [TRUTH.key]))  # pyright: ignore
    assert "violet" in truth


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interrupted_in_motion_ends_soon_with_a_readable_log(
    tmp_path: Path, running: subprocess.Popen[str], number: signal.Signals
) -> None:
    simulator = child_of(running)
    eventually(lambda: is_moving(tmp_path))
    interrupted_at = time.monotonic()
    running.send_signal(number)
    out, err = running.communicate(timeout=10)
    assert time.monotonic() - interrupted_at < 2.0
    assert running.returncode == 130, err
    assert not is_alive(simulator)
    assert json.loads(out.splitlines()[-1])["grasped"] is False
    reader = LogReader(only_log(tmp_path))
    (summary,) = [logged.message for logged in reader.messages([RUN_SUMMARY.key])]
    assert reader.complete
    assert summary.ended_because == "interrupted"  # pyright: ignore[reportAttributeAccessIssue]


def test_a_reader_that_leaves_does_not_end_the_run(tmp_path: Path) -> None:
    process = start(tmp_path, "--scene", SCENE, "--max-motions", "1")
    assert process.stdout is not None
    process.stdout.close()
    assert process.stderr is not None
    err = process.stderr.read()
    assert process.wait(120) in (0, 1), err
    assert err == ""
    (summary,) = [logged.message for logged in LogReader(only_log(tmp_path)).messages([RUN_SUMMARY.key])]
    assert summary.ended_because in ("budget", "grasped")  # pyright: ignore[reportAttributeAccessIssue]


def test_interrupted_while_starting_leaves_nothing_behind(running: subprocess.Popen[str]) -> None:
    simulator = child_of(running)
    running.send_signal(signal.SIGINT)
    running.communicate(timeout=10)
    assert running.returncode == 130
    assert not is_alive(simulator)


def test_a_killed_runtime_takes_its_simulator_along_and_leaves_its_log(
    tmp_path: Path, running: subprocess.Popen[str]
) -> None:
    simulator = child_of(running)
    eventually(lambda: is_moving(tmp_path))
    running.kill()
    eventually(lambda: not is_alive(simulator), seconds=3.0)
    assert any(True for _ in read_messages(only_log(tmp_path), [COMMAND.key]))


def test_a_killed_simulator_is_a_robot_failure(tmp_path: Path, running: subprocess.Popen[str]) -> None:
    simulator = child_of(running)
    eventually(lambda: is_moving(tmp_path))
    os.kill(simulator, signal.SIGKILL)
    _, err = running.communicate(timeout=10)
    assert running.returncode == 3
    assert "gi-runtime: the robot has gone" in err
    assert "Traceback" not in err
    reader = LogReader(only_log(tmp_path))
    last = [to_ns(logged.message.stamp) for logged in reader.messages([RUN_SUMMARY.key])]  # pyright: ignore
    assert reader.complete
    assert len(last) == 1


@pytest.mark.parametrize(
    ("arguments", "code", "complaint"),
    [
        (["--scene", "atlantis"], 2, "unknown scene 'atlantis'; known: coordination-00, "),
        (["--target", "pink"], 2, "unknown target 'pink'; known: red, orange, "),
        (["--scene", SCENE, "--target", "violet"], 2, f"scene {SCENE} holds nothing violet; --target can be red"),
        (["--robot", "pluto"], 2, "unknown robot 'pluto'; known: sim, or a zenoh locator such as tcp/"),
        (["--robot", "tcp/127.0.0.1:9"], 2, "--target is needed with a robot on the link; known: red"),
        (["--robot", "tcp/127.0.0.1:9", "--target", "red", "--scene", SCENE], 2, "--robot sim only"),
        (["--models", "nowhere"], 2, "nowhere"),
        (["--config", "nowhere.toml"], 2, "nowhere.toml"),
        (["--max-motions", "0"], 2, "--max-motions must be 1 to 1000"),
        (["--max-motions", "5000000000"], 2, "--max-motions must be 1 to 1000"),
        (["--seed", "-1"], 2, "--seed must be 0"),
        (["--seed", "many"], 2, "invalid int value"),
        (["--speed", "9"], 2, "unrecognized arguments"),
    ],
)
def test_wrong_input_is_one_line_and_its_exit_code(
    tmp_path: Path, arguments: list[str], code: int, complaint: str
) -> None:
    returned, out, err = finished(tmp_path, *arguments, "--json")
    assert returned == code, err
    assert out == ""
    assert complaint in err.splitlines()[-1]
    assert "Traceback" not in err


def test_a_workspace_that_is_not_the_simulators_is_bad_input(tmp_path: Path) -> None:
    (tmp_path / "moved.toml").write_text("[workspace]\ncenter = [0.6, 0.0, 0.0]\n")
    code, _, err = finished(tmp_path, "--scene", SCENE, "--config", "moved.toml")
    assert code == 2
    assert "[0.6, 0.0, 0.0]" in err.splitlines()[-1]
    assert "[0.53, 0.0, 0.0]" in err.splitlines()[-1]


def test_nobody_at_the_locator_is_a_link_failure(tmp_path: Path) -> None:
    (tmp_path / "quick.toml").write_text("[link]\nconnect_seconds = 0.3\n")
    arguments = ["--robot", "tcp/127.0.0.1:9", "--target", "red", "--config", "quick.toml", "--json"]
    code, out, err = finished(tmp_path, *arguments)
    assert code == 3
    assert err.splitlines()[-1] == "gi-runtime: nothing answers at tcp/127.0.0.1:9 (tried for 0.3 s)"
    assert json.loads(out)["motions"] == 0


def test_a_log_folder_that_cannot_be_is_bad_input(tmp_path: Path) -> None:
    (tmp_path / "runs").write_text("a file")
    code, _, err = finished(tmp_path, "--scene", SCENE)
    assert code == 2
    assert "cannot create log" in err.splitlines()[-1]
