"""What the runtime needs of a robot, wherever it is: in this process or across the link."""

from typing import Protocol

from grasping_invisible.data.proto.grasping_invisible_pb2 import MotionCommand, MotionKind, MotionOutcome
from grasping_invisible.runtime.frame import RgbdFrame


def motion_name(command: MotionCommand) -> str:
    """A command as messages call it: `PUSH 3`."""
    return f"{MotionKind.Name(command.kind)} {command.id}"


class Robot(Protocol):
    """An arm with a fixed RGB-D camera. Every method may raise `RobotError`."""

    def observe(self) -> RgbdFrame:
        """The first frame taken after the last motion ended, with the arm out of the camera's view."""
        ...

    def execute(self, command: MotionCommand) -> MotionOutcome:
        """Carry out one motion and return when it has ended, however it ended.

        A refused command (out of bounds, malformed) raises `RobotError`; a motion that could not be reached
        or was blocked is an outcome, not an error.
        """
        ...

    def stop(self, reason: str) -> None:
        """Stop at once and stand still safely. Never raises."""
        ...

    def close(self) -> None:
        """Let go of the robot. Never raises."""
        ...
