"""A robot for `gi-bench recorder`: a process of its own that sends camera frames at a steady rate and plays motions.

Its frames are the simulator's, of a real push and of the arm at home before it, with a sensor's noise in colour and
depth; they are made beforehand, so that any rate can be kept, and sent in turn with new stamps.
"""

import threading
import time
from collections.abc import Callable
from itertools import cycle
from multiprocessing.connection import Connection
from typing import TypeVar

import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from grasping_invisible.data.calibration_message import encode_calibration
from grasping_invisible.data.clock import to_timestamp
from grasping_invisible.data.images import encode_color, encode_depth
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.topics import (
    CAMERA_INFO,
    COLOR_IMAGE,
    DEPTH_IMAGE,
    JOINTS,
    PROTOCOL_VERSION,
    TRANSFORMS,
    TRUTH,
)
from grasping_invisible.runtime.frame import RgbdFrame
from grasping_invisible.runtime.workspace import Workspace
from grasping_invisible.sim_robot.camera import DepthSensor
from grasping_invisible.sim_robot.node import serve_at_free_port
from grasping_invisible.sim_robot.robot import SimRobot
from grasping_invisible.sim_robot.scene import load_scene

SCENE = "exploration-03"
MOMENTS = 24  # of a push that are rendered
NOISES = 5  # frames made of each, and of the arm at home
COLOR_NOISE = 2.0  # standard deviation of a colour value
MOTION_SECONDS = 2.0

M = TypeVar("M", CompressedImage, RawImage, CameraCalibration, JointStates)


def serve(hz: float, pipe: Connection) -> None:
    """Serve until the parent ends this process; tells it the endpoint first."""
    robot = BenchRobot(*_frames())
    endpoint, server = serve_at_free_port(robot)
    pipe.send(endpoint)
    threading.Thread(target=_send_frames, args=(server.bus.publish, robot, hz), daemon=True).start()
    while True:
        command = server.next_command(1.0)
        if command is not None:
            server.publish_outcome(server.carry_out(command))


class _Frame:
    """All messages of one moment; `restamped` gives them the time at which they are sent."""

    def __init__(self, frame: RgbdFrame, transforms: FrameTransforms, joints: JointStates) -> None:
        camera = frame.camera
        self._transforms = transforms
        self._others = (
            (JOINTS, joints),
            (CAMERA_INFO, encode_calibration(camera.intrinsics, camera.width, camera.height, 0)),
            (DEPTH_IMAGE, encode_depth(frame.depth, 0)),
            (COLOR_IMAGE, encode_color(frame.color, 0)),
        )

    def restamped(self, stamp_ns: int):
        """Pairs of topic and message, all with that stamp."""
        stamp = to_timestamp(stamp_ns)
        for transform in self._transforms.transforms:
            transform.timestamp.CopyFrom(stamp)
        yield TRANSFORMS, self._transforms
        for topic, message in self._others:
            message.timestamp.CopyFrom(stamp)
            yield topic, message


class BenchRobot:
    """A driver whose motions take their time and move nothing; see `grasping_invisible.runtime.robot_server.Driver`.

    What it shows is `still` between motions and `moving` within them, over and over.
    """

    def __init__(self, still: list[_Frame], moving: list[_Frame]) -> None:
        self._still, self._in_motion = cycle(still), cycle(moving)
        self._moving = False

    def look(self) -> _Frame:
        """What the camera sees now. A stamp taken before is never later than the end of a motion that this shows."""
        return next(self._in_motion if self._moving else self._still)

    def refusal(self, command: gi.MotionCommand) -> str | None:
        """See `Driver`."""
        return None

    def execute(self, command: gi.MotionCommand) -> gi.MotionOutcome:
        """See `Driver`."""
        started = to_timestamp(time.time_ns())
        self._moving = True
        time.sleep(MOTION_SECONDS if command.kind in (gi.PUSH, gi.GRASP) else 0.0)
        self._moving = False
        return gi.MotionOutcome(
            command_id=command.id,
            started=started,
            ended=to_timestamp(time.time_ns()),
            status=gi.COMPLETED,
            detail="played",
            path_fraction=1.0,
        )

    def request_stop(self, reason: str) -> None:
        """See `Driver`."""

    def heartbeat(self) -> gi.RobotHealth:
        """See `Driver`."""
        return gi.RobotHealth(
            stamp=to_timestamp(time.time_ns()),
            state=gi.MOVING if self._moving else gi.IDLE,
            robot_name="gi-bench",
            protocol_version=PROTOCOL_VERSION,
        )


def _send_frames(publish: Callable[..., object], robot: BenchRobot, hz: float) -> None:
    truth = gi.TruthState(scene=SCENE, target_color=load_scene(SCENE).target)
    due = time.monotonic()
    while True:
        time.sleep(max(0.0, due - time.monotonic()))
        stamp = time.time_ns()
        truth.stamp.CopyFrom(to_timestamp(stamp))
        publish(TRUTH, truth)
        for topic, message in robot.look().restamped(stamp):
            publish(topic, message)
        due += 1.0 / hz


def _frames() -> tuple[list[_Frame], list[_Frame]]:
    """Of the arm at home, and of a push across the workspace: each moment several times with other noise."""
    moments: list[tuple[RgbdFrame, FrameTransforms, JointStates]] = []
    rng = np.random.default_rng(0)
    due = 0.0

    def moment() -> tuple[RgbdFrame, FrameTransforms, JointStates]:
        return robot.observe(), robot.transforms(0), robot.joint_states(0)

    def look(seconds: float) -> None:
        nonlocal due
        if seconds >= due and len(moments) < MOMENTS:
            due = seconds + 0.15
            moments.append(moment())

    robot = SimRobot(load_scene(SCENE), 0, on_tick=look)
    try:
        at_home = moment()
        x, y, _ = Workspace().center
        start = gi.Point(x=x - 0.05, y=y, z=0.03)
        robot.execute(gi.MotionCommand(id=1, kind=gi.PUSH, position=start, length=0.1))
    finally:
        robot.close()
    still = [_noisy(*at_home, rng) for _ in range(NOISES)]
    return still, [_noisy(*seen, rng) for _ in range(NOISES) for seen in moments]


def _noisy(frame: RgbdFrame, transforms: FrameTransforms, joints: JointStates, rng: np.random.Generator) -> _Frame:
    color = frame.color + rng.normal(0.0, COLOR_NOISE, frame.color.shape).astype(np.float32)
    depth = DepthSensor(int(rng.integers(1 << 31))).measure(frame.depth)
    noisy = RgbdFrame(0, np.clip(np.rint(color), 0, 255).astype(np.uint8), depth, frame.camera)
    again = FrameTransforms()
    again.CopyFrom(transforms)
    return _Frame(noisy, again, joints)
