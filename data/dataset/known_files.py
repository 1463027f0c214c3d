"""The hashes of files that were read before, so that a file that has not changed need not be read again."""

import os
from pathlib import Path

import msgspec

from grasping_invisible.data.log_storage import parts_of
from grasping_invisible.data.shown_name import shown

_Facts = list[tuple[str, int, int]]  # of every part: name, bytes, time of its last change


class _Known(msgspec.Struct):
    facts: _Facts
    sha256: str


class KnownFiles:
    """Logs by path, with size and time of change of all parts, and their hashes."""

    def __init__(self, path: Path) -> None:
        """Read what was kept at `path`; whatever cannot be read is not known."""
        self._path = path
        try:
            self._known = msgspec.json.decode(path.read_bytes(), type=dict[str, _Known])
        except (OSError, msgspec.DecodeError):
            self._known = {}

    def sha256(self, log: Path) -> str | None:
        """The hash of a log that has not changed since it was noted; None otherwise."""
        known = self._known.get(shown(str(log.resolve())))
        return known.sha256 if known is not None and known.facts == _facts(log) else None

    def note(self, log: Path, sha256: str) -> None:
        """Remember the hash of a log as it is now."""
        self._known[shown(str(log.resolve()))] = _Known(_facts(log), sha256)

    def save(self) -> None:
        """Keep all that is known."""
        unfinished = self._path.with_suffix(".unfinished")
        unfinished.write_bytes(msgspec.json.encode(self._known))
        os.replace(unfinished, self._path)


def _facts(log: Path) -> _Facts:
    statuses = [(part.name, part.stat()) for part in parts_of(log) if part.exists()]
    return [(shown(name), status.st_size, status.st_mtime_ns) for name, status in statuses]
