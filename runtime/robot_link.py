"""A robot at the other end of the link, behind the same interface as one in this process."""

import threading
import time
from collections.abc import Callable
from typing import TypeVar

import zenoh
from google.protobuf.message import DecodeError

from grasping_invisible.data.clock import to_ns, to_timestamp
from grasping_invisible.data.enum_value import value_name
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.topics import (
    BY_KEY,
    COMMAND,
    COMMAND_REPLY,
    OUTCOME,
    PROTOCOL_VERSION,
    ROBOT_HEALTH,
    ROBOT_TOKEN,
    RUNTIME_HEALTH,
    RUNTIME_TOKEN,
    STOP,
)
from grasping_invisible.runtime import zenoh_session
from grasping_invisible.runtime.bus import Bus, Gaps
from grasping_invisible.runtime.errors import CommandRefused, LinkError, RobotError
from grasping_invisible.runtime.frame import RgbdFrame
from grasping_invisible.runtime.frame_sets import FrameSets
from grasping_invisible.runtime.heartbeat import Heartbeat
from grasping_invisible.runtime.link_settings import LinkSettings
from grasping_invisible.runtime.robot import motion_name

_TICK = 0.05  # seconds between two looks at the deadlines while waiting
_LAST_NEWS = 0.3  # seconds to wait for the news that a robot which does not answer is gone
_LOST_OUTCOME = 1.0  # seconds a robot may be idle after a command before its outcome counts as lost
# Nanoseconds by which an outcome may say that the motion ended before the robot's last heartbeat ahead of the command:
# more, and it is another motion's, or the robot's clock went back.
_CLOCK_SLACK_NS = 100_000_000

T = TypeVar("T")


class ZenohRobot:
    """Drives a robot that serves the protocol; see `grasping_invisible.runtime.robot.Robot`.

    Everything heard from the robot goes to the bus as it came. The robot's silence, its end and its faults
    are noticed while waiting for anything, and raised as `LinkError` or `RobotError`.
    """

    def __init__(self, locator: str, bus: Bus, settings: LinkSettings, run_id: str) -> None:
        """Connect and wait for the robot's heartbeat. Raises `BadInput`, `LinkError`, `RobotError`."""
        self._bus = bus
        self._settings = settings
        self._run_id = run_id
        self._active_command_id = 0
        self._changed = threading.Condition()
        self._frames = FrameSets()
        self._gaps = Gaps()
        self._outcomes: dict[int, gi.MotionOutcome] = {}
        self._health: gi.RobotHealth | None = None
        self._heard_at = time.monotonic()
        self._gone = False
        self._frames_from_ns = 0
        self._session = zenoh_session.connect(locator, settings.connect_seconds)
        self._heartbeat: Heartbeat | None = None
        try:
            self._await_turn(locator)
            self._listen()
            self._heartbeat = Heartbeat(self._beat, "runtime health")
            self._await_robot(locator)
        except BaseException:
            self.close()
            raise

    @property
    def health(self) -> gi.RobotHealth:
        """The robot's latest heartbeat."""
        assert self._health is not None  # the constructor waited for it
        return self._health

    @property
    def fault(self) -> str | None:
        """That the robot is at fault and why, in one line; None where it is not."""
        health = self.health  # it may change meanwhile
        if health.state != gi.ROBOT_FAULT:
            return None
        return f"the robot is at fault: {health.detail or 'it does not say why'}"

    @property
    def lost_messages(self) -> dict[str, int]:
        """How many of the robot's messages never came, by topic; none of a robot that does not number them."""
        with self._changed:
            return {topic: count for topic, count in self._gaps.lost.items() if count}

    def observe(self) -> RgbdFrame:
        """The first complete camera frame stamped at or after the last motion's end."""
        since = self._frames_from_ns
        parts = self._wait_for(
            lambda: self._frames.first_since(since),
            self._settings.frame_seconds,
            lambda: f"no complete camera frame; missing: {', '.join(self._frames.missing_since(since))}",
        )
        return parts.decode()

    def execute(self, command: gi.MotionCommand) -> gi.MotionOutcome:
        """Send a command and wait for its outcome; the motion is stopped when that does not come.

        Raises `CommandRefused` with the robot's reason, and `RobotError` or `LinkError` where it cannot go on.
        """
        with self._changed:
            self._outcomes.pop(command.id, None)  # of an earlier run's command with the same number
            self._frames.forget()  # nothing seen before a motion shows what came of it, whatever the stamps say
            asked_ns = max(to_ns(self.health.stamp), self._frames_from_ns)
        try:
            reply = self._request(command)
        except BaseException:
            self.stop("the runtime gave up waiting for an answer; the motion may have begun")
            raise
        if not reply.accepted:
            raise CommandRefused(f"the robot refused {motion_name(command)}: {reply.reason}")
        self._active_command_id = command.id
        try:
            outcome = self._wait_for(
                self._outcome_finder(command.id, asked_ns),
                self._settings.motion_seconds,
                lambda: f"{motion_name(command)} has not ended",
            )
        except BaseException:
            self.stop("the runtime gave up waiting for the motion's end")
            raise
        finally:
            self._active_command_id = 0
        _check_status(command, outcome)
        self._frames_from_ns = _end_of(command, outcome)
        return outcome

    def stop(self, reason: str) -> None:
        """Ask the robot to stand still; its own watch on the runtime does the same if this is lost."""
        self._bus.publish(STOP, gi.StopRequest(stamp=to_timestamp(time.time_ns()), reason=reason))

    def close(self) -> None:
        """End the connection; the robot notices at once."""
        if self._heartbeat is not None:
            self._heartbeat.stop()
        self._bus.disconnect()
        zenoh_session.close(self._session)

    def _await_turn(self, locator: str) -> None:
        """Wait until no other runtime is connected: a robot moves for one alone, and stops where it hears two."""
        deadline = time.monotonic() + self._settings.connect_seconds
        while list(self._session.liveliness().get(RUNTIME_TOKEN, timeout=_LAST_NEWS)):
            if time.monotonic() >= deadline:
                raise LinkError(f"another runtime is connected to the robot at {locator}; a robot moves for one alone")
            time.sleep(_TICK)

    def _listen(self) -> None:
        session = self._session
        self._bus.connect(session)
        # Declarations end when they are no longer referred to.
        self._declared = (
            # Not what this session says itself: that went to the bus when it was said.
            session.declare_subscriber("gi/robot/**", self._hear, allowed_origin=zenoh.Locality.REMOTE),
            session.liveliness().declare_subscriber(ROBOT_TOKEN, self._hear_token, history=True),
            session.liveliness().declare_token(RUNTIME_TOKEN),
        )

    def _await_robot(self, locator: str) -> None:
        seconds = self._settings.connect_seconds
        deadline = time.monotonic() + seconds
        with self._changed:
            while self._health is None:
                if time.monotonic() >= deadline:
                    raise LinkError(f"something answers at {locator}, but no robot is heard there within {seconds:g} s")
                self._changed.wait(_TICK)
        if self.health.protocol_version != PROTOCOL_VERSION:
            raise RobotError(
                f"the robot at {locator} speaks protocol version {self.health.protocol_version}, "
                f"this runtime {PROTOCOL_VERSION}"
            )

    # ---- called by zenoh's threads; must not block ---------------------------------------------------

    def _hear(self, sample: zenoh.Sample) -> None:
        topic = BY_KEY.get(str(sample.key_expr))
        if topic is None:
            return
        payload = sample.payload.to_bytes()
        self._bus.deliver(topic, payload)
        with self._changed:
            self._gaps.hear(topic, None if sample.attachment is None else sample.attachment.to_bytes())
            try:
                if topic is ROBOT_HEALTH:
                    self._health = gi.RobotHealth.FromString(payload)
                    self._heard_at = time.monotonic()
                elif topic is OUTCOME:
                    outcome = gi.MotionOutcome.FromString(payload)
                    self._outcomes[outcome.command_id] = outcome
                else:
                    self._frames.add(topic, payload)
            except DecodeError:
                return  # not what the topic promises: as good as not heard, and the deadlines notice
            self._changed.notify_all()

    def _hear_token(self, sample: zenoh.Sample) -> None:
        with self._changed:
            # For good: one that comes back has forgotten what it was asked.
            self._gone = self._gone or sample.kind == zenoh.SampleKind.DELETE
            self._changed.notify_all()

    def _beat(self) -> None:
        self._bus.publish(
            RUNTIME_HEALTH,
            gi.RuntimeHealth(
                stamp=to_timestamp(time.time_ns()),
                run_id=self._run_id,
                active_command_id=self._active_command_id,
            ),
        )

    # ---- waiting -----------------------------------------------------------------------------------

    def _wait_for(self, find: Callable[[], T | None], seconds: float, complaint: Callable[[], str]) -> T:
        """What `find` finds, looked for at every change. Raises when the robot is lost or time is up."""
        deadline = time.monotonic() + seconds
        with self._changed:
            while True:
                found = find()
                if found is not None:
                    return found
                self._check_robot()
                if time.monotonic() >= deadline:
                    raise LinkError(f"{complaint()} (waited {seconds:g} s)")
                self._changed.wait(_TICK)

    def _check_robot(self) -> None:
        if self._gone:
            raise LinkError("the robot has gone: its process ended or the connection broke")
        silent = time.monotonic() - self._heard_at
        if silent > self._settings.silence_seconds:
            raise LinkError(f"the robot has fallen silent: no heartbeat for {silent:.1f} s")
        fault = self.fault
        if fault is not None:
            raise RobotError(fault)

    def _outcome_finder(self, command_id: int, asked_ns: int) -> Callable[[], gi.MotionOutcome | None]:
        """Finds the outcome; raises `LinkError` once the robot stands idle without having sent it.

        `asked_ns`: the robot's clock when it was asked. What ended before is the outcome of another run's command with
        that number, said once more.
        """
        idle_since: float | None = None
        accepted_at = time.monotonic()
        earlier = ""

        def find() -> gi.MotionOutcome | None:
            nonlocal idle_since, earlier
            outcome = self._outcomes.pop(command_id, None)
            if outcome is not None and not 0 < to_ns(outcome.ended) < asked_ns - _CLOCK_SLACK_NS:
                return outcome
            if outcome is not None:
                earlier = "; one came that ended before that was sent, by the robot's own clock"
            moving = self.health.active_command_id == command_id or self.health.state == gi.MOVING
            if moving or self._heard_at < accepted_at:
                idle_since = None
            elif idle_since is None:
                idle_since = time.monotonic()
            elif time.monotonic() - idle_since > _LOST_OUTCOME:
                stands = value_name(gi.RobotState, self.health.state)
                why = f" ({self.health.detail})" if self.health.detail else ""
                raise LinkError(
                    f"the robot no longer moves, it is in {stands}{why}, but the outcome of command {command_id} never "
                    f"came{earlier}"
                )
            return None

        return find

    def _request(self, command: gi.MotionCommand) -> gi.CommandReply:
        """The robot's answer to a command. Raises `LinkError` when there is none, or more than one."""
        with self._changed:
            self._check_robot()  # while deciding it may have gone, and another one come
        replies: list[bytes] = []
        finished = threading.Event()

        def take(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                replies.append(reply.ok.payload.to_bytes())

        payload = command.SerializeToString(deterministic=True)
        self._bus.deliver(COMMAND, payload)
        self._session.get(
            COMMAND.key,
            zenoh.handlers.Callback(take, finished.set),
            payload=payload,
            timeout=self._settings.reply_seconds,
            # All of them, should there be several robots.
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
        )
        deadline = time.monotonic() + self._settings.reply_seconds + 0.5
        # A second robot may answer later than the first: it is over when every one has, or can no longer.
        while not finished.wait(_TICK) and time.monotonic() < deadline:
            if not replies:
                self._check_robot()
        if not replies:
            # A robot that died answers nothing, and that it is gone may be heard a moment later.
            with self._changed:
                self._changed.wait_for(lambda: self._gone, _LAST_NEWS)
            self._check_robot()
            raise LinkError(f"the robot did not answer command {command.id}")
        for reply in replies:
            self._bus.deliver(COMMAND_REPLY, reply)
        if len(replies) > 1:
            raise LinkError(f"{len(replies)} robots answer command {command.id} on this link; it takes one")
        try:
            reply = gi.CommandReply.FromString(replies[0])
        except DecodeError as error:
            raise LinkError(f"the robot's answer to command {command.id} is no CommandReply") from error
        if reply.command_id not in (0, command.id):
            raise LinkError(f"the robot's answer to command {command.id} is to command {reply.command_id}")
        return reply


def _check_status(command: gi.MotionCommand, outcome: gi.MotionOutcome) -> None:
    """Raises `RobotError` where an outcome does not say how the motion ended."""
    if outcome.status == gi.MOTION_STATUS_UNSPECIFIED or outcome.status not in gi.MotionStatus.values():
        said = value_name(gi.MotionStatus, outcome.status)
        raise RobotError(f"the robot's outcome of {motion_name(command)} has the status {said}")


def _end_of(command: gi.MotionCommand, outcome: gi.MotionOutcome) -> int:
    """When a motion ended, on the robot's clock. Raises `RobotError` where that cannot be: frames are chosen by it."""
    started, ended = to_ns(outcome.started), to_ns(outcome.ended)
    if ended <= 0 or ended < started:
        motion = motion_name(command)
        raise RobotError(
            f"the robot's outcome of {motion} is out of time: started at {started} ns, ended at {ended} ns"
        )
    return ended
