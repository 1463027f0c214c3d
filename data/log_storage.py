"""Where the parts of a rotated log lie, and how a folder of logs is kept within a budget."""

from pathlib import Path

from grasping_invisible.data.log_file import is_being_written

SUFFIX = ".mcap"


def part_path(first: Path, part: int) -> Path:
    """Part 0 is the log's own path, `run.mcap`; the next are `run.001.mcap`, `run.002.mcap`, ..."""
    return first if part == 0 else first.with_name(f"{first.stem}.{part:03d}{first.suffix}")


def parts_of(first: Path) -> list[Path]:
    """The log at `first` and the parts that follow it, in order; `first` itself even if it is gone."""
    parts = [first]
    while (following := part_path(first, len(parts))).exists():
        parts.append(following)
    return parts


def keep_within(folder: Path, budget_bytes: int) -> list[Path]:
    """Remove the oldest logs of a folder until all of them fit the budget; never one being written.

    Returns what was removed. Logs that vanish meanwhile or cannot be removed are passed over.
    """
    sizes = {path: status for path in folder.glob(f"*{SUFFIX}") if (status := _stat(path)) is not None}
    total = sum(size for _, size in sizes.values())
    removed = []
    for path in sorted(sizes, key=lambda path: (sizes[path][0], path.name)):
        if total <= budget_bytes:
            break
        if is_being_written(path):
            continue
        try:
            path.unlink()
        except OSError:
            continue
        total -= sizes[path][1]
        removed.append(path)
    return removed


def _stat(path: Path) -> tuple[int, int] | None:
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size
