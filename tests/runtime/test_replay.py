from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from grasping_invisible.data import topics
from grasping_invisible.data.cli import main
from grasping_invisible.data.clock import to_ns
from grasping_invisible.data.errors import BadLog
from grasping_invisible.data.log_reader import read_messages
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.recorder import Recorder
from grasping_invisible.runtime.critic import QMaps
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.runtime.replay import OtherModels, differences, read_decisions, replay_log


class ShiftedModels:
    """Models that are a little off."""

    def __init__(self, models: Any, by: float) -> None:
        self.models, self.by = models, by
        self.segment = models.segment
        self.grasp_probability = models.grasp_probability

    def q_maps(self, maps: Any, mask: Any) -> QMaps:
        made = self.models.q_maps(maps, mask)
        return replace(made, push=made.push + np.float32(self.by))


def rewritten(path: Path, out: Path, change: Any) -> Path:
    """A copy of a log with each message changed, or left out where the change gives None."""
    with Recorder(out) as recorder:
        for logged in read_messages(path):
            message = change(logged.message)
            if message is not None:
                recorder.put(topics.BY_KEY[logged.topic], message.SerializeToString(), logged.log_time_ns)
    return out


def test_the_same_models_decide_the_same(recorded_run: Path, color_models: Any) -> None:
    heard: list[tuple[int, int]] = []
    result = replay_log(
        recorded_run,
        color_models,
        bundle_sha256="b" * 64,
        on_decision=lambda done, total: heard.append((done, total)),
    )
    assert [decision.logged.policy for decision in result.decisions] == ["explorer", "coordinator"]
    assert (result.checked, result.different, result.identical, result.damage) == (2, 0, True, ())
    assert heard == [(1, 2), (2, 2)]


def test_other_models_are_found_out_and_a_tolerance_forgives_them(recorded_run: Path, color_models: Any) -> None:
    shifted = ShiftedModels(color_models, 1e-4)
    result = replay_log(recorded_run, shifted)
    assert (result.checked, result.different, result.identical) == (2, 2, False)
    fields = {difference.field for difference in result.decisions[0].differences}
    assert {"value", "q_push"} <= fields
    assert replay_log(recorded_run, shifted, tolerance=1e-3).identical
    with pytest.raises(OtherModels, match="decided by bundle bbbbbbbbbbbb, these models are cccccccccccc"):
        replay_log(recorded_run, shifted, bundle_sha256="c" * 64)


@pytest.mark.parametrize(
    ("field", "value"),
    [("rotation", 3), ("row", 1), ("yaw", 0.1), ("policy", "x"), ("why", "x"), ("kind", gi.GRASP), ("seed", 4)],
)
def test_every_changed_field_is_a_difference(recorded_run: Path, field: str, value: Any) -> None:
    logged = read_decisions(recorded_run).decisions[0][0]
    other = gi.Decision()
    other.CopyFrom(logged)
    setattr(other, field, value)
    assert [difference.field for difference in differences(logged, other)] == [field]


def test_nested_and_absent_values_are_compared() -> None:
    one, two = gi.Decision(grasp_probability=float("nan")), gi.Decision(grasp_probability=float("nan"))
    one.position.x = 0.5
    two.memory.failed_pushes.add(x=0.1)
    found = {difference.field: (difference.logged, difference.recomputed) for difference in differences(one, two)}
    assert found == {
        "position.x": (0.5, 0.0),
        "memory.failed_pushes.length": (0, 1),
        "memory.failed_pushes[0].x": (None, 0.1),
        "memory.failed_pushes[0].y": (None, 0.0),
    }


def test_measured_times_are_not_compared() -> None:
    slow = gi.Decision(stages=[gi.StageTime(stage="critic", milliseconds=9.0)])
    slow.stamp.seconds = 5
    assert differences(gi.Decision(), slow) == ()


def test_a_cut_log_is_checked_as_far_as_it_goes(recorded_run: Path, color_models: Any) -> None:
    data = recorded_run.read_bytes()
    counts = set()
    for share in (0.3, 0.5, 0.7, 0.9):
        recorded_run.write_bytes(data[: int(share * len(data))])
        result = replay_log(recorded_run, color_models)
        assert result.identical
        assert result.damage
        counts.add(result.checked)
    assert {1, 2} <= counts | {0}


def test_what_is_missing_is_said(recorded_run: Path, color_models: Any, tmp_path: Path) -> None:
    def without_depth(message: Any) -> Any:
        return None if "RawImage" in message.DESCRIPTOR.full_name else message

    def without_start(message: Any) -> Any:
        return None if isinstance(message, gi.RunStart) else message

    def without_camera(message: Any) -> Any:
        return None if message.DESCRIPTOR.full_name.startswith("foxglove.") else message

    for change, reason in (
        (without_depth, "the log lacks gi/robot/camera/depth of its camera frame"),
        (without_start, "the start of its run is not in the log"),
        (without_camera, "its camera frame is not in the log"),
    ):
        result = replay_log(rewritten(recorded_run, tmp_path / f"{change.__name__}.mcap", change), color_models)
        assert [decision.unchecked for decision in result.decisions] == [reason, reason]
        assert result.checked == 0


@pytest.mark.parametrize(
    ("field", "value", "reason"),
    [("config_toml", "[policy", "not TOML"), ("target_color", "pink", "unknown target")],
)
def test_settings_that_cannot_be_used_are_bad_input(
    recorded_run: Path, color_models: Any, tmp_path: Path, field: str, value: str, reason: str
) -> None:
    def change(message: Any) -> Any:
        if isinstance(message, gi.RunStart):
            setattr(message, field, value)
        return message

    with pytest.raises(BadInput, match=reason):
        replay_log(rewritten(recorded_run, tmp_path / "changed.mcap", change), color_models)


def test_a_file_that_is_no_log_is_refused(tmp_path: Path, color_models: Any) -> None:
    (tmp_path / "junk.mcap").write_bytes(b"junk")
    with pytest.raises(BadLog):
        replay_log(tmp_path / "junk.mcap", color_models)


@pytest.fixture
def shipped(monkeypatch: pytest.MonkeyPatch, color_models: Any) -> Any:
    """Models in the place of the shipped ones, which may be trained again at any time."""
    color_models.sha256, color_models.onnxruntime_version = "b" * 64, "1"
    monkeypatch.setattr("grasping_invisible.runtime.bundle.load_bundle", lambda folder: color_models)
    return color_models


def test_command_prints_a_table_and_ends_with_its_finding(recorded_run: Path, shipped: Any, capsys: Any) -> None:
    assert main(["replay", str(recorded_run)]) == 0
    said = capsys.readouterr().out
    assert said.count("identical") == 2
    assert "2 decisions: all as logged, exactly" in said
    shipped.q_maps = ShiftedModels(type(shipped)(), 0.01).q_maps
    assert main(["replay", str(recorded_run)]) == 1
    said = capsys.readouterr().out
    assert "value 0.3" in said
    assert "2 decisions: 2 not as logged, compared exactly" in said
    assert main(["replay", str(recorded_run), "--tolerance", "0.1"]) == 0


def test_command_says_how_many_decisions_it_could_check(
    recorded_run: Path, shipped: Any, tmp_path: Path, capsys: Any
) -> None:
    last = to_ns(read_decisions(recorded_run).decisions[-1][0].frame_stamp)

    def without_last_color(message: Any) -> Any:
        return None if getattr(message, "format", "") == "png" and to_ns(message.timestamp) == last else message

    path = rewritten(recorded_run, tmp_path / "changed.mcap", without_last_color)
    path.write_bytes(path.read_bytes()[:-200])
    assert main(["replay", str(path)]) == 0
    said = capsys.readouterr().out
    assert "damage: " in said
    assert "not checked" in said
    assert "1 of 2 decisions that could be read could be checked: all as logged, exactly" in said


def test_command_refuses_other_models_unless_told(recorded_run: Path, shipped: Any, capsys: Any) -> None:
    shipped.sha256 = "c" * 64
    assert main(["replay", str(recorded_run)]) == 2
    said = capsys.readouterr().err
    assert "--force" in said
    assert said.count("\n") == 1
    assert main(["replay", str(recorded_run), "--force"]) == 0


def test_command_with_nothing_to_compare_is_code_2(recorded_run: Path, shipped: Any, tmp_path: Path, capsys) -> None:
    def without(*types: str) -> Any:
        return lambda message: None if message.DESCRIPTOR.name in types else message

    blind = rewritten(recorded_run, tmp_path / "blind.mcap", without("RawImage"))
    idle = rewritten(recorded_run, tmp_path / "idle.mcap", without("Decision"))
    assert main(["replay", str(blind)]) == 2
    assert "no decision" in capsys.readouterr().err
    assert main(["replay", str(idle)]) == 2
    assert "holds no decision" in capsys.readouterr().err


def test_command_refuses_a_missing_bundle_in_one_line(recorded_run: Path, tmp_path: Path, capsys: Any) -> None:
    assert main(["replay", str(recorded_run), "--models", str(tmp_path / "none")]) == 2
    said = capsys.readouterr().err
    assert "no model bundle" in said
    assert said.count("\n") == 1


def test_command_refuses_a_tolerance_below_nothing(recorded_run: Path, capsys: Any) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["replay", str(recorded_run), "--tolerance", "-1"])
    assert "'-1' is not a number from 0 on" in capsys.readouterr().err


def test_command_on_many_logs_ends_with_a_total(recorded_run: Path, shipped: Any, tmp_path: Path, capsys: Any) -> None:
    logs = tmp_path / "logs"
    logs.mkdir()
    for name in ("a", "b", "c"):
        (logs / f"{name}.mcap").write_bytes(recorded_run.read_bytes())
    assert main(["replay", str(logs)]) == 0
    assert "3 of 3 logs, 6 of 6 decisions compared exactly: all as logged" in capsys.readouterr().out
    (logs / "b.mcap").write_bytes(b"junk")
    assert main(["replay", str(logs)]) == 2
    said = capsys.readouterr().out
    assert "b.mcap is not an MCAP log" in said
    assert "2 of 3 logs, 4 of 4 decisions compared exactly: all as logged" in said
    shipped.q_maps = ShiftedModels(type(shipped)(), 0.01).q_maps
    assert main(["replay", str(logs / "a.mcap"), str(logs / "c.mcap"), str(logs / "b.mcap")]) == 1
    assert "2 of 3 logs, 4 of 4 decisions compared exactly: 4 not as logged" in capsys.readouterr().out
