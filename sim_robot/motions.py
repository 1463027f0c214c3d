"""The motion primitives: push, top-down grasp, place and home, each planned whole before the arm starts."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.sim_robot.kinematics import HOME_JOINTS, Kinematics, tool_down
from grasping_invisible.sim_robot.panda import Panda
from grasping_invisible.sim_robot.path import JointPath, Tool, Unreachable, line, stand_at, swing

TRAVEL_HEIGHT = 0.25  # metres; above everything that lies in the workspace, with something in the gripper
TRAVEL_SPEED = 0.5  # metres a second
APPROACH_SPEED = 0.2
PUSH_SPEED = 0.12
LIFT_SPEED = 0.25
HOME = Tool((0.3069, 0.0, 0.4853), -np.pi / 2)
BIN = Tool((-0.20, 0.38, 0.25), 0.484)  # over the discard bin, beside the robot, out of view
BIN_SEED = HOME_JOINTS + np.array([2.055, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])  # home, turned about the base
BACK_OFF = 0.002  # metres up from what stopped a descent, so that the fingers close without rubbing on it


Plan = TypeVar("Plan")


@dataclass(frozen=True)
class Report:
    """How a primitive ended: whether it was cut short, how far it came (0..1), and a line for a person."""

    blocked: bool
    fraction: float
    detail: str


class Primitives:
    """Carries out motion primitives with a Panda. Every method may raise `Unreachable`, and then nothing has moved.

    All start at home and end at home. Positions are TCP positions in the base frame, metres; yaw in radians.
    """

    def __init__(self, panda: Panda, kinematics: Kinematics) -> None:
        self._panda = panda
        self._kinematics = kinematics

    def push(self, position: tuple[float, float, float], yaw: float, length: float) -> Report:
        """Push straight along `yaw` for `length` metres with the closed gripper, its wide side across the push."""
        end = (position[0] + length * np.cos(yaw), position[1] + length * np.sin(yaw), position[2])

        def plan(closing_yaw: float) -> tuple[JointPath, JointPath, JointPath]:
            start, stop = Tool(position, closing_yaw), Tool(end, closing_yaw)
            over, down = self._descend_to(start)
            along = line(self._kinematics, start, stop, down.end, PUSH_SPEED)
            self._check_way_home(stop, along.end)
            return over, down, along

        closing_yaw, (over, down, along) = self._either_way(yaw + np.pi / 2, plan)
        self._approach(over, down, 0.0)
        descent = self._panda.follow(down, guarded=True)
        travelled = self._panda.follow(along, guarded=True) if descent == 1.0 else 0.0
        self._retreat(closing_yaw)
        self._panda.open_gripper()
        if descent < 1.0:
            return Report(True, 0.0, f"blocked on the way down, {descent:.0%} of the descent")
        if travelled < 1.0:
            return Report(True, travelled, f"blocked after {travelled * length * 100:.1f} cm of the push")
        return Report(False, 1.0, "pushed")

    def grasp(self, position: tuple[float, float, float], yaw: float, opening: float) -> Report:
        """Descend with the fingers `opening` metres apart, close along `yaw`, lift, and come home with what was caught.

        A descent that meets something stops there, backs off a little and closes all the same, as a guarded move does.
        """

        closing_yaw, (over, down) = self._either_way(yaw, lambda closing: self._descend_to(Tool(position, closing)))
        self._approach(over, down, opening)
        descent = self._panda.follow(down, guarded=True)
        if descent < 1.0:
            self._back_off(closing_yaw)
        self._panda.close_gripper()
        self._retreat(closing_yaw)
        if self._panda.holding:
            return Report(False, descent, "something is held")
        if descent < 1.0:
            return Report(True, descent, f"blocked on the way down, {descent:.0%} of the descent; nothing is held")
        return Report(False, 1.0, "closed on nothing")

    def place(self) -> Report:
        """Put what is held down in the discard bin."""
        over = self._kinematics.inverse(np.array(BIN.position), tool_down(BIN.yaw), BIN_SEED)
        if over is None:
            raise Unreachable("the discard bin cannot be reached")
        self._panda.follow(swing(self._kinematics, self._panda.goal, over, TRAVEL_SPEED))
        self._panda.open_gripper()
        self._panda.follow(swing(self._kinematics, self._panda.goal, HOME_JOINTS, TRAVEL_SPEED))
        return Report(False, 1.0, "put down in the discard bin")

    def home(self) -> Report:
        """Rise and return home, keeping what is held."""
        self._retreat(self._panda.closing_yaw)
        return Report(False, 1.0, "at home")

    def _either_way(self, closing_yaw: float, plan: Callable[[float], Plan]) -> tuple[float, Plan]:
        """Plan with the hand one way round or the other, the nearer to home first: the fingers are alike."""
        near = (closing_yaw - HOME.yaw + np.pi / 2) % np.pi - np.pi / 2 + HOME.yaw
        try:
            return near, plan(near)
        except Unreachable:
            far = near - np.pi if near > HOME.yaw else near + np.pi
            return far, plan(far)

    def _descend_to(self, tool: Tool) -> tuple[JointPath, JointPath]:
        """From home to above a pose, and down to it; planned from the bottom up, where reach is scarcest."""
        up = line(
            self._kinematics, tool, tool.at_height(TRAVEL_HEIGHT), stand_at(self._kinematics, tool), APPROACH_SPEED
        )
        return swing(self._kinematics, HOME_JOINTS, up.end, TRAVEL_SPEED), up.backwards()

    def _approach(self, over: JointPath, down: JointPath, width: float) -> None:
        """Set the fingers to a width in metres and go where the descent `down` begins."""
        self._panda.open_gripper(width) if width > 0.0 else self._panda.close_gripper()
        self._panda.follow(over)

    def _check_way_home(self, tool: Tool, joints: NDArray[np.float64]) -> None:
        """Raise `Unreachable` now if the way up from a pose could not be taken later."""
        line(self._kinematics, tool, tool.at_height(TRAVEL_HEIGHT), joints, LIFT_SPEED)

    def _here(self, closing_yaw: float) -> Tool:
        x, y, z = self._panda.tcp
        return Tool((float(x), float(y), float(z)), closing_yaw)

    def _back_off(self, closing_yaw: float) -> None:
        here = self._here(closing_yaw)
        above = here.at_height(here.position[2] + BACK_OFF)
        # Where it cannot, it closes where it is: by now it has moved, and must not end as a motion that never began.
        with suppress(Unreachable):
            self._panda.follow(line(self._kinematics, here, above, self._panda.joints, 0.05))

    def _retreat(self, closing_yaw: float) -> None:
        """Straight up from wherever the TCP is, then home."""
        self._rise(closing_yaw, TRAVEL_HEIGHT)
        self._panda.follow(swing(self._kinematics, self._panda.goal, HOME_JOINTS, TRAVEL_SPEED))

    def _rise(self, closing_yaw: float, height: float) -> None:
        """Straight up to a height in metres, unless it is above that."""
        here = self._here(closing_yaw)
        above = here.at_height(max(height, here.position[2]))
        # Pushed off its path, it may stand where straight up leads out of reach; the joints' own way home leads up too.
        with suppress(Unreachable):
            self._panda.follow(line(self._kinematics, here, above, self._panda.joints, LIFT_SPEED))
