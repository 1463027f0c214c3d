"""Everything that can go wrong, as one small tree; each error carries the exit code of a command it ends."""

from typing import ClassVar

from grasping_invisible.data.errors import EXIT_BAD_INPUT as EXIT_BAD_INPUT
from grasping_invisible.data.errors import EXIT_INTERRUPTED as EXIT_INTERRUPTED
from grasping_invisible.data.errors import EXIT_SOFTWARE as EXIT_SOFTWARE
from grasping_invisible.data.errors import DataError

EXIT_GRASPED = 0
EXIT_NOT_GRASPED = 1
EXIT_ROBOT = 3


class GraspingError(Exception):
    """A failure a person can act on: one clear line, and what was available."""

    exit_code: ClassVar[int] = EXIT_BAD_INPUT


class BadInput(GraspingError):
    """An argument, a scene, a config file or a bundle that cannot be used."""


class BundleError(BadInput):
    """A model bundle that is missing, damaged, or not what its manifest says."""


class RobotError(GraspingError):
    """The robot refused, failed, or cannot go on."""

    exit_code = EXIT_ROBOT


class CommandRefused(RobotError):
    """The robot answered that it will not carry out a command, and why."""


class LinkError(RobotError):
    """The robot cannot be reached, or has fallen silent."""


# What a command that works on files may end with, without being at fault: see `data.command.run_command`.
EXPECTED: tuple[type[Exception], ...] = (GraspingError, DataError, OSError)
