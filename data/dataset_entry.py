"""Entry point of `gi-dataset`, which imports pyarrow only when called."""

from grasping_invisible.data.extras import run_with_extra


def dataset() -> int:
    """Run `gi-dataset`."""
    return run_with_extra("gi-dataset", "dataset", "grasping_invisible.data.dataset.cli")
