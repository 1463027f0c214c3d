"""The simulated Panda behind the same interface as any other robot, in this process."""

import time
from collections.abc import Callable

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import PUSH_LENGTH
from grasping_invisible.data.classes import CLASSES, TARGET_COLORS
from grasping_invisible.data.clock import to_timestamp
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.errors import RobotError
from grasping_invisible.runtime.frame import Camera, RgbdFrame
from grasping_invisible.runtime.workspace import Workspace
from grasping_invisible.sim_robot import telemetry
from grasping_invisible.sim_robot.bin import add_bin
from grasping_invisible.sim_robot.camera import DepthSensor, Render, default_camera, render
from grasping_invisible.sim_robot.kinematics import Kinematics
from grasping_invisible.sim_robot.motions import TRAVEL_HEIGHT, Primitives, Report
from grasping_invisible.sim_robot.panda import OPEN_WIDTH, PHYSICS_HZ, Panda
from grasping_invisible.sim_robot.path import Unreachable
from grasping_invisible.sim_robot.scene import Scene
from grasping_invisible.sim_robot.world import World

LOWEST_TCP = 0.008  # metres above the table
SETTLE_SECONDS = 3.0


class MotionStopped(Exception):
    """Raised inside a motion when somebody asked for a stop."""


class SimRobot:
    """A Panda and a camera over a scene; see `grasping_invisible.runtime.robot.Robot`.

    The world stands still between motions, so what is observed does not depend on when. `on_tick(seconds)` is called
    with the simulated time throughout a motion, for whoever streams frames; it may call `request_stop`. `clock` gives
    stamps in nanoseconds. Not safe across threads, except `request_stop` and `health`.
    """

    def __init__(
        self,
        scene: Scene,
        seed: int,
        workspace: Workspace | None = None,
        *,
        gui: bool = False,
        camera: Camera | None = None,
        on_tick: Callable[[float], None] | None = None,
        clock: Callable[[], int] = time.time_ns,
    ) -> None:
        self.scene = scene
        self.seed = seed
        self.workspace = workspace or Workspace()
        self.camera = camera or default_camera()
        self.simulated_seconds = 0.0
        self.state: gi.RobotState = gi.IDLE
        self.active_command_id = 0
        self._on_tick = on_tick
        self._clock = clock
        self._stop_reason: str | None = None
        self.world = World(scene, seed, self.workspace, gui)
        self.panda = Panda(self.world.client, self._advance)
        add_bin(self.world.client)
        self.world.settle(SETTLE_SECONDS)
        self._kinematics = Kinematics()
        self._primitives = self._make_primitives(self._kinematics)
        self._sensor = DepthSensor(seed)
        self._last: tuple[int, Render] | None = None
        self._gripper_width, self._holding = self.panda.gripper_width, False

    def observe(self) -> RgbdFrame:
        """One RGB-D frame of the scene as it is now."""
        image = render(self.world.client, self.camera)
        stamp = self._clock()
        self._last = stamp, image
        return RgbdFrame(stamp, image.color, self._sensor.measure(image.depth), self.camera)

    def refusal(self, command: gi.MotionCommand) -> str | None:
        """Why a command will not be carried out, in one line; None where it will be tried."""
        if self.state == gi.ROBOT_FAULT:
            return "the robot is at fault and accepts nothing"
        if self.state == gi.SAFE_STOP and command.kind != gi.HOME:
            return "the robot stands still after a stop; send HOME first"
        if command.kind in (gi.PLACE, gi.HOME):
            return None
        if command.kind not in (gi.PUSH, gi.GRASP):
            return f"unknown motion kind {command.kind}; known: PUSH, GRASP, PLACE, HOME"
        p = command.position
        if not np.isfinite([p.x, p.y, p.z, command.yaw, command.length, command.opening]).all():
            return "position, yaw, length and opening must be finite numbers"
        if not self.workspace.contains(p.x, p.y):
            return f"({p.x:.3f}, {p.y:.3f}) m is outside the workspace"
        if not LOWEST_TCP <= p.z <= TRAVEL_HEIGHT:
            return f"height {p.z:.3f} m is outside {LOWEST_TCP} to {TRAVEL_HEIGHT} m"
        if command.kind == gi.PUSH and not 0.0 < command.length <= PUSH_LENGTH + 1e-9:
            return f"push length {command.length:.3f} m is outside 0 to {PUSH_LENGTH} m"
        if not 0.0 <= command.opening <= OPEN_WIDTH + 1e-9:
            return f"opening {command.opening:.3f} m is outside 0 to {OPEN_WIDTH} m"
        if self.panda.holding:
            return "something is held; send PLACE first"
        return None

    def execute(self, command: gi.MotionCommand) -> gi.MotionOutcome:
        """Carry out one motion. Raises `RobotError` if it is refused or the physics has blown up."""
        reason = self.refusal(command)
        if reason is not None:
            raise RobotError(f"motion {command.id} refused: {reason}")
        started = self._clock()
        self._stop_reason = None  # a stop asked for while the last motion's objects settled was for that motion
        self.state, self.active_command_id = gi.MOVING, command.id
        status, detail, fraction = gi.COMPLETED, "", 1.0
        try:
            report = self._carry_out(command)
            self._let_settle(command)
            status = gi.BLOCKED if report.blocked else gi.COMPLETED
            detail, fraction = report.detail, report.fraction
            self.state = gi.IDLE
        except Unreachable as error:
            status, detail, fraction = gi.UNREACHABLE, str(error), 0.0
            self.state = gi.IDLE
        except MotionStopped as error:
            self.panda.freeze()
            self.world.settle(SETTLE_SECONDS)  # the arm stands; what was falling comes to rest
            status, detail, fraction = gi.STOPPED, str(error), 0.0
            self.state = gi.SAFE_STOP
        finally:
            self.active_command_id = 0
        try:
            self.world.check()
        except RobotError:
            self.state = gi.ROBOT_FAULT
            raise
        return gi.MotionOutcome(
            command_id=command.id,
            started=to_timestamp(started),
            ended=to_timestamp(self._clock()),
            status=status,
            detail=detail,
            gripper_width=self.panda.gripper_width,
            holding=self.panda.holding,
            path_fraction=fraction,
        )

    def request_stop(self, reason: str) -> None:
        """Stop the motion in progress at its next tick; without one, nothing moves anyway."""
        if self.state == gi.MOVING:
            self._stop_reason = reason

    def stop(self, reason: str) -> None:
        """See `request_stop`."""
        self.request_stop(reason)

    def health(self, name: str, protocol_version: int) -> gi.RobotHealth:
        """The heartbeat's content, as of the last tick; safe to call from another thread."""
        return gi.RobotHealth(
            stamp=to_timestamp(self._clock()),
            state=self.state,
            active_command_id=self.active_command_id,
            gripper_width=self._gripper_width,
            holding=self._holding,
            robot_name=name,
            protocol_version=protocol_version,
        )

    def joint_states(self, stamp_ns: int) -> JointStates:
        """Measured joints, as the robot reports them."""
        return telemetry.joint_states(self.world.client, self.panda.body, stamp_ns)

    def transforms(self, stamp_ns: int) -> FrameTransforms:
        """Transforms from the base frame to the links and the camera."""
        return telemetry.transforms(self.world.client, self.panda.body, self.camera, stamp_ns)

    def truth(self) -> gi.TruthState:
        """Where everything really is, and how many pixels of it the last observed frame shows."""
        stamp, image = self._last or (self._clock(), None)
        bodies = self.world.bodies
        seen = np.unique(image.bodies, return_counts=True) if image is not None else ([], [])
        pixels = dict(zip(*seen, strict=True))
        held = self.panda.touched_by_both_fingers() if self.panda.holding else None
        return gi.TruthState(
            stamp=to_timestamp(stamp),
            objects=[
                gi.ObjectTruth(
                    name=item.name,
                    shape=item.shape,
                    color=item.color,
                    position=gi.Point(x=item.position[0], y=item.position[1], z=item.position[2]),
                    qx=item.quaternion[0],
                    qy=item.quaternion[1],
                    qz=item.quaternion[2],
                    qw=item.quaternion[3],
                    visible_pixels=int(pixels.get(bodies[item.name], 0)),
                )
                for item in self.world.object_states()
            ],
            held_object=next((name for name, body in bodies.items() if body == held), ""),
            scene=self.scene.name,
            seed=self.seed,
            target_color=self.scene.target,
        )

    def truth_labels(self) -> NDArray[np.uint8]:
        """What a faultless segmenter would say of the last observed frame: (H, W) uint8 class indices."""
        if self._last is None:
            raise RobotError("nothing has been observed yet")
        bodies = self._last[1].bodies
        class_of_body = np.zeros(max(bodies.max(), *self.world.bodies.values()) + 2, np.uint8)
        for item in self.world.object_states():
            if item.color in TARGET_COLORS:
                class_of_body[self.world.bodies[item.name]] = CLASSES.index(item.color)
        return class_of_body[bodies]  # body -1, nothing, reads the last entry, which stays 0

    def close(self) -> None:
        """Free the world and the arm's kinematics."""
        self._kinematics.close()
        self.world.close()

    def _let_settle(self, command: gi.MotionCommand) -> None:
        self.world.settle(SETTLE_SECONDS)

    def _make_primitives(self, kinematics: Kinematics) -> Primitives:
        return Primitives(self.panda, kinematics)

    def _carry_out(self, command: gi.MotionCommand) -> Report:
        position = (command.position.x, command.position.y, command.position.z)
        match command.kind:
            case gi.PUSH:
                return self._primitives.push(position, command.yaw, command.length)
            case gi.GRASP:
                return self._primitives.grasp(position, command.yaw, command.opening or OPEN_WIDTH)
            case gi.PLACE:
                return self._primitives.place()
            case _:
                return self._primitives.home()

    def _advance(self, steps: int) -> None:
        self.world.step(steps)
        self.simulated_seconds += steps / PHYSICS_HZ
        self._gripper_width, self._holding = self.panda.gripper_width, self.panda.holding
        if self._on_tick is not None:
            self._on_tick(self.simulated_seconds)
        if self._stop_reason is not None:
            reason, self._stop_reason = self._stop_reason, None
            raise MotionStopped(reason)
