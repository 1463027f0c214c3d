"""`gi-robot check` against the simulator's process, and against a driver with faults."""

import json
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates

from grasping_invisible.data.clock import to_timestamp
from grasping_invisible.data.images import CAMERA_FRAME
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.topics import PROTOCOL_VERSION
from grasping_invisible.data.transform_message import encode_transforms
from grasping_invisible.runtime import robot_checks
from grasping_invisible.runtime.bundle import load_bundle
from grasping_invisible.runtime.frame import Camera, RgbdFrame
from grasping_invisible.runtime.link_settings import LinkSettings
from grasping_invisible.runtime.robot_server import RobotServer
from grasping_invisible.runtime.workspace import Workspace


class CarelessDriver:
    """Accepts everything, and looks the wrong way."""

    def __init__(self) -> None:
        self.kinds: list[gi.MotionKind] = []
        self.health = gi.RobotHealth(state=gi.IDLE, protocol_version=PROTOCOL_VERSION)

    def refusal(self, command: gi.MotionCommand) -> str | None:
        return None

    def execute(self, command: gi.MotionCommand) -> gi.MotionOutcome:
        self.kinds.append(command.kind)
        now = to_timestamp(time.time_ns())
        return gi.MotionOutcome(command_id=command.id, started=now, ended=now, status=gi.COMPLETED)

    def request_stop(self, reason: str) -> None: ...

    def heartbeat(self) -> gi.RobotHealth:
        beat = gi.RobotHealth(stamp=to_timestamp(time.time_ns() - 10**11))
        beat.MergeFrom(self.health)
        return beat

    def frame(self) -> RgbdFrame:
        camera = Camera(64, 48, np.array([[60.0, 0, 31.5], [0, 60.0, 23.5], [0, 0, 1]]), np.eye(4))
        return RgbdFrame(time.time_ns(), np.zeros((48, 64, 3), np.uint8), np.ones((48, 64), np.float32), camera)


@pytest.fixture
def careless(free_endpoint: str) -> Iterator[tuple[str, CarelessDriver]]:
    driver = CarelessDriver()
    server = RobotServer(free_endpoint, driver)
    ended = threading.Event()

    def serve() -> None:
        while not ended.is_set():
            command = server.next_command(0.2)
            if command is not None:
                server.publish_outcome(server.carry_out(command))
            frame = driver.frame()
            poses = encode_transforms({CAMERA_FRAME: np.eye(4)}, frame.stamp_ns)
            server.publish_frame(frame, poses, JointStates(timestamp=to_timestamp(frame.stamp_ns)))

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    yield free_endpoint, driver
    ended.set()
    thread.join(3)
    server.close()


@pytest.mark.parametrize("move", [False, True])
def test_a_careless_driver_fails_where_it_is_careless(careless: tuple[str, CarelessDriver], move: bool) -> None:
    endpoint, driver = careless
    checks = robot_checks.check_robot(endpoint, LinkSettings(), Workspace(), load_bundle(), move=move)
    results = {check.name: check.passed for check in checks}
    assert results["heartbeat"] is True
    assert results["frame"] is True
    assert results["calibration"] is False
    assert results["stamps"] is True
    assert results["refusal"] is False
    assert results["clock"] is None
    assert results.get("bounds") is (False if move else None)
    assert driver.kinds == [gi.MOTION_KIND_UNSPECIFIED, *([gi.HOME, gi.PUSH] if move else [])]


def test_frames_that_never_change_their_stamp_fail(careless: tuple[str, CarelessDriver]) -> None:
    endpoint, driver = careless
    stale = driver.frame()
    driver.frame = lambda: stale
    time.sleep(0.5)  # until the last of the new ones has gone out
    results = {
        check.name: check.passed
        for check in robot_checks.check_robot(endpoint, LinkSettings(), Workspace(), load_bundle(), move=False)
    }
    assert results["stamps"] is False


def test_a_robot_at_fault_is_not_said_to_have_accepted_anything(careless: tuple[str, CarelessDriver]) -> None:
    endpoint, driver = careless
    driver.health.state, driver.health.detail = gi.ROBOT_FAULT, "brakes"
    checks = robot_checks.check_robot(endpoint, LinkSettings(), Workspace(), load_bundle(), move=True)
    told = {check.name: check for check in checks}
    assert told["refusal"].passed is None
    assert told["bounds"].passed is None
    assert told["refusal"].detail == "not asked for: the robot is at fault: brakes"
    assert told["home"].passed is False
    assert driver.kinds == []


def test_the_simulator_passes_and_the_command_says_so() -> None:
    simulator = subprocess.Popen(
        [sys.executable, "-m", "grasping_invisible.sim_robot.cli", "--scene", "coordination-00"],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    try:
        assert simulator.stdout is not None
        endpoint = json.loads(simulator.stdout.readline())["endpoint"]
        command = [sys.executable, "-m", "grasping_invisible.runtime.check_robot", "check", endpoint, "--move"]
        checked = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
        assert checked.returncode == 0, checked.stdout + checked.stderr
        assert "failed" not in checked.stdout
        assert re.search(r"segmenter\W+sees\W+red \(\d+ px\)", " ".join(checked.stdout.split()))
        assert checked.stdout.count("passed") == 13
        simulator.send_signal(signal.SIGINT)
        assert simulator.wait(5) == 130
    finally:
        simulator.kill()
        simulator.wait()


@pytest.mark.parametrize(("locator", "code"), [("nowhere", 2), ("tcp/127.0.0.1:9", 3)])
def test_no_robot_is_an_exit_code(locator: str, code: int, tmp_path: Path) -> None:
    (tmp_path / "quick.toml").write_text("[link]\nconnect_seconds = 0.2\n")
    command = [sys.executable, "-m", "grasping_invisible.runtime.check_robot", "check", locator, "--config"]
    checked = subprocess.run([*command, str(tmp_path / "quick.toml")], capture_output=True, text=True, check=False)
    assert checked.returncode == code
    assert checked.stderr.startswith("gi-robot: ")
    assert len(checked.stderr.splitlines()) == 1
