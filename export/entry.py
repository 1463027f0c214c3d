"""Entry point of the command of export; it imports torch only when called."""

from grasping_invisible.data.extras import run_with_extra


def export() -> int:
    """Run `gi-export`."""
    return run_with_extra("gi-export", "train", "grasping_invisible.export.cli")
