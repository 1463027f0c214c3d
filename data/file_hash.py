"""What tells one file's content from another's."""

import hashlib
from pathlib import Path

from grasping_invisible.data.regular_file import open_regular


def file_sha256(path: Path) -> str:
    """The SHA-256 of a file, hexadecimal; reads it in pieces. Raises `OSError`."""
    with open_regular(path) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
