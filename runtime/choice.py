"""Picking the best action of a stack of maps."""

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import LOW

T = TypeVar("T", bound=np.generic)


@dataclass(frozen=True)
class Choice:
    """An action on the action grid: rotation index, cell, and its value in the map it was chosen from.

    `level`: of a push, `LOW` or `RAISED`.
    """

    rotation: int
    row: int
    column: int
    value: float
    level: int = LOW

    def of(self, maps: NDArray[T]) -> T:
        """What maps, (16, 112, 112), or of pushes (2, 16, 112, 112), say of it."""
        return maps[(self.level, self.rotation, self.row, self.column)[-maps.ndim :]]


def best_action(values: NDArray[np.float32], allowed: NDArray[np.bool_], rng: np.random.Generator) -> Choice | None:
    """The allowed action of the greatest value, or None where none is allowed.

    `allowed`: (16, 112, 112), of pushes (2, 16, 112, 112); `values`: alike, or the same for both levels. Of equal ones
    `rng` draws one, so that a flat map prefers no corner.
    """
    values = np.broadcast_to(values, allowed.shape)
    highest = best_value(values, allowed)
    if highest is None:
        return None
    ties = np.flatnonzero(allowed & (values == highest))
    *level, rotation, row, column = map(int, np.unravel_index(ties[rng.integers(len(ties))], values.shape))
    return Choice(rotation, row, column, highest, *level)


def best_value(values: NDArray[np.float32], allowed: NDArray[np.bool_]) -> float | None:
    """The greatest value of an allowed action, or None where none is allowed."""
    highest = float(np.max(values, where=allowed, initial=-np.inf))
    return highest if np.isfinite(highest) else None
