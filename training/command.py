"""How the commands of training end: one clear line and an exit code, whatever goes wrong."""

import sys
from collections.abc import Callable

from grasping_invisible.data.command import interruptible
from grasping_invisible.data.errors import DataError
from grasping_invisible.runtime.errors import EXIT_BAD_INPUT, EXIT_INTERRUPTED, GraspingError


def run_command(program: str, body: Callable[[], None], interrupted: str) -> int:
    """The exit code of a command that does `body`: 0, an error's own, 2 for files, 130 after Ctrl-C.

    `interrupted`: what a person should know after Ctrl-C. Unlike the runtime's commands these have no bound on their
    end, as they save what they have.
    """
    try:
        with interruptible():
            body()
    except (GraspingError, DataError, OSError) as error:
        print(f"{program}: {error}", file=sys.stderr)
        return error.exit_code if isinstance(error, GraspingError) else EXIT_BAD_INPUT
    except KeyboardInterrupt:
        print(f"{program}: {interrupted}", file=sys.stderr)
        return EXIT_INTERRUPTED
    return 0
