"""A simulated robot that tries many motions from one state of the world: a cheap way to a lot of experience.

Contact is simulated as ever, between where the gripper meets the clutter and where it leaves it. The arm's way from
home and back, most of a motion's time, is left out.
"""

import numpy as np

from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.sim_robot.kinematics import HOME_JOINTS, Kinematics
from grasping_invisible.sim_robot.motions import Primitives
from grasping_invisible.sim_robot.panda import OPEN_WIDTH, Panda
from grasping_invisible.sim_robot.path import JointPath, Tool
from grasping_invisible.sim_robot.robot import SimRobot
from grasping_invisible.sim_robot.world import World

CLEARANCE = 0.02  # metres above everything at which a motion begins and ends
LIFT = 0.10  # metres by which something caught is lifted, to see whether the fingers keep it


class BranchingRobot(SimRobot):
    """A robot whose world can be put back. A motion begins above its first pose, and ends at home.

    Only with something in the gripper it ends above where it was caught. After a grasp the objects may still move: the
    world has to be put back. Which motions are reachable, and what happens on contact, is as with `SimRobot`.
    """

    def save(self) -> int:
        """Keep the state of the world; a number to `restore` it by, until it is `forget`-ed."""
        return self.world.save()

    def restore(self, state: int) -> None:
        """Put every object back to where it was when `state` was saved, and the arm home."""
        self.world.restore(state)
        self.panda.stand(HOME_JOINTS, OPEN_WIDTH)
        self.state = gi.IDLE

    def forget(self, state: int) -> None:
        """Free the memory of a saved state."""
        self.world.forget(state)

    def _let_settle(self, command: gi.MotionCommand) -> None:
        if command.kind != gi.GRASP:
            super()._let_settle(command)

    def _make_primitives(self, kinematics: Kinematics) -> Primitives:
        return ShortPrimitives(self.panda, kinematics, self.world)


class ShortPrimitives(Primitives):
    """The primitives without the way from home and back."""

    def __init__(self, panda: Panda, kinematics: Kinematics, world: World) -> None:
        super().__init__(panda, kinematics)
        self._world = world

    def _descend_to(self, tool: Tool) -> tuple[JointPath, JointPath]:
        over, down = super()._descend_to(tool)  # the whole way: what cannot be reached from home must not be here
        above = np.flatnonzero(down.positions[:, 2] >= self._world.highest_top() + CLEARANCE)
        first = int(above[-1]) if len(above) else 0
        return over, JointPath(down.times[first:] - down.times[first], down.joints[first:], down.positions[first:])

    def _approach(self, over: JointPath, down: JointPath, width: float) -> None:
        self._panda.stand(down.joints[0], width)

    def _retreat(self, closing_yaw: float) -> None:
        holding = self._panda.holding
        top = self._world.highest_top() + CLEARANCE
        self._rise(closing_yaw, self._here(closing_yaw).position[2] + LIFT if holding else top)
        if not self._panda.holding:
            self._panda.stand(HOME_JOINTS, OPEN_WIDTH)
