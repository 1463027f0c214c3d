"""The files that files and folders given to a command stand for."""

from collections.abc import Iterable
from pathlib import Path

from grasping_invisible.runtime.errors import BadInput


def files_at(paths: Iterable[Path], what: str, pattern: str) -> list[Path]:
    """Files as they are given, and those of folders by name. `pattern`: as of `Path.glob`; "**/" goes below.

    Raises `BadInput` where a folder holds none; `what` they are is for the message.
    """
    files: list[Path] = []
    for path in paths:
        found = sorted(path.glob(pattern)) if path.is_dir() else [path]
        if not found:
            raise BadInput(f"{path} holds no {what} ({pattern.removeprefix('**/')})")
        files += found
    return files
