"""The driver that integrators begin with passes the check, and moves when it is asked to."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from grasping_invisible.runtime import robot_checks
from grasping_invisible.runtime.bundle import load_bundle
from grasping_invisible.runtime.link_settings import LinkSettings
from grasping_invisible.runtime.workspace import Workspace
from grasping_invisible.sim_robot.node import free_port

EXAMPLE = Path(__file__).parents[1] / "docs" / "example_driver.py"


@pytest.fixture
def endpoint() -> Iterator[str]:
    locator = f"tcp/127.0.0.1:{free_port()}"
    driver = subprocess.Popen([sys.executable, str(EXAMPLE), locator])
    yield locator
    driver.terminate()
    driver.wait()


def test_it_keeps_the_protocol(endpoint: str) -> None:
    checks = robot_checks.check_robot(
        endpoint, LinkSettings(connect_seconds=20.0), Workspace(), load_bundle(), move=True
    )
    assert [check for check in checks if check.passed is False] == []
    assert {"home", "bounds", "refusal", "calibration"} <= {check.name for check in checks if check.passed}
