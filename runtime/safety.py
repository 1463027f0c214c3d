"""Limits that every command is held to before it is sent, whatever decided it."""

import math
from typing import Annotated

import msgspec

from grasping_invisible.data.action_grid import PUSH_LENGTH
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.errors import RobotError
from grasping_invisible.runtime.preshape import MAX_OPENING
from grasping_invisible.runtime.workspace import Workspace

MAX_MOTIONS = 1000  # of a run: its log stays of a size that can be looked through

Metres = Annotated[float, msgspec.Meta(ge=0, le=1)]


class SafetyLimits(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Bounds on commanded motions, metres, base frame."""

    margin: Metres = 0.03  # how far outside the workspace a motion may start or end
    min_height: Metres = 0.01  # of the TCP above the table
    max_height: Metres = 0.25
    max_push_length: Metres = PUSH_LENGTH
    max_opening: Metres = MAX_OPENING  # between the finger pads

    def __post_init__(self) -> None:
        if self.min_height >= self.max_height:
            raise ValueError(f"min_height {self.min_height:g} must be below max_height {self.max_height:g}")
        if self.max_push_length < PUSH_LENGTH:
            raise ValueError(f"max_push_length {self.max_push_length:g} forbids all pushes, {PUSH_LENGTH:g} m long")


class UnsafeCommand(RobotError):
    """A command that breaks a limit; it was not sent."""


def check_command(command: gi.MotionCommand, limits: SafetyLimits, workspace: Workspace) -> None:
    """Raises `UnsafeCommand` naming the value and the limit it breaks."""
    if command.kind in (gi.PLACE, gi.HOME):
        return
    if command.kind not in (gi.PUSH, gi.GRASP):
        raise UnsafeCommand(f"motion kind {command.kind} is none of PUSH, GRASP, PLACE, HOME")
    start = command.position
    values = {"x": start.x, "y": start.y, "z": start.z}
    values |= {name: getattr(command, name) for name in ("yaw", "length", "opening")}
    for name, value in values.items():
        if not math.isfinite(value):
            raise UnsafeCommand(f"{name} is {value}, not a finite number")
    low, high = limits.min_height, limits.max_height
    height = start.z - workspace.center[2]
    if not low <= height <= high:
        raise UnsafeCommand(f"height {height:.3f} m above the table is outside {low:.3f} to {high:.3f} m")
    _check_point("start" if command.kind == gi.PUSH else "grasp", start.x, start.y, limits, workspace)
    # A grasp that says 0 opens as far as the hand does.
    opening = MAX_OPENING if command.kind == gi.GRASP and command.opening == 0.0 else command.opening
    if not 0.0 <= opening <= limits.max_opening + 1e-9:
        raise UnsafeCommand(f"opening {opening:.3f} m is outside 0 to {limits.max_opening:.3f} m")
    if command.kind == gi.PUSH:
        if not 0.0 < command.length <= limits.max_push_length + 1e-9:
            raise UnsafeCommand(f"push length {command.length:.3f} m is outside 0 to {limits.max_push_length:.3f} m")
        end_x = start.x + command.length * math.cos(command.yaw)
        end_y = start.y + command.length * math.sin(command.yaw)
        _check_point("end", end_x, end_y, limits, workspace)


def _check_point(what: str, x: float, y: float, limits: SafetyLimits, workspace: Workspace) -> None:
    for axis, value, low, high in (
        ("x", x, workspace.low[0], workspace.high[0]),
        ("y", y, workspace.low[1], workspace.high[1]),
    ):
        if not low - limits.margin <= value <= high + limits.margin:
            raise UnsafeCommand(
                f"{what} {axis} = {value:.3f} m is outside the workspace, "
                f"{low:.3f} to {high:.3f} m with a margin of {limits.margin:.3f} m"
            )
