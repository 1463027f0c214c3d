"""Seeds as they are given on command lines."""

from grasping_invisible.runtime.errors import BadInput

MAX_SEED = 2**32 - 1


def check_seed(seed: int, least: int = 0, most: int = MAX_SEED) -> None:
    """Raises `BadInput` where a seed is none that can be used."""
    if not least <= seed <= most:
        raise BadInput(f"--seed must be {least} to {most}, not {seed}")
