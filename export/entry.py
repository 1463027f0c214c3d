"""Entry points of the commands of export; they import what they need only when called."""

from grasping_invisible.data.extras import run_with_extra


def export() -> int:
    """Run `gi-export`."""
    return run_with_extra("gi-export", "train", "grasping_invisible.export.cli")


def recipe() -> int:
    """Run `gi-recipe`."""
    return run_with_extra("gi-recipe", "train", "grasping_invisible.export.recipe_cli")


def bench() -> int:
    """Run `gi-bench`."""
    return run_with_extra("gi-bench", "train", "grasping_invisible.export.bench_cli")
