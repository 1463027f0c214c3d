"""What packages above `data` contribute to its commands, found as entry points and loaded when needed.

`data` imports nothing of ours, and a log must be readable where robot and models are missing. So a command that needs
them announces itself in its package's metadata, and one that cannot be loaded harms no other.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import entry_points
from typing import Any

# Modules with `register(commands)`, which adds a subcommand of `gi-log` as those in `data.log_commands` do.
LOG_COMMANDS = "grasping_invisible.log_commands"
# Functions that make maps for `gi-log report`; see `data.report.MapMaker`.
REPORT_MAPS = "grasping_invisible.report_maps"


@dataclass(frozen=True)
class Extension:
    """Something another package contributes: what was loaded, or in one line why it could not be."""

    name: str
    loaded: Any = None
    failure: str = ""


def extensions(group: str) -> Iterator[Extension]:
    """All that is contributed to a group, ordered by name."""
    for entry in sorted(entry_points(group=group), key=lambda entry: entry.name):
        try:
            yield Extension(entry.name, entry.load())
        except Exception as error:  # whatever its import raises
            reason = str(error).splitlines()[0] if str(error) else type(error).__name__
            yield Extension(entry.name, failure=reason)
