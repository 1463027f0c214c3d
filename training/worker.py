"""What every worker process does before its work, and keeps from one piece of work to the next."""

import signal
from functools import lru_cache
from pathlib import Path

import cv2

from grasping_invisible.runtime.bundle import ModelBundle, load_bundle


def prepare_worker() -> None:
    """Leave Ctrl-C to the parent, which ends its workers, and the other cores to the other workers."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    cv2.setNumThreads(1)


@lru_cache(maxsize=1)
def loaded_bundle(models: Path | None) -> ModelBundle:
    """The bundle in a folder, or the shipped one, on one thread; checked and opened once in a process."""
    return load_bundle(models, threads=1)
