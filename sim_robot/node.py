"""The simulated robot as a process of its own, on the link."""

import socket
import time
from dataclasses import replace

from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms

from grasping_invisible.data.clock import to_timestamp
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.topics import PROTOCOL_VERSION, TRUTH
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.runtime.frame import RgbdFrame
from grasping_invisible.runtime.robot_server import Driver, RobotServer
from grasping_invisible.runtime.workspace import Workspace
from grasping_invisible.sim_robot.robot import SimRobot
from grasping_invisible.sim_robot.scene import Scene

ROBOT_NAME = "simulated panda"
PORTS_TRIED = 5  # where none is asked for
IDLE_SECONDS = 0.5  # between two camera frames while the robot stands still


class SimNode:
    """Serves a `SimRobot` at `endpoint`; at a free port on loopback where that is None.

    Camera frames go out `camera_hz` times a simulated second while the arm moves. The world stands still between
    motions, and so does its picture: while idle, the frame taken after the last motion goes out again with a new
    stamp. What a decision sees therefore never depends on how fast either process runs.
    """

    def __init__(self, scene: Scene, seed: int, endpoint: str | None, camera_hz: float, *, gui: bool = False) -> None:
        self._camera_period = 1.0 / camera_hz
        self._next_frame_at = 0.0
        self._robot = SimRobot(scene, seed, gui=gui, on_tick=self._tick)
        try:
            if endpoint is None:
                self.endpoint, self._server = serve_at_free_port(self)
            else:
                self.endpoint, self._server = endpoint, RobotServer(endpoint, self)
        except BaseException:
            self._robot.close()
            raise

    @property
    def workspace(self) -> Workspace:
        """Where the simulated clutter lies."""
        return self._robot.workspace

    def run(self) -> None:
        """Serve until interrupted."""
        self._publish_still(self._robot.observe())
        while True:
            command = self._server.next_command(IDLE_SECONDS)
            if command is None:
                self._publish_still(replace(self._still, stamp_ns=time.time_ns()))
                continue
            outcome = self._server.carry_out(command)
            self._server.publish_outcome(outcome)
            self._publish_still(self._robot.observe())

    def close(self) -> None:
        """Leave the link and free the world."""
        self._server.close()
        self._robot.close()

    # ---- what the server asks of a driver ---------------------------------------------------------------

    def refusal(self, command: gi.MotionCommand) -> str | None:
        """See `Driver`."""
        return self._robot.refusal(command)

    def execute(self, command: gi.MotionCommand) -> gi.MotionOutcome:
        """See `Driver`."""
        return self._robot.execute(command)

    def request_stop(self, reason: str) -> None:
        """See `Driver`."""
        self._robot.request_stop(reason)

    def heartbeat(self) -> gi.RobotHealth:
        """See `Driver`."""
        return self._robot.health(ROBOT_NAME, PROTOCOL_VERSION)

    # ---- frames -------------------------------------------------------------------------------------------

    def _tick(self, seconds: float) -> None:
        if seconds >= self._next_frame_at:
            self._next_frame_at = seconds + self._camera_period
            self._publish(self._robot.observe())

    def _publish_still(self, frame: RgbdFrame) -> None:
        self._still = frame
        # Before the frame: a run may end with the frame that shows its last motion, and its log needs the truth of it.
        truth = self._robot.truth()
        truth.stamp.CopyFrom(to_timestamp(frame.stamp_ns))
        self._server.bus.publish(TRUTH, truth)
        self._publish(frame)

    def _publish(self, frame: RgbdFrame) -> None:
        transforms: FrameTransforms = self._robot.transforms(frame.stamp_ns)
        self._server.publish_frame(frame, transforms, self._robot.joint_states(frame.stamp_ns))


def serve_at_free_port(driver: Driver) -> tuple[str, RobotServer]:
    """The endpoint on loopback and the server that listens there. Raises `BadInput` where none can be had.

    Another process may take a port between its being found free and our listening there: then the next is tried.
    """
    refusal = None
    for _ in range(PORTS_TRIED):
        endpoint = f"tcp/127.0.0.1:{free_port()}"
        try:
            return endpoint, RobotServer(endpoint, driver)
        except BadInput as error:
            refusal = error
    raise BadInput(f"no port on loopback can be listened at: {refusal}")


def free_port() -> int:
    """A TCP port on loopback that nobody listens at now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]
