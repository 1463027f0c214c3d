"""How a command of this project ends: by its exit code, with one clear line for what went wrong."""

import io
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager

from grasping_invisible.data.errors import EXIT_BAD_INPUT, EXIT_INTERRUPTED, EXIT_SOFTWARE
from grasping_invisible.data.stream import readers_may_leave, write_line


@contextmanager
def interruptible() -> Iterator[None]:
    """Inside, SIGINT and SIGTERM raise `KeyboardInterrupt` in the main thread.

    Also where a shell has SIGINT ignored, as it does for jobs in the background: long work must end there, too,
    without loss.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    handlers = {number: signal.signal(number, _interrupt) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)


def run_command(
    program: str,
    body: Callable[[], int],
    errors: tuple[type[Exception], ...],
    interrupted: str = "",
    signals: Callable[[], AbstractContextManager[None]] = interruptible,
) -> int:
    """The exit code of `body`; one of `errors` becomes one line on stderr and its own `exit_code`, or 2.

    An interruption becomes 130; `interrupted` is what a person should know then, `signals` what makes one of a signal.
    An error that is none of `errors` is a fault of ours: it is told with its traceback, and 70. A reader of our output
    who leaves changes nothing.
    """
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # a file's name need not be text
    try:
        with signals(), readers_may_leave():
            return body()
    except errors as error:
        write_line(f"{program}: {_one_line(_reason(error))}", sys.stderr)
        return getattr(error, "exit_code", EXIT_BAD_INPUT)
    except KeyboardInterrupt:
        if interrupted:
            write_line(f"{program}: {interrupted}", sys.stderr)
        return EXIT_INTERRUPTED
    except Exception as error:
        write_line(f"{traceback.format_exc()}{program}: a fault of this program: {error!r}", sys.stderr)
        return EXIT_SOFTWARE


def _interrupt(number: int, frame: object) -> None:
    raise KeyboardInterrupt


def _reason(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename or 'files'}: {error.strerror}"
    return str(error)


def _one_line(text: str) -> str:
    """A text that may quote a log, which may hold anything: on one line, and without what would steer a terminal."""
    return "".join(sign if sign.isprintable() else f"\\x{ord(sign):02x}" for sign in " ".join(text.splitlines()))
