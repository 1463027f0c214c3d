"""What the heartbeats in a log say beyond that all was well."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from grasping_invisible.data.log_commands import wording
from grasping_invisible.data.log_reader import LoggedMessage, read_messages
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.topics import ROBOT_HEALTH, RUNTIME_HEALTH

HEALTH_TOPICS = (ROBOT_HEALTH.key, RUNTIME_HEALTH.key)
SILENCE_NS = 1_500_000_000  # of a heartbeat that should come ten times a second; the runtime gives up after as long
_LINES = 20

_STATES = {gi.SAFE_STOP: "stood still after a stop", gi.ROBOT_FAULT: "was at fault"}
_SPEAKERS = {ROBOT_HEALTH.key: "robot", RUNTIME_HEALTH.key: "runtime"}


def health_events(log: Path, begins_ns: int) -> list[str]:
    """What the heartbeats in a log say, a line each; reads most of it. Raises `BadLog`."""
    watch = HealthWatch(begins_ns)
    for logged in read_messages(log, HEALTH_TOPICS):
        watch.take(logged)
    return list(watch.events())


@dataclass
class HealthWatch:
    """Takes the messages of a log in their order and keeps what a person should know of the heartbeats."""

    begins_ns: int | None = None  # of the log; None: with the first message
    _heard_ns: dict[str, int] = field(default_factory=dict)
    _state: int = gi.IDLE
    _events: list[str] = field(default_factory=list)
    _more: int = 0

    def take(self, logged: LoggedMessage) -> None:
        """See one message; those of other topics tell when the log begins."""
        now = logged.log_time_ns
        if self.begins_ns is None:
            self.begins_ns = now
        if logged.topic not in HEALTH_TOPICS:
            return
        before = self._heard_ns.get(logged.topic)
        if before is not None and now - before > SILENCE_NS:
            self._add(before, f"no heartbeat of the {_SPEAKERS[logged.topic]} for {(now - before) / 1e9:.1f} s")
        self._heard_ns[logged.topic] = now
        if isinstance(logged.message, gi.RobotHealth):
            self._see_state(now, logged.message)

    def events(self) -> Iterator[str]:
        """What happened, a line each, with the seconds since the log's beginning."""
        yield from self._events
        if self._more:
            yield f"and {self._more} more events"

    def _see_state(self, now: int, health: gi.RobotHealth) -> None:
        if health.state != self._state and health.state in _STATES:
            detail = f": {health.detail}" if health.detail else ""
            self._add(now, f"the robot {_STATES[health.state]}{detail}")
        self._state = health.state

    def _add(self, at_ns: int, what: str) -> None:
        if len(self._events) >= _LINES:
            self._more += 1
            return
        assert self.begins_ns is not None  # set by the first message
        self._events.append(f"after {wording.duration(at_ns - self.begins_ns)}: {what}")
