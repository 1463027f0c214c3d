"""Picking the best action of a stack of maps."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Choice:
    """An action on the action grid: rotation index, cell, and its value in the map it was chosen from."""

    rotation: int
    row: int
    column: int
    value: float


def best_action(values: NDArray[np.float32], allowed: NDArray[np.bool_], rng: np.random.Generator) -> Choice | None:
    """The allowed action of the greatest value, or None where none is allowed.

    `values` and `allowed`: (16, 112, 112). Of equal ones `rng` draws one, so that a flat map prefers no
    corner.
    """
    highest = best_value(values, allowed)
    if highest is None:
        return None
    ties = np.flatnonzero(allowed & (values == highest))
    rotation, row, column = np.unravel_index(ties[rng.integers(len(ties))], values.shape)
    return Choice(int(rotation), int(row), int(column), highest)


def best_value(values: NDArray[np.float32], allowed: NDArray[np.bool_]) -> float | None:
    """The greatest value of an allowed action, or None where none is allowed."""
    highest = float(np.max(values, where=allowed, initial=-np.inf))
    return highest if np.isfinite(highest) else None
