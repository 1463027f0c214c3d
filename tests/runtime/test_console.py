import errno
import io
import os
from typing import Any

from grasping_invisible.data.topics import CONSOLE, Topic
from grasping_invisible.runtime.bus import Bus
from grasping_invisible.runtime.console import RunConsole
from grasping_invisible.runtime.decision import DecisionSettings
from grasping_invisible.runtime.loop import RunPlan, run_loop


def test_a_person_sees_motion_place_reason_values_and_times(table_robot: Any, color_models: Any) -> None:
    stream = io.StringIO()
    said: list[str] = []

    def sink(topic: Topic, payload: bytes, time_ns: int) -> None:
        assert topic is CONSOLE
        said.append(CONSOLE.message.FromString(payload).message)  # pyright: ignore[reportAttributeAccessIssue]

    console = RunConsole(stream, Bus(sinks=(sink,)))
    run_loop(table_robot, color_models, DecisionSettings("red"), RunPlan(), (console,))
    text = stream.getvalue()
    for piece in (
        "1  push",
        "2  grasp",
        "yaw",
        "explorer",
        "coordinator",
        "q_g",
        "r_b",
        "p_grasp 0.90",
        "critic",
        " ms",
    ):
        assert piece in text
    assert "the target is in the gripper" in text
    assert text.splitlines() == said


def test_a_reader_that_has_gone_is_no_reason_to_end(table_robot: Any, color_models: Any) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "w") as stream:
        said: list[Topic] = []
        console = RunConsole(stream, Bus(sinks=(lambda topic, payload, time_ns: said.append(topic),)))
        progress = run_loop(table_robot, color_models, DecisionSettings("red"), RunPlan(), (console,))
    assert progress.grasped
    assert len(said) > 4


def test_a_full_disk_is_no_reason_to_end_nor_to_fail_at_the_end(table_robot: Any, color_models: Any) -> None:
    with open("/dev/full", "w") as stream:  # which is flushed when it is closed
        console = RunConsole(stream, Bus())
        assert run_loop(table_robot, color_models, DecisionSettings("red"), RunPlan(), (console,)).grasped


def test_a_terminal_that_has_gone_is_no_reason_to_end(table_robot: Any, color_models: Any) -> None:
    class Gone(io.StringIO):
        def write(self, text: str) -> int:
            raise OSError(errno.EIO, "Input/output error")

    said: list[Topic] = []
    console = RunConsole(Gone(), Bus(sinks=(lambda topic, payload, time_ns: said.append(topic),)))
    progress = run_loop(table_robot, color_models, DecisionSettings("red"), RunPlan(), (console,))
    assert progress.grasped
    assert said
