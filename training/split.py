"""Which runs are trained on and which are held out to score with."""

import zlib
from collections.abc import Sequence

from grasping_invisible.training.transitions import Transition

HELD_OUT_PERCENT = 15  # of runs


def split(transitions: Sequence[Transition]) -> tuple[list[Transition], list[Transition]]:
    """Transitions to train on and to score with; no run is in both, and a run always lands in the same."""
    taught: list[Transition] = []
    held_out: list[Transition] = []
    for transition in transitions:
        is_held_out = zlib.crc32(transition.run.encode()) % 100 < HELD_OUT_PERCENT
        (held_out if is_held_out else taught).append(transition)
    return taught, held_out
