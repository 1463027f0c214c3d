from google.protobuf.message import Message

from grasping_invisible.data.health_events import HealthWatch
from grasping_invisible.data.log_reader import LoggedMessage
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.topics import ROBOT_HEALTH, RUN_START, RUNTIME_HEALTH, Topic

BEGIN_NS = 1_700_000_000_000_000_000


def events_of(*said: tuple[float, Topic, Message]) -> list[str]:
    watch = HealthWatch()
    for number, (seconds, topic, message) in enumerate(said):
        now = BEGIN_NS + round(seconds * 1e9)
        watch.take(LoggedMessage(topic.key, message, now, now, number))
    return list(watch.events())


def beat(seconds: float, state: gi.RobotState = gi.IDLE, detail: str = "") -> tuple[float, Topic, Message]:
    return seconds, ROBOT_HEALTH, gi.RobotHealth(state=state, detail=detail)


def test_steady_heartbeats_are_no_event() -> None:
    beats = [beat(number / 10, gi.MOVING if number > 5 else gi.IDLE) for number in range(30)]
    assert events_of((0.0, RUN_START, gi.RunStart()), *beats) == []


def test_silence_and_trouble_are_told_with_their_time() -> None:
    assert events_of(
        (0.0, RUN_START, gi.RunStart()),
        beat(1.0),
        beat(4.5),
        beat(4.6, gi.SAFE_STOP, "somebody asked"),
        beat(4.7, gi.SAFE_STOP, "somebody asked"),
        beat(4.8, gi.ROBOT_FAULT),
        (2.0, RUNTIME_HEALTH, gi.RuntimeHealth()),
        (70.0, RUNTIME_HEALTH, gi.RuntimeHealth()),
    ) == [
        "after 1.0 s: no heartbeat of the robot for 3.5 s",
        "after 4.6 s: the robot stood still after a stop: somebody asked",
        "after 4.8 s: the robot was at fault",
        "after 2.0 s: no heartbeat of the runtime for 68.0 s",
    ]


def test_no_flood_of_events() -> None:
    events = events_of(*(beat(10.0 * number) for number in range(60)))
    assert len(events) == 21
    assert events[-1] == "and 39 more events"
