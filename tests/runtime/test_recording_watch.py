import errno
import io
import os
import time
from pathlib import Path
from typing import Any

import pytest

from grasping_invisible.data.log_file import LogFile
from grasping_invisible.data.recorder import Recorder
from grasping_invisible.runtime.bus import Bus
from grasping_invisible.runtime.console import RunConsole
from grasping_invisible.runtime.decision import DecisionSettings
from grasping_invisible.runtime.loop import RunPlan, run_loop
from grasping_invisible.runtime.recording_watch import RecordingWatch


def test_a_full_disk_is_told_once_during_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, table_robot: Any, color_models: Any
) -> None:
    def fails(self: LogFile, *arguments: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(LogFile, "write", fails)
    stream = io.StringIO()
    with Recorder(tmp_path / "run.mcap") as recorder:
        console = RunConsole(stream, Bus(sinks=(recorder,)))
        console.say("beginning")
        deadline = time.monotonic() + 5.0
        while recorder.failure is None and time.monotonic() < deadline:
            time.sleep(0.01)
        run_loop(
            table_robot,
            color_models,
            DecisionSettings("red"),
            RunPlan(),
            (console, RecordingWatch(recorder, console)),
        )
    lines = stream.getvalue().splitlines()
    (told,) = [index for index, line in enumerate(lines) if "No space left on device; the run goes on" in line]
    assert told < len(lines) - 1


def test_a_sound_recording_is_not_worth_a_word(tmp_path: Path, table_robot: Any, color_models: Any) -> None:
    stream = io.StringIO()
    with Recorder(tmp_path / "run.mcap") as recorder:
        watch = RecordingWatch(recorder, RunConsole(stream, Bus(sinks=(recorder,))))
        run_loop(table_robot, color_models, DecisionSettings("red"), RunPlan(), (watch,))
    assert stream.getvalue() == ""
