"""`gi-log`: look at logs, check them and recover what a crash left.

Exit codes: 0 fine, 1 a check found something, 2 bad usage or input, 130 interrupted.
"""

import argparse
import os
import sys
from collections.abc import Sequence

from grasping_invisible.data.errors import DataError
from grasping_invisible.data.log_commands import check, frames, info, ls, recover, show

EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one subcommand and return its exit code."""
    parsed = _parser().parse_args(arguments)
    try:
        code = parsed.run(parsed)
        sys.stdout.flush()
    except DataError as error:
        return _refuse(str(error))
    except BrokenPipeError:
        # The reader of our output left. Point stdout elsewhere, or Python's own flush at exit fails too.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        return _refuse(f"{error.filename or 'files'}: {error.strerror}")
    except KeyboardInterrupt:
        return EXIT_INTERRUPTED
    return code


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="gi-log",
        description="Look at logs, check them and recover what a crash left.",
        epilog="exit codes: 0 fine, 1 a check found something, 2 bad usage or input, 130 interrupted",
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for command in (info, ls, show, frames, check, recover):
        command.register(commands)
    return parser


def _refuse(reason: str) -> int:
    print(f"gi-log: {reason}", file=sys.stderr)
    return EXIT_BAD_INPUT


if __name__ == "__main__":
    sys.exit(main())
