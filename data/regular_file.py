"""Reading what somebody named, which need not be a file that has an end."""

import errno
import stat
from io import BufferedReader
from pathlib import Path


def open_regular(path: Path) -> BufferedReader:
    """A file to read from. Raises `OSError`, also for a pipe, a socket or a device.

    To open a pipe waits for whoever writes into it, and a device may never end.
    """
    mode = path.stat().st_mode
    if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):  # a folder cannot be opened either, and that is said so
        raise OSError(errno.EINVAL, "it is no regular file", str(path))
    return path.open("rb")
