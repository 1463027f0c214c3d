"""How a command of this project ends: by its exit code, one clear line, and within bounded time."""

import _thread
import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from grasping_invisible.runtime.errors import EXIT_INTERRUPTED, EXIT_SOFTWARE, GraspingError
from grasping_invisible.runtime.stream import write_line

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_INTERRUPTED_SECONDS = 1.8  # from a signal to the end of the process, whatever cleaning up does


def exit_at_once_on_signals() -> None:
    """For the time of imports: nothing is started yet, and libraries do not expect an interruption there."""
    for number in _SIGNALS:
        signal.signal(number, lambda *_: os._exit(EXIT_INTERRUPTED))


def run_command(program: str, body: Callable[[], int]) -> int:
    """The exit code of `body`; what a person did wrong becomes one line on stderr, a signal becomes 130.

    SIGTERM and SIGHUP end a command as Ctrl-C does: with `KeyboardInterrupt` in its main thread, which then has
    1.8 s to clean up and is not interrupted again. An error nobody foresaw is told with its traceback, and 70.
    """
    for number in _SIGNALS:
        signal.signal(number, _interrupt)
    try:
        return body()
    except GraspingError as error:
        write_line(f"{program}: {error}", sys.stderr)
        return error.exit_code
    except KeyboardInterrupt:
        return EXIT_INTERRUPTED
    except Exception as error:
        write_line(f"{traceback.format_exc()}{program}: a fault of this program: {error!r}", sys.stderr)
        return EXIT_SOFTWARE


@contextmanager
def interruptions_held() -> Iterator[None]:
    """For what must not be left half done: a signal that comes inside takes effect at the end of the block.

    Elsewhere than in the main thread, which alone handles signals, there is nothing to hold.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    handlers = {number: signal.signal(number, lambda number, _: came.append(number)) for number in _SIGNALS}
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        for number in came[:1]:
            signal.raise_signal(number)


def finish_within(seconds: float, exit_code: int) -> None:
    """From now on ignore signals, and end the process in `seconds` even if cleaning up hangs."""
    for number in _SIGNALS:
        signal.signal(number, signal.SIG_IGN)

    def end() -> None:
        time.sleep(seconds)
        os._exit(exit_code)

    # Not threading.Thread: its start takes locks that the code a signal interrupts may hold.
    _thread.start_new_thread(end, ())


def _interrupt(number: int, frame: FrameType | None) -> None:
    finish_within(_INTERRUPTED_SECONDS, EXIT_INTERRUPTED)
    raise KeyboardInterrupt
