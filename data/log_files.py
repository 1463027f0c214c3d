"""The logs that files and folders given to a command stand for."""

from collections.abc import Iterable
from pathlib import Path

from grasping_invisible.data.errors import BadRequest
from grasping_invisible.data.log_storage import SUFFIX, first_part


def logs_in(folder: Path) -> list[Path]:
    """The first parts of all logs in a folder and below it, by name."""
    return sorted(path for path in folder.rglob(f"*{SUFFIX}") if first_part(path) == path)


def logs_at(paths: Iterable[Path]) -> list[Path]:
    """The logs that files and folders stand for, each once, in order; a later part stands for its log.

    Raises `BadRequest` where there is none, or where a path does not exist.
    """
    found: dict[Path, Path] = {}
    given = list(paths)
    for path in given:
        if not path.exists():
            raise BadRequest(f"{path} does not exist")
        for log in logs_in(path) if path.is_dir() else [first_part(path)]:
            found.setdefault(log.resolve(), log)
    if not found:
        raise BadRequest(f"no {SUFFIX} logs in {', '.join(map(str, given))}")
    return [found[log] for log in sorted(found)]
