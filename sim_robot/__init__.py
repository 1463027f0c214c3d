"""The simulated robot: a PyBullet Panda, its camera, blocks and scenes, in this process or as a node on the link."""

import ctypes
import os
from contextlib import suppress


def _import_pybullet() -> None:
    """Import PyBullet with stdout pointing to stderr.

    It prints a line from C when it is imported, and C keeps that until the process ends: it would come after the last
    line of a command, which is the one that programs read.
    """
    stdout = os.dup(1)
    try:
        os.dup2(2, 1)
        import pybullet  # noqa: F401

        ctypes.CDLL(None).fflush(None)
    finally:
        os.dup2(stdout, 1)
        os.close(stdout)


# Who needs PyBullet says that it is missing; without a stdout there is nothing to keep clean.
with suppress(ModuleNotFoundError, OSError):
    _import_pybullet()
