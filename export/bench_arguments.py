"""What the arguments of `gi-bench` may be."""

import argparse
import math

from grasping_invisible.runtime.seed import MAX_SEED


def count(text: str) -> int:
    """How many, from 1 on."""
    return _from(1, text, "count")


def seed_number(text: str) -> int:
    """A seed, from 0 on."""
    return _from(0, text, "seed", MAX_SEED)


def _from(least: int, text: str, what: str, most: float = math.inf) -> int:
    try:
        value = int(text)
    except ValueError:
        value = least - 1
    if not least <= value <= most:
        upwards = "on" if most == math.inf else f"to {most}"
        raise argparse.ArgumentTypeError(f"{text} is not a {what} from {least} {upwards}")
    return value
