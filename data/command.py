"""How a command of this package ends: one clear line and an exit code, whatever goes wrong."""

import io
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from grasping_invisible.data.errors import EXIT_BAD_INPUT, EXIT_INTERRUPTED, DataError


def run_command(program: str, body: Callable[[], int], interrupted: str = "") -> int:
    """The exit code of `body`, 2 for what cannot be used, 130 after Ctrl-C.

    `interrupted`: what a person should know after Ctrl-C.
    """

    def refuse(reason: str) -> int:
        print(f"{program}: {_one_line(reason)}", file=sys.stderr)
        return EXIT_BAD_INPUT

    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # a file's name need not be text
    try:
        with interruptible():
            code = body()
        sys.stdout.flush()
    except DataError as error:
        return refuse(str(error))
    except BrokenPipeError:
        # The reader of our output left. Point stdout elsewhere, or Python's own flush at exit fails too.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        return refuse(f"{error.filename or 'files'}: {error.strerror}")
    except KeyboardInterrupt:
        if interrupted:
            print(f"{program}: {interrupted}", file=sys.stderr)
        return EXIT_INTERRUPTED
    return code


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


def _interrupt(number: int, frame: object) -> None:
    raise KeyboardInterrupt


def _one_line(text: str) -> str:
    """A text that may quote a log, which may hold anything: on one line, and without what would steer a terminal."""
    return "".join(sign if sign.isprintable() else f"\\x{ord(sign):02x}" for sign in " ".join(text.splitlines()))
