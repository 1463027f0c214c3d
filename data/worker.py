"""Worker processes of a command: what each does before its work, and work in several of them at once."""

import os
import signal
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import partial
from itertools import islice
from multiprocessing import active_children, get_context, parent_process
from threading import Thread
from typing import Any

import cv2

from grasping_invisible.data.errors import WorkerDied

RunAll = Callable[[Callable[[Any], Any], Iterable[Any]], Iterator[Any]]

_AHEAD = 2  # pieces of work for each process that are handed out at once: the next one is there when one is done


def prepare_worker() -> None:
    """Leave Ctrl-C to the parent, which ends its workers, and the other cores to the other workers.

    A worker whose parent was killed ends at once: nobody else would end it.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    cv2.setNumThreads(1)
    Thread(target=_end_with_parent, name="end with parent", daemon=True).start()


@contextmanager
def worker_pool(workers: int) -> Iterator[RunAll]:
    """A map over arguments in `workers` processes; it yields each result when it is there, in no particular order.

    Leaving ends the processes at once, whatever they do. The map raises `WorkerDied` where one is killed or crashes.
    """
    others = active_children()
    # Spawned: a fork would share the threads of the libraries.
    executor = ProcessPoolExecutor(workers, get_context("spawn"), prepare_worker)
    try:
        yield partial(_run_all, executor, _AHEAD * workers)
    finally:
        # An executor waits for what its processes are at; only Python 3.14 has a call to end them.
        for process in active_children():
            if process not in others:
                process.kill()
        executor.shutdown(cancel_futures=True)


def _run_all(
    executor: ProcessPoolExecutor, at_once: int, function: Callable[[Any], Any], arguments: Iterable[Any]
) -> Iterator[Any]:
    left = iter(arguments)
    running: set[Future[Any]] = set()
    try:
        while True:
            with _ctrl_c_blocked():
                running |= {executor.submit(function, item) for item in islice(left, at_once - len(running))}
            if not running:
                return
            done, running = wait(running, return_when=FIRST_COMPLETED)
            # What is done counts, also where others of the same moment failed.
            for future in sorted(done, key=lambda future: future.exception() is not None):
                yield future.result()
    except BrokenProcessPool:
        raise WorkerDied(
            "a worker process was killed or crashed, likely out of memory; the same command goes on from here"
        ) from None


@contextmanager
def _ctrl_c_blocked() -> Iterator[None]:
    """Processes that are started inside inherit this, and leave Ctrl-C to the parent before they are prepared, too."""
    held = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, held)


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
