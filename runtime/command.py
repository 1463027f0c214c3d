"""How a command of this project ends: by its exit code, one clear line, and within bounded time."""

import os
import signal
import sys
import threading
from collections.abc import Callable

from grasping_invisible.runtime.errors import EXIT_INTERRUPTED, GraspingError

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def exit_at_once_on_signals() -> None:
    """For the time of imports: nothing is started yet, and libraries do not expect an interruption there."""
    for number in _SIGNALS:
        signal.signal(number, lambda *_: os._exit(EXIT_INTERRUPTED))


def run_command(program: str, body: Callable[[], int]) -> int:
    """The exit code of `body`; what a person did wrong becomes one line on stderr, a signal becomes 130.

    SIGTERM and SIGHUP end a command as Ctrl-C does: with `KeyboardInterrupt` in its main thread.
    """
    for number in _SIGNALS:
        signal.signal(number, signal.default_int_handler)
    try:
        return body()
    except GraspingError as error:
        print(f"{program}: {error}", file=sys.stderr, flush=True)
        return error.exit_code
    except KeyboardInterrupt:
        return EXIT_INTERRUPTED


def finish_within(seconds: float, exit_code: int) -> None:
    """From now on ignore signals, and end the process in `seconds` even if cleaning up hangs."""
    for number in _SIGNALS:
        signal.signal(number, signal.SIG_IGN)
    guard = threading.Timer(seconds, os._exit, args=(exit_code,))
    guard.daemon = True
    guard.start()
