"""What `gi-robot check` looks at: whether a robot keeps the protocol that the runtime relies on."""

import math
import time
from collections import defaultdict
from dataclasses import dataclass, field

import numpy as np
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from google.protobuf.message import DecodeError
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import PUSH_LENGTH
from grasping_invisible.data.classes import CLASSES, TARGET_COLORS
from grasping_invisible.data.clock import to_ns, to_timestamp
from grasping_invisible.data.enum_value import value_name
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.topics import (
    CAMERA_INFO,
    COLOR_IMAGE,
    DEPTH_IMAGE,
    JOINTS,
    ROBOT_HEALTH,
    TRANSFORMS,
    Topic,
)
from grasping_invisible.runtime.bus import Bus
from grasping_invisible.runtime.errors import CommandRefused, LinkError, RobotError
from grasping_invisible.runtime.frame import RgbdFrame
from grasping_invisible.runtime.heartbeat import PERIOD
from grasping_invisible.runtime.link_settings import LinkSettings
from grasping_invisible.runtime.motion import FINGERTIPS, MIN_TCP_HEIGHT
from grasping_invisible.runtime.perception import MIN_TARGET_PIXELS, Segmenter, target_patches
from grasping_invisible.runtime.robot_link import ZenohRobot
from grasping_invisible.runtime.view import view_of
from grasping_invisible.runtime.workspace import Workspace

LISTEN_SECONDS = 3.0
_CLOCK_SECONDS = 1.0  # between the robot's clock and this machine's, before it is worth a word
# Metres from the table's height, above or below, of the lower parts of each quarter of what is seen, at most: so far
# above the table the fingertips stay, and no farther. A camera that is tilted is right in the middle alone.
_FLOOR = MIN_TCP_HEIGHT - FINGERTIPS
_SEEN_SHARE = 0.5  # of the workspace's cells, that a camera in the right place sees


@dataclass(frozen=True)
class Check:
    """One thing looked at. `passed`: None is a remark, neither good nor bad."""

    name: str
    passed: bool | None
    detail: str


@dataclass
class Hearing:
    """A sink that notes what came and when."""

    times: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    earliest: dict[str, bytes] = field(default_factory=dict)
    latest: dict[str, bytes] = field(default_factory=dict)

    def __call__(self, topic: Topic, payload: bytes, time_ns: int) -> None:
        """See `Sink`."""
        self.times[topic.key].append(time_ns * 1e-9)
        self.earliest.setdefault(topic.key, payload)
        self.latest[topic.key] = payload


def check_robot(
    locator: str, settings: LinkSettings, workspace: Workspace, segmenter: Segmenter, *, move: bool
) -> list[Check]:
    """Connect, listen for a while, say what the segmenter makes of a frame, and try what must be refused.

    Unless `move`, nothing is sent that could move even a robot that refuses nothing.

    Raises `BadInput` and `LinkError` as connecting does.
    """
    hearing = Hearing()
    robot = ZenohRobot(locator, Bus(sinks=(hearing,)), settings, "gi-robot-check")
    try:
        hearing.times.clear()  # what came while connecting says nothing about rates
        hearing.earliest.clear()
        time.sleep(LISTEN_SECONDS)
        checks = [_health_rate(hearing), _clock(robot.health), *_camera_topics(hearing), _stamps(hearing)]
        checks += _frame(robot, workspace, segmenter)
        checks.append(_kind(robot))
        if move:
            checks += [_home(robot), _bounds(robot, workspace)]
        return checks
    finally:
        robot.close()


def _health_rate(hearing: Hearing) -> Check:
    times = hearing.times[ROBOT_HEALTH.key]
    gaps = np.diff(times) if len(times) > 1 else np.array([LISTEN_SECONDS])
    rate, longest = 1.0 / gaps.mean(), gaps.max()
    ok = bool(rate > 0.5 / PERIOD and longest < 1.0)
    return Check("heartbeat", ok, f"{rate:.1f} Hz (10 wanted), longest silence {longest:.2f} s (below 1 wanted)")


def _clock(health: gi.RobotHealth) -> Check:
    offset = (to_ns(health.stamp) - time.time_ns()) * 1e-9
    if abs(offset) < _CLOCK_SECONDS:
        return Check("clock", True, f"within {_CLOCK_SECONDS:g} s of this machine's")
    return Check("clock", None, f"{offset:+.1f} s from this machine's; logs are easier to read with clocks in step")


def _camera_topics(hearing: Hearing) -> list[Check]:
    checks = []
    for topic in (COLOR_IMAGE, DEPTH_IMAGE, CAMERA_INFO, TRANSFORMS, JOINTS):
        count = len(hearing.times[topic.key])
        detail = f"{count} messages in {LISTEN_SECONDS:g} s"
        try:
            topic.message.FromString(hearing.latest.get(topic.key, b""))
        except DecodeError:
            count, detail = 0, f"the payload is no {topic.message.DESCRIPTOR.full_name}"
        checks.append(Check(topic.key, count > 0, detail))
    return checks


def _stamps(hearing: Hearing) -> Check:
    """Frames of a camera that stands still are new ones all the same."""
    try:
        first, last = (
            to_ns(CompressedImage.FromString(heard.get(COLOR_IMAGE.key, b"")).timestamp)
            for heard in (hearing.earliest, hearing.latest)
        )
    except DecodeError as error:
        return Check("stamps", False, str(error))
    seconds = (last - first) * 1e-9
    return Check("stamps", seconds > 0, f"those of the colour images go on by {seconds:.2f} s in {LISTEN_SECONDS:g} s")


def _frame(robot: ZenohRobot, workspace: Workspace, segmenter: Segmenter) -> list[Check]:
    try:
        frame = robot.observe()
    except LinkError as error:
        return [Check("frame", False, f"no colour, depth, calibration and transforms that share a stamp: {error}")]
    except RobotError as error:
        return [Check("frame", False, str(error))]
    camera = frame.camera
    size = f"{camera.width} x {camera.height}, focal length {camera.intrinsics[0, 0]:.0f} px"
    paired = Check("frame", True, f"colour and depth in pairs, {size}")
    return [paired, _view(frame, workspace), _colors(segmenter.segment(frame.color))]


def _view(frame: RgbdFrame, workspace: Workspace) -> Check:
    """The camera's pose and the workspace fit together when most of the workspace is seen, near the table's height.

    What is a few centimetres aside, or turned about the vertical, passes: a table looks alike everywhere.
    """
    view = view_of(frame, workspace)
    name, floor = max(view.floors.items(), key=lambda item: abs(item[1]), default=("", math.inf))
    ok = view.share >= _SEEN_SHARE and abs(floor) < _FLOOR
    seen = f"{view.share:.0%} of the workspace is seen"
    if name:
        seen += f", its lower parts {abs(floor) * 1000:.0f} mm {'above' if floor >= 0 else 'below'} the table {name}"
    return Check("calibration", ok, f"{seen} ({_SEEN_SHARE:.0%} and at most {_FLOOR * 1000:.0f} mm anywhere wanted)")


def _colors(labels: NDArray[np.uint8]) -> Check:
    """A remark, as only a person knows what lies there; one camera's red is blue where a driver swaps channels."""
    pixels = {name: int(np.count_nonzero(target_patches(labels == CLASSES.index(name)))) for name in TARGET_COLORS}
    seen = [f"{name} ({count} px)" for name, count in pixels.items() if count >= MIN_TARGET_PIXELS]
    return Check("colours", None, f"the segmenter sees {', '.join(seen) or 'no target'}; is that what lies there?")


def _kind(robot: ZenohRobot) -> Check:
    """A kind of motion that there is not must be refused."""
    command = gi.MotionCommand(id=1, stamp=to_timestamp(time.time_ns()), kind=gi.MOTION_KIND_UNSPECIFIED)
    return _refusal("refusal", "a command of no kind", robot, command)


def _bounds(robot: ZenohRobot, workspace: Workspace) -> Check:
    """A push that starts a metre outside must be refused; it would be unreachable, too."""
    command = gi.MotionCommand(
        id=3,
        stamp=to_timestamp(time.time_ns()),
        kind=gi.PUSH,
        position=gi.Point(x=workspace.high[0] + 1.0, y=workspace.center[1], z=workspace.center[2] + 0.1),
        length=PUSH_LENGTH,
    )
    return _refusal("bounds", "a push out of bounds", robot, command)


def _refusal(name: str, what: str, robot: ZenohRobot, command: gi.MotionCommand) -> Check:
    fault = robot.fault
    if fault is not None:
        return Check(name, None, f"not asked for: {fault}")
    try:
        outcome = robot.execute(command)
    except LinkError as error:
        return Check(name, False, f"no answer to {what}: {error}")
    except CommandRefused as error:
        if robot.health.state in (gi.IDLE, gi.MOVING):
            return Check(name, True, str(error))
        return Check(name, None, f"{error}; but it would be in {value_name(gi.RobotState, robot.health.state)}, too")
    except RobotError as error:
        return Check(name, False, f"accepted {what}: {error}")
    return Check(name, False, f"accepted {what}: {gi.MotionStatus.Name(outcome.status)}")


def _home(robot: ZenohRobot) -> Check:
    command = gi.MotionCommand(id=2, stamp=to_timestamp(time.time_ns()), kind=gi.HOME)
    try:
        outcome = robot.execute(command)
        robot.observe()
    except RobotError as error:
        return Check("home", False, str(error))
    return Check("home", outcome.status == gi.COMPLETED, f"{gi.MotionStatus.Name(outcome.status)}: {outcome.detail}")
