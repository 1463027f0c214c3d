from pathlib import Path
from typing import Any

import numpy as np
import pytest
from google.protobuf.message import Message

from grasping_invisible.data import topics
from grasping_invisible.data.images import decode_color, decode_labels
from grasping_invisible.data.recorder import Recorder
from grasping_invisible.data.steps import steps
from grasping_invisible.runtime import run_log
from grasping_invisible.runtime.bus import Bus
from grasping_invisible.runtime.decision import DecisionSettings
from grasping_invisible.runtime.loop import RunPlan, run_loop
from grasping_invisible.runtime.run_log import RunFacts, RunLog, in_file_name

FACTS = RunFacts(
    run_id="r",
    project_version="0",
    bundle_sha256="b",
    onnxruntime_version="1",
    target="red",
    scene="table",
    seed=0,
    max_motions=5,
    config_toml="",
    robot="here",
)


class Heard:
    def __init__(self) -> None:
        self.messages: list[tuple[topics.Topic, Any]] = []

    def __call__(self, topic: topics.Topic, payload: bytes, time_ns: int) -> None:
        self.messages.append((topic, topic.message.FromString(payload)))

    def of(self, topic: topics.Topic) -> list[Any]:
        return [message for heard, message in self.messages if heard is topic]


@pytest.fixture
def heard(table_robot: Any, color_models: Any, tmp_path: Path) -> Heard:
    heard, recorder = Heard(), Recorder(tmp_path / "run.mcap")
    log = RunLog(Bus(sinks=(heard, recorder)), "red")
    log.started(FACTS)
    progress = run_loop(table_robot, color_models, DecisionSettings("red"), RunPlan(), (log,))
    log.ended("r", progress, 0)
    recorder.close()
    return heard


def test_each_step_says_all_that_belongs_to_it(heard: Heard) -> None:
    assert [decision.step for decision in heard.of(topics.DECISION)] == [0, 1]
    assert [maps.step for maps in heard.of(topics.HEIGHTMAPS)] == [0, 1, 2]
    assert [maps.step for maps in heard.of(topics.Q_MAPS)] == [0, 1]
    assert [result.target_grasped for result in heard.of(topics.STEP_RESULT)] == [False, True]
    assert len(heard.of(topics.MARKERS)) == len(heard.of(topics.VIEW)) == 2
    assert heard.messages[0][0] is topics.RUN_START
    assert heard.messages[-1][0] is topics.RUN_SUMMARY


def test_the_summary_is_the_runs(heard: Heard) -> None:
    (summary,) = heard.of(topics.RUN_SUMMARY)
    assert (summary.grasped, summary.found, summary.motions, summary.ended_because) == (True, True, 2, "grasped")
    assert 0 < summary.decision_ms_p50 <= summary.decision_ms_p99


def test_segmentation_shows_the_target_once_uncovered(heard: Heard) -> None:
    counts = [int(np.count_nonzero(decode_labels(image) == 1)) for image in heard.of(topics.SEGMENTATION)]
    assert counts == [0, 400, 0]


def test_the_picture_shows_camera_and_maps_and_differs_by_step(heard: Heard) -> None:
    first, second = (decode_color(image) for image in heard.of(topics.VIEW))
    assert first.shape == second.shape == (536, 1120, 3)
    assert np.abs(first.astype(int) - second).mean() > 1.0


def test_markers_point_where_the_decision_does(heard: Heard) -> None:
    for decision, markers in zip(heard.of(topics.DECISION), heard.of(topics.MARKERS), strict=True):
        motion = next(entity for entity in markers.entities if entity.id == "motion")
        positions = [drawn.pose.position for drawn in (*motion.arrows, *motion.cubes)]
        assert np.mean([p.x for p in positions]) == pytest.approx(decision.position.x)
        assert np.mean([p.y for p in positions]) == pytest.approx(decision.position.y)


def test_a_picture_that_fails_is_told_once_and_ends_no_run(
    table_robot: Any, color_models: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(*_: object) -> None:
        raise ValueError("no paint left")

    monkeypatch.setattr(run_log, "draw_decision", fail)
    heard = Heard()
    log = RunLog(Bus(sinks=(heard,)), "red")
    progress = run_loop(table_robot, color_models, DecisionSettings("red"), RunPlan(), (log,))
    log.ended("r", progress, 0)
    assert progress.grasped
    (told,) = heard.of(topics.CONSOLE)
    assert "no paint left" in told.message
    assert capsys.readouterr().err.splitlines() == [told.message]
    assert len(heard.of(topics.HEIGHTMAPS)) == 3
    assert not heard.of(topics.VIEW)


def test_the_log_reads_back_as_steps(heard: Heard, tmp_path: Path) -> None:
    logged = list(steps(tmp_path / "run.mcap"))
    assert [step.decision.step for step in logged] == [0, 1]
    for step in logged:
        present: list[Message | None] = [step.heightmaps, step.next_heightmaps, step.q_maps, step.result, step.start]
        assert all(part is not None for part in present)


@pytest.mark.parametrize(("name", "safe"), [("table-1.v2", "table-1.v2"), ("../../a b", "..-..-a-b"), ("ü[/]", "ü-")])
def test_a_name_in_a_file_name_leads_to_no_other_folder(name: str, safe: str) -> None:
    assert in_file_name(name) == safe
