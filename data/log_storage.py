"""Where the parts of a rotated log lie, and how a folder of logs is kept within a budget."""

import os
import re
import stat
from pathlib import Path

from grasping_invisible.data.log_file import is_being_written

SUFFIX = ".mcap"
_LATER_PART = re.compile(r"\.\d{3,}$")


def part_path(first: Path, part: int) -> Path:
    """Part 0 is the log's own path, `run.mcap`; the next are `run.001.mcap`, `run.002.mcap`, ..."""
    return first if part == 0 else first.with_name(f"{first.stem}.{part:03d}{first.suffix}")


def parts_of(first: Path) -> list[Path]:
    """The log at `first` and the parts that follow it, in order; `first` itself even if it is gone."""
    parts = [first]
    while os.path.exists(following := part_path(first, len(parts))):  # also where its name would be too long
        parts.append(following)
    return parts


def log_name(path: Path) -> str:
    """What the files of one log have in common: `run` of `run.mcap`, `run.001.mcap`, ..."""
    return _LATER_PART.sub("", path.stem)


def first_part(path: Path) -> Path:
    """Where the log begins that a file is a part of: without a `run.mcap`, `run.001.mcap` is a log of its own."""
    first = path.with_name(log_name(path) + SUFFIX)
    return first if path.suffix == SUFFIX and first.exists() else path


def keep_within(folder: Path, budget_bytes: int) -> list[Path]:
    """Remove the oldest logs of a folder, each with all its parts, until the rest fits the budget.

    A log with a part being written stays whole. Returns what was removed. Files that vanish meanwhile or cannot be
    removed are passed over.
    """
    sizes = {path: status for path in folder.glob(f"*{SUFFIX}") if (status := _stat(path)) is not None}
    total = sum(size for _, size in sizes.values())
    logs: dict[str, list[Path]] = {}
    for path in sorted(sizes):
        logs.setdefault(log_name(path), []).append(path)
    removed = []
    for parts in sorted(logs.values(), key=lambda parts: (max(sizes[part][0] for part in parts), parts[0].name)):
        if total <= budget_bytes:
            break
        if any(is_being_written(part) for part in parts):
            continue
        for part in parts:
            try:
                part.unlink()
            except OSError:
                continue
            total -= sizes[part][1]
            removed.append(part)
    return removed


def _stat(path: Path) -> tuple[int, int] | None:
    try:
        status = path.stat()
    except OSError:
        return None
    return (status.st_mtime_ns, status.st_size) if stat.S_ISREG(status.st_mode) else None
