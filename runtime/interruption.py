"""How a command that may move a robot ends when a signal comes: within bounded time, and nothing half done."""

import _thread
import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from grasping_invisible.runtime.errors import EXIT_INTERRUPTED

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_INTERRUPTED_SECONDS = 1.8  # from a signal to the end of the process, whatever cleaning up does


def exit_at_once_on_signals() -> None:
    """For the time of imports: nothing is started yet, and libraries do not expect an interruption there."""
    for number in _SIGNALS:
        signal.signal(number, lambda *_: os._exit(EXIT_INTERRUPTED))


@contextmanager
def bounded() -> Iterator[None]:
    """From now on SIGINT, SIGTERM and SIGHUP raise `KeyboardInterrupt` in the main thread, and end this process.

    It then has 1.8 s to clean up and is not interrupted again. What `data.command.run_command` takes as `signals` where
    a robot may be moving.
    """
    for number in _SIGNALS:
        signal.signal(number, _interrupt)
    yield


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
