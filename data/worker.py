"""What every worker process of a command does before its work."""

import signal

import cv2


def prepare_worker() -> None:
    """Leave Ctrl-C to the parent, which ends its workers, and the other cores to the other workers."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    cv2.setNumThreads(1)
