"""The simulator as a child: what it says of why it ended."""

import os
from pathlib import Path

import pytest

from grasping_invisible.runtime import sim_process
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.runtime.sim_process import SimProcess


def test_a_simulator_that_ended_is_asked_why() -> None:
    simulator = SimProcess("no-such-scene", 0, 30.0)
    try:
        with pytest.raises(BadInput, match="no-such-scene"):
            simulator.wait_until_ready()
        assert "no-such-scene" in simulator.last_words()
        assert not simulator.last_words().startswith("gi-sim-robot")
    finally:
        simulator.close()


SPEAKS_LATE = """
import sys, time
print('{"endpoint": "tcp/127.0.0.1:1", "scene": "s", "target": "red", "colors": ["red"], "max_motions": 1,'
      ' "workspace_center": [0.5, 0, 0]}', flush=True)
sys.stdin.read(1)
time.sleep(0.2)
sys.exit("pybullet says something\\ngi-sim-robot: the physics has blown up")
"""


def test_what_it_says_shortly_after_it_fell_silent_is_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "speaks_late.py").write_text(SPEAKS_LATE)
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}{os.pathsep}{os.environ.get('PYTHONPATH', '')}")
    monkeypatch.setattr(sim_process, "_MODULE", "speaks_late")
    simulator = SimProcess("s", 0, 30.0)
    try:
        simulator.wait_until_ready()
        assert simulator._process.stdin is not None
        simulator._process.stdin.close()
        assert simulator.last_words() == "the physics has blown up"
    finally:
        simulator.close()


def test_one_that_serves_has_no_last_words() -> None:
    simulator = SimProcess("coordination-07", 0, 30.0)
    try:
        simulator.wait_until_ready()
        assert simulator.last_words() == ""
    finally:
        simulator.close()
