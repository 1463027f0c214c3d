"""What the arguments of `gi-bench` may be."""

import argparse


def count(text: str) -> int:
    """How many, from 1 on."""
    return _from(1, text, "count")


def seed_number(text: str) -> int:
    """A seed, from 0 on."""
    return _from(0, text, "seed")


def _from(least: int, text: str, what: str) -> int:
    try:
        value = int(text)
    except ValueError:
        value = least - 1
    if value < least:
        raise argparse.ArgumentTypeError(f"{text} is not a {what} from {least} on")
    return value
