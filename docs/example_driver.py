"""A driver to begin with: all that the robot protocol asks for, around an arm and a camera that are yours to write.

    python docs/example_driver.py tcp/127.0.0.1:7447
    gi-robot check tcp/127.0.0.1:7447 --move

`Arm` only waits where yours moves, and `Camera` sees an empty table. With them the check passes; replace one after the
other and check again.
"""

import sys
import threading
import time

import numpy as np
from foxglove_schemas_protobuf.JointState_pb2 import JointState
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from numpy.typing import NDArray

from grasping_invisible.data.clock import to_timestamp
from grasping_invisible.data.images import CAMERA_FRAME
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.topics import PROTOCOL_VERSION
from grasping_invisible.data.transform_message import encode_transforms
from grasping_invisible.runtime.errors import RobotError
from grasping_invisible.runtime.frame import Camera as CameraModel
from grasping_invisible.runtime.frame import RgbdFrame
from grasping_invisible.runtime.robot_server import RobotServer

FRAME_SECONDS = 0.3  # between two frames while the arm stands still
# Your own bounds, whatever the runtime's are: metres in panda_link0.
LOW, HIGH = np.array([0.28, -0.25, 0.01]), np.array([0.78, 0.25, 0.25])
LONGEST_PUSH, WIDEST = 0.1, 0.08


class ArmFailed(Exception):
    """The arm cannot go on without a person."""


class Arm:
    """Replace me. A motion takes as long as it takes, in the thread that asks for it, and ends at home."""

    def __init__(self) -> None:
        self.joints = {f"panda_joint{number}": 0.0 for number in range(1, 8)}  # radians
        self.gripper_width = 0.08  # metres
        self.holding = False  # do the closed fingers hold something?
        self._stop = threading.Event()

    def carry_out(self, command: gi.MotionCommand) -> tuple[gi.MotionStatus, float]:
        """How the motion ended, and how much of its way was made; docs/robot-protocol.md has the tables.

        Raises `ArmFailed` when the arm is at fault.
        """
        self._stop.clear()
        # COMPLETED, BLOCKED where it met too much resistance, UNREACHABLE where it cannot come to.
        return (gi.STOPPED, 0.0) if self._stop.wait(0.5) else (gi.COMPLETED, 1.0)

    def stop(self) -> None:
        """Stand still as fast as is safe. Comes from another thread, perhaps several times."""
        self._stop.set()


class Camera:
    """Replace me. The transform from the base is what your extrinsic calibration (eye-to-hand) found."""

    def __init__(self) -> None:
        focal, width, height = 615.0, 640, 480
        intrinsics = np.array([[focal, 0.0, (width - 1) / 2], [0.0, focal, (height - 1) / 2], [0.0, 0.0, 1.0]])
        base_from_camera = np.array(  # straight above; x right, y down, z forward, as in optical frames
            [[0.0, -1.0, 0.0, 0.53], [-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.7], [0.0, 0.0, 0.0, 1.0]]
        )
        self.model = CameraModel(width, height, intrinsics, base_from_camera)

    def grab(self) -> tuple[int, NDArray[np.uint8], NDArray[np.float32]]:
        """The latest frame: when it was exposed, ns of this computer's clock; RGB; depth in metres, registered to it.

        Never one that was exposed before the last motion ended: empty the camera's buffer first.
        """
        rng = np.random.default_rng(0)
        color = rng.integers(90, 110, (self.model.height, self.model.width, 3), np.uint8)
        return time.time_ns(), color, np.full((self.model.height, self.model.width), 0.7, np.float32)


class Driver:
    """What `RobotServer` asks of a robot, see `runtime.robot_server.Driver`."""

    def __init__(self, arm: Arm) -> None:
        self.arm = arm
        self.state: gi.RobotState = gi.IDLE
        self.trouble = ""

    def refusal(self, command: gi.MotionCommand) -> str | None:
        """Say no before anything moves. What can be tried and may fail is better tried: a refusal ends the run."""
        if self.state == gi.ROBOT_FAULT:
            return f"at fault: {self.trouble}"
        if command.kind == gi.HOME:
            return None
        if self.state == gi.SAFE_STOP:
            return "it stands still after a stop; send HOME first"
        if command.kind == gi.PLACE:
            return None
        if command.kind not in (gi.PUSH, gi.GRASP):
            return f"no motion of kind {command.kind}"
        if self.arm.holding:
            return "something is held; send PLACE first"
        x, y, z, yaw = command.position.x, command.position.y, command.position.z, command.yaw
        length = command.length if command.kind == gi.PUSH else 0.0
        start = np.array([x, y, z])
        end = start + length * np.array([np.cos(yaw), np.sin(yaw), 0.0])
        for point in (start, end):
            if not (np.isfinite(point).all() and (point >= LOW).all() and (point <= HIGH).all()):
                return f"{point.round(3).tolist()} m is out of bounds"
        if not (0.0 <= length <= LONGEST_PUSH + 1e-9 and 0.0 <= command.opening <= WIDEST + 1e-9):
            return f"length {length:.3f} m or opening {command.opening:.3f} m is out of bounds"
        return None

    def execute(self, command: gi.MotionCommand) -> gi.MotionOutcome:
        """Carry out one motion. `RobotError` becomes the outcome FAULT; any other exception would end this driver."""
        started, self.state = time.time_ns(), gi.MOVING
        try:
            status, fraction = self.arm.carry_out(command)
        except ArmFailed as error:
            self.state, self.trouble = gi.ROBOT_FAULT, str(error)
            raise RobotError(str(error)) from error
        self.state = gi.SAFE_STOP if status == gi.STOPPED else gi.IDLE
        return gi.MotionOutcome(
            command_id=command.id,
            started=to_timestamp(started),
            ended=to_timestamp(time.time_ns()),
            status=status,
            holding=self.arm.holding,
            gripper_width=self.arm.gripper_width,
            path_fraction=fraction,
        )

    def request_stop(self, reason: str) -> None:
        """Somebody asked for a stop, or the runtime is gone."""
        self.arm.stop()

    def heartbeat(self) -> gi.RobotHealth:
        """Ten times a second, from another thread: what is slow to ask for is better asked elsewhere and kept."""
        return gi.RobotHealth(
            stamp=to_timestamp(time.time_ns()),
            state=self.state,
            detail=self.trouble,
            gripper_width=self.arm.gripper_width,
            holding=self.arm.holding,
            robot_name="example",
            protocol_version=PROTOCOL_VERSION,
        )


def serve(endpoint: str) -> None:
    """Serve until interrupted."""
    arm, camera = Arm(), Camera()
    server = RobotServer(endpoint, Driver(arm))
    try:
        while True:
            command = server.next_command(timeout=FRAME_SECONDS)
            if command is not None:
                server.publish_outcome(server.carry_out(command))
            stamp, color, depth = camera.grab()
            joints = [JointState(name=name, position=position) for name, position in arm.joints.items()]
            server.publish_frame(
                RgbdFrame(stamp, color, depth, camera.model),
                encode_transforms({CAMERA_FRAME: camera.model.base_from_camera}, stamp),
                JointStates(timestamp=to_timestamp(stamp), joints=joints),
            )
    finally:
        server.close()


if __name__ == "__main__":
    try:
        serve(sys.argv[1])
    except KeyboardInterrupt:
        sys.exit(130)
