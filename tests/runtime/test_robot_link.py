"""Both sides of the protocol, over a real zenoh session on loopback, with a small robot that does not move."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

import numpy as np
import pytest
import zenoh
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from google.protobuf.message import Message

from grasping_invisible.data.clock import to_timestamp
from grasping_invisible.data.images import CAMERA_FRAME
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.topics import (
    COMMAND,
    COMMAND_REPLY,
    OUTCOME,
    PROTOCOL_VERSION,
    RUNTIME_HEALTH,
    STOP,
    TRUTH,
    Topic,
)
from grasping_invisible.data.transform_message import encode_transforms
from grasping_invisible.runtime import bus as bus_module
from grasping_invisible.runtime import zenoh_session
from grasping_invisible.runtime.bus import Bus
from grasping_invisible.runtime.errors import BadInput, LinkError, RobotError
from grasping_invisible.runtime.frame import Camera, RgbdFrame
from grasping_invisible.runtime.heartbeat import Heartbeat
from grasping_invisible.runtime.link_settings import LinkSettings
from grasping_invisible.runtime.robot_link import ZenohRobot
from grasping_invisible.runtime.robot_server import RobotServer

INTRINSICS = np.array([[60.0, 0, 31.5], [0, 60.0, 23.5], [0, 0, 1]])
BASE_FROM_CAMERA = np.array([[0.0, -1, 0, 0.9], [-1, 0, 0, 0.1], [0, 0, -1, 0.7], [0, 0, 0, 1]])
QUICK = LinkSettings(connect_seconds=2.0, silence_seconds=0.5, reply_seconds=0.5, motion_seconds=3.0, frame_seconds=1.0)


class StillRobot:
    """A driver whose motions only take time; the colour of its picture counts them."""

    def __init__(self) -> None:
        self.motion_seconds = 0.05
        self.motions = 0
        self.fault = ""
        self.heartbeat_failure: Exception | None = None
        self.tells_time = True
        self.clock_moves = 0.0  # seconds that its clock goes on, or back, as a motion begins
        self.status: gi.MotionStatus = gi.COMPLETED
        self.camera_ahead = 0.0  # seconds
        self.version = PROTOCOL_VERSION
        self.protocol_state: gi.RobotState = gi.IDLE
        self._stop = threading.Event()
        self._stop_reason = ""

    def refusal(self, command: gi.MotionCommand) -> str | None:
        return "too far away" if command.position.x > 10 else None

    def execute(self, command: gi.MotionCommand) -> gi.MotionOutcome:
        if self.fault:
            self.protocol_state = gi.ROBOT_FAULT
            raise RobotError(self.fault)
        moved_ns = round(self.clock_moves * 1e9)
        started = time.time_ns() + moved_ns
        self._stop.clear()
        stopped = self._stop.wait(self.motion_seconds)
        self.motions += 1
        return gi.MotionOutcome(
            command_id=command.id,
            started=to_timestamp(started),
            ended=to_timestamp(time.time_ns() + moved_ns) if self.tells_time else None,
            status=gi.STOPPED if stopped else self.status,
            detail=self._stop_reason if stopped else "done",
        )

    def request_stop(self, reason: str) -> None:
        self._stop_reason = reason
        self._stop.set()

    def heartbeat(self) -> gi.RobotHealth:
        if self.heartbeat_failure is not None:
            raise self.heartbeat_failure
        now = to_timestamp(time.time_ns())
        return gi.RobotHealth(stamp=now, state=self.protocol_state, robot_name="still", protocol_version=self.version)

    def frame(self) -> RgbdFrame:
        color = np.full((48, 64, 3), self.motions, np.uint8)
        depth = np.full((48, 64), 0.5 + self.motions / 100, np.float32)
        stamp_ns = time.time_ns() + round(self.camera_ahead * 1e9)
        return RgbdFrame(stamp_ns, color, depth, Camera(64, 48, INTRINSICS, BASE_FROM_CAMERA))


class Side:
    """The robot's process, as a thread."""

    def __init__(self, endpoint: str) -> None:
        self.endpoint = endpoint
        self.driver = StillRobot()
        self.server = RobotServer(self.endpoint, self.driver)
        self.says_outcome = True
        self.sends_frames = True
        self.pause = threading.Event()  # takes no commands while it is set
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._ended.is_set():
            if self.pause.is_set():
                time.sleep(0.05)
                continue
            command = self.server.next_command(0.05)
            if command is not None:
                outcome = self.server.carry_out(command)
                if self.says_outcome:
                    self.server.publish_outcome(outcome)
                else:
                    self.server._free()
            if self.sends_frames:
                frame = self.driver.frame()
                poses = encode_transforms({CAMERA_FRAME: BASE_FROM_CAMERA}, frame.stamp_ns)
                joints = JointStates(timestamp=to_timestamp(frame.stamp_ns))
                self.server.publish_frame(frame, poses, joints)

    def close(self) -> None:
        self._ended.set()
        self.driver.request_stop("test over")
        self._thread.join(5)
        self.server.close()


@pytest.fixture
def side(free_endpoint: str) -> Iterator[Side]:
    side = Side(free_endpoint)
    yield side
    side.close()


@contextmanager
def connected(side: Side, bus: Bus | None = None, run_id: str = "run") -> Iterator[ZenohRobot]:
    robot = ZenohRobot(side.endpoint, bus or Bus(), QUICK, run_id)
    try:
        yield robot
    finally:
        robot.close()


@contextmanager
def heartbeat_of(side: Side, run_id: str) -> Iterator[None]:
    """A runtime that does not care who else is there."""
    session = zenoh_session.connect(side.endpoint, 2.0)
    bus = Bus(session)

    def beat() -> None:
        bus.publish(RUNTIME_HEALTH, gi.RuntimeHealth(run_id=run_id))

    heartbeat = Heartbeat(beat, run_id)
    try:
        yield
    finally:
        heartbeat.stop()
        zenoh_session.close(session)


def command(number: int, x: float = 0.5) -> gi.MotionCommand:
    return gi.MotionCommand(id=number, kind=gi.PUSH, position=gi.Point(x=x, y=0, z=0.02), length=0.1)


def home(number: int) -> gi.MotionCommand:
    return gi.MotionCommand(id=number, kind=gi.HOME)


def wait_until(condition: Callable[[], bool], seconds: float = 10.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def execute_until_closed(robot: ZenohRobot) -> None:
    with suppress(RobotError):
        robot.execute(command(1))


def test_observes_acts_and_sees_what_came_of_it(side: Side) -> None:
    with connected(side) as robot:
        before = robot.observe()
        assert before.color[0, 0, 0] == 0
        assert before.depth[0, 0] == pytest.approx(0.5)
        assert np.allclose(before.camera.intrinsics, INTRINSICS)
        assert np.allclose(before.camera.base_from_camera, BASE_FROM_CAMERA)
        for number in (1, 2):
            outcome = robot.execute(command(number))
            assert (outcome.status, outcome.command_id) == (gi.COMPLETED, number)
            assert robot.observe().color[0, 0, 0] == number  # never a picture from before the motion


def test_everything_said_and_heard_reaches_the_sinks_as_it_travelled(side: Side) -> None:
    heard: list[tuple[str, bytes]] = []

    def sink(topic: Topic, payload: bytes, time_ns: int) -> None:
        heard.append((topic.key, payload))

    sent = command(7)
    with connected(side, Bus(sinks=(sink,))) as robot:
        robot.observe()
        robot.execute(sent)
    keys = [key for key, _ in heard]
    assert {"gi/robot/camera/color", "gi/robot/joints", "gi/robot/health", "gi/runtime/health"} <= set(keys)
    assert keys.index(COMMAND.key) < keys.index(COMMAND_REPLY.key) < keys.index(OUTCOME.key)
    assert dict(heard)[COMMAND.key] == sent.SerializeToString()


def test_a_refusal_is_an_error_with_the_robots_reason_and_nothing_moves(side: Side) -> None:
    with connected(side) as robot:
        with pytest.raises(RobotError, match="refused PUSH 1: too far away"):
            robot.execute(command(1, x=11))
        assert side.driver.motions == 0
        assert robot.execute(command(2)).status == gi.COMPLETED


def test_a_fault_in_a_motion_is_an_outcome(side: Side) -> None:
    side.driver.fault = "a joint is broken"
    with connected(side) as robot:
        outcome = robot.execute(command(1))
        assert (outcome.status, outcome.detail) == (gi.FAULT, "a joint is broken")


def test_a_robot_at_fault_is_not_waited_for(side: Side) -> None:
    side.sends_frames = False
    side.driver.protocol_state = gi.ROBOT_FAULT
    time.sleep(0.2)
    with connected(side) as robot, pytest.raises(RobotError, match="at fault"):
        robot.observe()


def test_nobody_there_is_a_link_error(free_endpoint: str) -> None:
    started = time.monotonic()
    with pytest.raises(LinkError, match="nothing answers"):
        ZenohRobot(free_endpoint, Bus(), LinkSettings(connect_seconds=0.3), "run")
    assert time.monotonic() - started < 1.5


def test_a_listener_that_is_no_robot_is_a_link_error(free_endpoint: str) -> None:
    session = zenoh_session.listen(free_endpoint)
    try:
        with pytest.raises(LinkError, match="no robot is heard"):
            ZenohRobot(free_endpoint, Bus(), LinkSettings(connect_seconds=0.3), "run")
    finally:
        zenoh_session.close(session)


def test_another_protocol_version_is_refused(side: Side) -> None:
    side.driver.version = 99
    time.sleep(0.15)
    with pytest.raises(RobotError, match="version 99"), connected(side):
        pass


def test_silence_while_moving_is_noticed(side: Side) -> None:
    side.driver.motion_seconds = 5.0
    with connected(side) as robot:
        threading.Timer(0.2, side.server._heartbeat.stop).start()
        started = time.monotonic()
        with pytest.raises(LinkError, match="silent"):
            robot.execute(command(1))
        assert time.monotonic() - started < 1.5


def test_a_robot_that_goes_away_is_noticed_at_once(side: Side) -> None:
    side.driver.motion_seconds = 5.0
    with connected(side) as robot:
        threading.Timer(0.2, side.server.close).start()
        started = time.monotonic()
        with pytest.raises(LinkError, match="gone"):
            robot.execute(command(1))
        assert time.monotonic() - started < 1.0


def test_a_lost_outcome_is_noticed(side: Side) -> None:
    side.says_outcome = False
    with connected(side) as robot, pytest.raises(LinkError, match="never came"):
        robot.execute(command(1))


def test_missing_frames_are_named(side: Side) -> None:
    side.sends_frames = False
    time.sleep(0.2)
    with connected(side) as robot, pytest.raises(LinkError, match="gi/robot/camera/depth"):
        robot.observe()


def test_stop_ends_the_motion_with_its_reason(side: Side) -> None:
    side.driver.motion_seconds = 5.0
    with connected(side) as robot:
        threading.Timer(0.2, robot.stop, args=("a hand is in the way",)).start()
        outcome = robot.execute(command(1))
        assert (outcome.status, outcome.detail) == (gi.STOPPED, "a hand is in the way")


def test_a_stop_between_motions_holds_until_home(side: Side) -> None:
    with connected(side) as robot:
        robot.stop("a hand is in the way")
        wait_until(lambda: robot.health.state == gi.SAFE_STOP)
        assert robot.health.detail == "a hand is in the way"
        with pytest.raises(RobotError, match="stopped: a hand is in the way; send HOME first"):
            robot.execute(command(1))
        assert side.driver.motions == 0
        assert robot.execute(home(2)).status == gi.COMPLETED
        assert robot.execute(command(3)).status == gi.COMPLETED
        wait_until(lambda: robot.health.state == gi.IDLE)


def test_a_stop_after_home_was_asked_for_is_not_ended_by_it(side: Side) -> None:
    side.driver.motion_seconds = 5.0
    side.pause.set()
    with connected(side) as robot:
        outcomes: list[gi.MotionOutcome] = []
        mover = threading.Thread(target=lambda: outcomes.append(robot.execute(home(1))), daemon=True)
        mover.start()
        wait_until(lambda: side.server._busy_with == 1)
        robot.stop("a hand is in the way")
        wait_until(lambda: side.server._stopped is not None)
        side.pause.clear()
        mover.join(3)
        assert [outcome.status for outcome in outcomes] == [gi.STOPPED]
        with pytest.raises(RobotError, match="send HOME first"):
            robot.execute(command(2))


def test_a_heartbeat_that_fails_stops_the_motion_and_is_a_fault(side: Side) -> None:
    side.driver.motion_seconds = 5.0
    with connected(side) as robot:
        mover = threading.Thread(target=execute_until_closed, args=(robot,), daemon=True)
        mover.start()
        wait_until(lambda: side.server._busy_with == 1)
        side.driver.heartbeat_failure = OSError("no such sensor")
        wait_until(lambda: robot.health.state == gi.ROBOT_FAULT)
        assert "no such sensor" in robot.health.detail
        wait_until(lambda: side.driver.motions == 1)  # long before it would have ended by itself
        side.driver.heartbeat_failure = None
        wait_until(lambda: robot.health.state == gi.SAFE_STOP)  # the thread lives, the stop holds
        mover.join(3)


def test_an_outcome_without_a_plausible_end_is_an_error(side: Side) -> None:
    side.driver.tells_time = False
    with connected(side) as robot, pytest.raises(RobotError, match="outcome of PUSH 1 is out of time"):
        robot.execute(command(1))


def test_a_motion_that_does_not_end_is_stopped(side: Side) -> None:
    side.driver.motion_seconds = 10.0
    with connected(side) as robot:
        with pytest.raises(LinkError, match="has not ended"):
            robot.execute(command(1))
        wait_until(lambda: side.driver.motions == 1)


def test_robot_stops_when_the_runtime_goes_away(side: Side) -> None:
    side.driver.motion_seconds = 10.0
    with connected(side) as robot:
        threading.Thread(target=execute_until_closed, args=(robot,), daemon=True).start()
        wait_until(lambda: side.server._busy_with == 1)
    wait_until(lambda: side.driver.motions == 1)
    assert side.driver._stop_reason == "the runtime has gone"


def test_robot_stops_when_the_runtime_falls_silent(side: Side) -> None:
    side.driver.motion_seconds = 10.0
    with connected(side) as robot:
        assert robot._heartbeat is not None
        threading.Timer(0.2, robot._heartbeat.stop).start()
        outcome = robot.execute(command(1))
        assert outcome.status == gi.STOPPED
        assert "silent" in outcome.detail


def test_another_runtime_does_not_stand_in_for_one_that_falls_silent(side: Side) -> None:
    side.driver.motion_seconds = 10.0
    with connected(side, run_id="first") as first:
        mover = threading.Thread(target=execute_until_closed, args=(first,), daemon=True)
        mover.start()
        wait_until(lambda: side.server._commander == "first")
        with heartbeat_of(side, "second"):
            assert first._heartbeat is not None
            first._heartbeat.stop()
            wait_until(lambda: side.driver.motions == 1, seconds=4.0)
            assert "silent" in side.driver._stop_reason
        mover.join(3)


def test_an_unanswered_command_is_stopped_should_it_have_been_heard(side: Side) -> None:
    side.pause.set()
    stops: list[str] = []

    def sink(topic: Topic, payload: bytes, time_ns: int) -> None:
        if topic is STOP:
            stops.append(gi.StopRequest.FromString(payload).reason)

    with connected(side, Bus(sinks=(sink,))) as robot:
        with pytest.raises(LinkError, match="did not answer"):
            robot.execute(command(1))
        time.sleep(0.2)
    assert stops == ["the runtime gave up waiting for an answer; the motion may have begun"]
    side.pause.clear()


def test_an_outcome_of_an_earlier_run_is_not_taken_for_this_ones(side: Side) -> None:
    with connected(side) as robot:
        side.server.bus.publish(OUTCOME, gi.MotionOutcome(command_id=1, status=gi.STOPPED, detail="long ago"))
        wait_until(lambda: 1 in robot._outcomes)
        assert robot.execute(command(1)).status == gi.COMPLETED


def test_two_runtimes_at_once_move_nothing(side: Side) -> None:
    with connected(side, run_id="first") as first, heartbeat_of(side, "second"):
        time.sleep(0.25)
        with pytest.raises(RobotError, match="first, second"):
            first.execute(command(1))


def test_a_second_runtime_waits_for_its_turn_and_disturbs_nothing(side: Side) -> None:
    with connected(side, run_id="first") as first:
        with pytest.raises(LinkError, match="another runtime is connected"), connected(side, run_id="second"):
            pass
        assert first.execute(command(1)).status == gi.COMPLETED
    with connected(side, run_id="second") as second:
        assert second.execute(command(1)).status == gi.COMPLETED


@pytest.mark.parametrize("late", [0.0, 0.25])
def test_two_robots_on_one_link_are_noticed_and_stopped(side: Side, late: float) -> None:
    other = zenoh_session.connect(side.endpoint, 2.0)
    accepted = gi.CommandReply(command_id=1, accepted=True).SerializeToString()

    def answer(query: zenoh.Query) -> None:
        time.sleep(late)
        query.reply(COMMAND.key, accepted)

    queryable = other.declare_queryable(COMMAND.key, answer)
    side.driver.motion_seconds = 5.0
    try:
        with connected(side) as robot:
            time.sleep(0.2)
            with pytest.raises(LinkError, match="2 robots answer command 1"):
                robot.execute(command(1))
            wait_until(lambda: side.driver.motions == 1, seconds=2.0)
    finally:
        queryable.undeclare()
        zenoh_session.close(other)


def test_an_outcome_that_is_said_once_more_is_not_taken_for_the_next(side: Side) -> None:
    side.driver.motion_seconds = 0.5
    long_ago = to_timestamp(time.time_ns() - 10**10)
    repeated = gi.MotionOutcome(command_id=1, started=long_ago, ended=long_ago, status=gi.COMPLETED, detail="long ago")
    with connected(side) as robot:
        threading.Timer(0.2, lambda: side.server.bus.publish(OUTCOME, repeated)).start()
        assert robot.execute(command(1)).detail == "done"


def test_a_clock_that_goes_back_ends_the_run(side: Side) -> None:
    side.driver.clock_moves = -30.0
    with (
        connected(side) as robot,
        pytest.raises(LinkError, match="one came that ended before that was sent"),
    ):
        robot.execute(command(1))


def test_nothing_that_was_seen_before_a_motion_is_taken_for_what_came_of_it(side: Side) -> None:
    side.driver.camera_ahead = 60.0
    with connected(side) as robot:
        robot.observe()
        side.sends_frames = False
        time.sleep(0.1)
        robot.execute(command(1))
        with pytest.raises(LinkError, match="no complete camera frame"):
            robot.observe()


@pytest.mark.parametrize(("status", "said"), [(gi.MOTION_STATUS_UNSPECIFIED, "MOTION_STATUS_UNSPECIFIED"), (17, "17")])
def test_an_outcome_that_does_not_say_how_it_ended_is_an_error(side: Side, status: gi.MotionStatus, said: str) -> None:
    side.driver.status = status
    with connected(side) as robot, pytest.raises(RobotError, match=f"PUSH 1 has the status {said}"):
        robot.execute(command(1))


def test_a_robot_that_does_not_say_which_command_it_carries_out_is_waited_for(
    side: Side, monkeypatch: pytest.MonkeyPatch
) -> None:
    publish = side.server.bus.publish

    def anonymous(topic: Topic, message: Message) -> bytes:
        if isinstance(message, gi.RobotHealth):
            message.active_command_id = 0
        return publish(topic, message)

    monkeypatch.setattr(side.server.bus, "publish", anonymous)
    side.driver.protocol_state = gi.MOVING
    side.driver.motion_seconds = 2.0
    with connected(side) as robot:
        assert robot.execute(command(1)).status == gi.COMPLETED


def test_a_second_command_while_moving_is_refused(side: Side) -> None:
    side.driver.motion_seconds = 0.5
    with connected(side) as robot:
        mover = threading.Thread(target=robot.execute, args=(command(1),), daemon=True)
        mover.start()
        wait_until(lambda: side.server._busy_with == 1)
        with pytest.raises(RobotError, match="motion 1 has not ended"):
            robot.execute(command(2))
        mover.join(3)


@pytest.mark.parametrize("locator", ["", "sim2", "127.0.0.1:7447", "tcp/", "tcp/host", "smoke/signal:1", "tcp/a b:1"])
def test_what_is_no_locator_is_bad_input(locator: str) -> None:
    with pytest.raises(BadInput, match="locator"):
        zenoh_session.connect(locator, 0.1)


def test_an_endpoint_in_use_is_bad_input(side: Side) -> None:
    with pytest.raises(BadInput, match="Address already in use"):
        zenoh_session.listen(side.endpoint)


def test_what_the_link_loses_is_counted(side: Side, monkeypatch: pytest.MonkeyPatch) -> None:
    put = bus_module.put

    def lossy(session: zenoh.Session, topic: Topic, payload: bytes, number: int) -> None:
        if topic is not TRUTH or number not in (3, 4, 6):
            put(session, topic, payload, number)

    with connected(side) as robot:
        robot.observe()
        assert robot.lost_messages == {}
        monkeypatch.setattr(bus_module, "put", lossy)
        for _ in range(8):
            side.server.bus.publish(TRUTH, gi.TruthState())
        wait_until(lambda: robot.lost_messages == {TRUTH.key: 3})
