"""Every method, in a whole run and on a log of it."""

from pathlib import Path

import pytest

from grasping_invisible.data.recorder import Recorder, RecordingSettings
from grasping_invisible.runtime.bus import Bus
from grasping_invisible.runtime.config import Config, PolicySettings, to_toml
from grasping_invisible.runtime.decision import DecisionSettings
from grasping_invisible.runtime.loop import RunPlan, run_loop
from grasping_invisible.runtime.methods import COORDINATION, EXPLORATION
from grasping_invisible.runtime.replay import replay_log
from grasping_invisible.runtime.run_log import RunFacts, RunLog

PAIRS = [(name, "coordinator") for name in EXPLORATION] + [("explorer", name) for name in COORDINATION]


@pytest.fixture
def logged_run(tmp_path: Path, recorded_robot, color_models):
    """Runs by two methods and gives the log."""

    def run(exploration: str, coordination: str) -> Path:
        path = tmp_path / "run.mcap"
        policy = PolicySettings(exploration, coordination)
        with Recorder(path, RecordingSettings(flush_seconds=0.0)) as recorder:
            bus = Bus(sinks=(recorder,))
            log = RunLog(bus, "red")
            log.started(RunFacts("r", "0", "b" * 64, "1", "red", "table", 3, 5, to_toml(Config(policy=policy)), "here"))
            robot = recorded_robot(bus.publish)
            robot.grasps_fail = 1
            settings = DecisionSettings("red", exploration=exploration, coordination=coordination)
            progress = run_loop(robot, color_models, settings, RunPlan(seed=3, max_motions=4), (log,))
            log.ended("r", progress, 0)
        return path

    return run


@pytest.mark.parametrize(("exploration", "coordination"), PAIRS)
def test_a_run_by_any_method_replays_exactly(exploration, coordination, logged_run, color_models) -> None:
    result = replay_log(logged_run(exploration, coordination), color_models)
    assert result.identical
    assert result.checked == len(result.decisions) > 1
    methods = {(decision.logged.policy, decision.logged.method) for decision in result.decisions}
    assert methods <= {("explorer", exploration), ("coordinator", coordination)}
    assert ("explorer", exploration) in methods  # the target is covered at first
