"""The robot's side of the protocol: puts a driver on the link. The simulator uses it; so can hardware."""

import queue
import threading
import time
from contextlib import suppress
from dataclasses import dataclass
from typing import Protocol

import zenoh
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from google.protobuf.message import DecodeError

from grasping_invisible.data.calibration_message import encode_calibration
from grasping_invisible.data.clock import to_timestamp
from grasping_invisible.data.images import encode_color, encode_depth
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.topics import (
    CAMERA_INFO,
    COLOR_IMAGE,
    COMMAND,
    DEPTH_IMAGE,
    JOINTS,
    OUTCOME,
    PROTOCOL_VERSION,
    ROBOT_HEALTH,
    ROBOT_TOKEN,
    RUNTIME_HEALTH,
    RUNTIME_TOKEN,
    STOP,
    TRANSFORMS,
)
from grasping_invisible.runtime import zenoh_session
from grasping_invisible.runtime.bus import Bus
from grasping_invisible.runtime.errors import RobotError
from grasping_invisible.runtime.frame import RgbdFrame
from grasping_invisible.runtime.heartbeat import Heartbeat

RUNTIME_SILENCE = 2.0  # seconds without a runtime's heartbeat after which a moving robot stops


class Driver(Protocol):
    """What a robot must do to be served."""

    def refusal(self, command: gi.MotionCommand) -> str | None:
        """Why a command will not be carried out, in one line; None where it will be tried."""
        ...

    def execute(self, command: gi.MotionCommand) -> gi.MotionOutcome:
        """Carry out one motion. Raises `RobotError` when the robot cannot go on."""
        ...

    def request_stop(self, reason: str) -> None:
        """Have the motion in progress, if any, end in a safe stop. Called from other threads; returns at once."""
        ...

    def heartbeat(self) -> gi.RobotHealth:
        """The state of the robot now, but for `active_command_id`. Called from another thread, ten times a second."""
        ...


@dataclass(frozen=True, eq=False)
class _Stop:
    """A stop somebody asked for. Compared by identity: a later one is another, whatever its reason."""

    reason: str


@dataclass(frozen=True)
class _Request:
    """A command as heard, and the stop that held then."""

    query: zenoh.Query
    command: gi.MotionCommand
    stop: _Stop | None


class RobotServer:
    """Serves a driver at `endpoint`.

    `next_command` and `carry_out` belong to one thread, the driver's; the heartbeat and the watch over the runtime
    run beside it, so that a stop gets through to a robot in motion. A stop holds, whether or not something moved when
    it came, until a `HOME` that was asked for after it is accepted.
    """

    def __init__(self, endpoint: str, driver: Driver) -> None:
        """Listen. Raises `BadInput` when `endpoint` cannot be listened at."""
        self._driver = driver
        self._session = zenoh_session.listen(endpoint)
        self.bus = Bus(self._session)
        self._requests: queue.SimpleQueue[_Request] = queue.SimpleQueue()
        self._lock = threading.Lock()
        self._busy_with: int | None = None
        self._commander: str | None = None  # the run whose command is carried out
        self._stopped: _Stop | None = None
        self._runtimes: dict[str, float] = {}  # run id: when it was last heard
        # Declarations end when they are no longer referred to.
        self._declared = (
            self._session.declare_queryable(COMMAND.key, self._hear_command),
            self._session.declare_subscriber(STOP.key, self._hear_stop),
            self._session.declare_subscriber(RUNTIME_HEALTH.key, self._hear_runtime),
            self._session.liveliness().declare_subscriber(RUNTIME_TOKEN, self._hear_token, history=True),
            self._session.liveliness().declare_token(ROBOT_TOKEN),
        )
        self._heartbeat = Heartbeat(self._beat, "robot health")

    def next_command(self, timeout: float) -> gi.MotionCommand | None:
        """The next command that the driver accepts, its sender told so; None when none came for `timeout` s."""
        try:
            request = self._requests.get(timeout=timeout)
        except queue.Empty:
            return None
        command = request.command
        reason = self._take_commander() or self._hold(command) or self._driver.refusal(command)
        if reason is None:
            self._end_stop(request)
        else:
            self._free()
        _answer(request.query, command.id, reason)
        return command if reason is None else None

    def carry_out(self, command: gi.MotionCommand) -> gi.MotionOutcome:
        """Execute a command from `next_command`; a robot that cannot go on is an outcome like any other."""
        started = time.time_ns()
        try:
            return self._driver.execute(command)
        except RobotError as error:
            return gi.MotionOutcome(
                command_id=command.id,
                started=to_timestamp(started),
                ended=to_timestamp(time.time_ns()),
                status=gi.FAULT,
                detail=str(error),
            )

    def publish_outcome(self, outcome: gi.MotionOutcome) -> None:
        """Tell how a motion ended, and take commands again."""
        self._free()
        self.bus.publish(OUTCOME, outcome)

    def publish_frame(self, frame: RgbdFrame, transforms: FrameTransforms, joints: JointStates) -> None:
        """Publish a camera frame and the robot's pose. All stamps must be the frame's."""
        camera, stamp = frame.camera, frame.stamp_ns
        self.bus.publish(TRANSFORMS, transforms)
        self.bus.publish(JOINTS, joints)
        self.bus.publish(CAMERA_INFO, encode_calibration(camera.intrinsics, camera.width, camera.height, stamp))
        self.bus.publish(DEPTH_IMAGE, encode_depth(frame.depth, stamp))
        self.bus.publish(COLOR_IMAGE, encode_color(frame.color, stamp))

    def close(self) -> None:
        """Fall silent and let go of the link."""
        self._heartbeat.stop()
        zenoh_session.close(self._session)

    def _free(self) -> None:
        with self._lock:
            self._busy_with = None
            self._commander = None

    def _hold(self, command: gi.MotionCommand) -> str | None:
        """Why a stop keeps the robot from carrying out a command, if it does."""
        with self._lock:
            if self._stopped is None or command.kind == gi.HOME:
                return None
            return f"stopped: {self._stopped.reason}; send HOME first"

    def _end_stop(self, request: _Request) -> None:
        """An accepted `HOME` ends the stop that it was asked for after; one that came since stops it in turn."""
        with self._lock:
            if request.command.kind == gi.HOME and self._stopped is request.stop:
                self._stopped = None

    def _take_commander(self) -> str | None:
        """Take the one runtime that is heard for the commander; where there is not exactly one, why not to move."""
        with self._lock:
            runtimes = self._living_runtimes()
            if len(runtimes) == 1:
                self._commander = runtimes[0]
                return None
        if not runtimes:
            return f"no runtime's heartbeat is heard on {RUNTIME_HEALTH.key}"
        return f"more than one runtime is connected: {', '.join(sorted(runtimes))}"

    def _living_runtimes(self) -> list[str]:
        now = time.monotonic()
        return [run for run, heard_at in self._runtimes.items() if now - heard_at < RUNTIME_SILENCE]

    def _beat(self) -> None:
        try:
            health = self._driver.heartbeat()
        except Exception as error:  # this thread watches over the runtime, too, and must go on
            health = _fault(f"the driver's heartbeat failed: {error!r}")
            self._latch(health.detail)
        with self._lock:
            busy_with, stopped = self._busy_with, self._stopped
            reason = None if stopped is None else stopped.reason
            # Others may be heard; only the one that commanded the motion watches over it.
            if self._commander is not None and self._commander not in self._living_runtimes():
                reason = reason or f"the runtime has been silent for {RUNTIME_SILENCE:g} s"
        if busy_with is not None and reason is not None:
            try:
                # Again at every beat: a stop that came before the driver had begun to move must not be lost.
                self._driver.request_stop(reason)
            except Exception as error:
                health = _fault(f"the driver cannot be stopped: {error!r}")
        elif reason is not None and health.state != gi.ROBOT_FAULT:
            health.state, health.detail = gi.SAFE_STOP, reason
        health.active_command_id = busy_with or 0
        self.bus.publish(ROBOT_HEALTH, health)

    def _latch(self, reason: str) -> None:
        with self._lock:
            self._stopped = self._stopped or _Stop(reason)

    def _stop(self, reason: str) -> None:
        with self._lock:
            self._stopped = _Stop(reason)
            busy = self._busy_with is not None
        if busy:
            self._driver.request_stop(reason)

    # ---- called by zenoh's threads; must not block ---------------------------------------------------

    def _hear_command(self, query: zenoh.Query) -> None:
        try:
            command = gi.MotionCommand.FromString(query.payload.to_bytes() if query.payload else b"")
        except DecodeError:
            _answer(query, 0, "the request's payload is no MotionCommand")
            return
        with self._lock:
            busy_with = self._busy_with
            if busy_with is None:
                self._busy_with = command.id
            stopped = self._stopped
        if busy_with is not None:
            _answer(query, command.id, f"motion {busy_with} has not ended yet")
            return
        self._requests.put(_Request(query, command, stopped))

    def _hear_stop(self, sample: zenoh.Sample) -> None:
        try:
            reason = gi.StopRequest.FromString(sample.payload.to_bytes()).reason
        except DecodeError:
            reason = ""  # whatever it says, someone wants the robot to stop
        self._stop(reason or "stop requested")

    def _hear_runtime(self, sample: zenoh.Sample) -> None:
        try:
            health = gi.RuntimeHealth.FromString(sample.payload.to_bytes())
        except DecodeError:
            return
        with self._lock:
            self._runtimes[health.run_id] = time.monotonic()

    def _hear_token(self, sample: zenoh.Sample) -> None:
        if sample.kind == zenoh.SampleKind.DELETE:
            with self._lock:
                self._runtimes.clear()  # others are heard again within a heartbeat
                busy = self._busy_with is not None
            if busy:  # else nothing is left to stop: the next run begins with HOME anyway
                self._stop("the runtime has gone")


def _fault(detail: str) -> gi.RobotHealth:
    """The heartbeat of a robot whose driver cannot give one."""
    stamp = to_timestamp(time.time_ns())
    return gi.RobotHealth(stamp=stamp, state=gi.ROBOT_FAULT, detail=detail, protocol_version=PROTOCOL_VERSION)


def _answer(query: zenoh.Query, command_id: int, refusal: str | None) -> None:
    reply = gi.CommandReply(command_id=command_id, accepted=refusal is None, reason=refusal or "")
    with suppress(zenoh.ZError):  # who asked may have gone; the watch over the runtime deals with that
        query.reply(COMMAND.key, reply.SerializeToString(deterministic=True))
    query.drop()
