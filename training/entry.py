"""Entry points of the commands of training; they import it only when called."""

from grasping_invisible.data.extras import run_with_extra


def collect() -> int:
    """Run `gi-collect`."""
    return run_with_extra("gi-collect", "train", "grasping_invisible.training.collect_cli")


def evaluate() -> int:
    """Run `gi-eval`."""
    return run_with_extra("gi-eval", "train", "grasping_invisible.training.eval_cli")


def train() -> int:
    """Run `gi-train`."""
    return run_with_extra("gi-train", "train", "grasping_invisible.training.cli")
