"""How the fingers stand before a grasp: centred on what is seen of the target, and open just as far as it needs.

Fully open fingers need some 3 cm of free table beside a 5 cm block; fingers that fit it need half as much.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.runtime.workspace import Workspace

MAX_OPENING = 0.08  # metres between the finger pads: Franka's hand
MIN_OPENING = 0.03
CLEARANCE = 0.006  # metres between a finger pad and the target, on either side
MAX_SHIFT = 0.012  # metres from the chosen cell
FINGER_BREADTH = 0.022  # metres across the closing axis
LARGEST_GAP = 0.006  # metres along the axis that the mask may lack: what is farther away is not closed on
_ROUNDING = 1e-9  # metres: cells lie on the limits above as often as not, and half a turn is the same grasp
REACH = 0.012  # metres around the chosen cell in which the target has to show


@dataclass(frozen=True)
class Preshape:
    """`shift`: along the closing axis from the chosen cell; `opening`: between the pads, 0 for as far as possible."""

    shift: float
    opening: float


FULLY_OPEN = Preshape(0.0, 0.0)


def preshape(mask: NDArray[np.bool_], workspace: Workspace, cell: tuple[float, float], yaw: float) -> Preshape:
    """Fingers for a grasp at a cell, (x, y) in metres, base frame, that closes along `yaw` radians.

    `mask`: (N, N) bool, the target's heightmap cells. Fully open in the cell itself where the target does not show
    there, as when something else is grasped, where it is too broad to be closed on, and where centring on it means
    leaving the workspace.
    """
    span = _span(mask, workspace, cell, yaw)
    if span is None or span[1] - span[0] > MAX_OPENING:
        return FULLY_OPEN
    low, high = span
    shift = min(max((low + high) / 2, -MAX_SHIFT), MAX_SHIFT)
    if not workspace.contains(cell[0] + shift * math.cos(yaw), cell[1] + shift * math.sin(yaw)):
        return FULLY_OPEN
    opening = max(2 * (max(high - shift, shift - low) + CLEARANCE), MIN_OPENING)
    return Preshape(shift, opening if opening <= MAX_OPENING else 0.0)


def _span(
    mask: NDArray[np.bool_], workspace: Workspace, cell: tuple[float, float], yaw: float
) -> tuple[float, float] | None:
    """From where to where along the axis the target reaches between the fingers, metres from the cell."""
    rows, columns = np.nonzero(mask)
    x = workspace.low[0] + (columns + 0.5) * workspace.resolution - cell[0]
    y = workspace.high[1] - (rows + 0.5) * workspace.resolution - cell[1]
    between = np.abs(y * math.cos(yaw) - x * math.sin(yaw)) <= FINGER_BREADTH / 2 + _ROUNDING
    along = np.sort((x * math.cos(yaw) + y * math.sin(yaw))[between])
    if not len(along):
        return None
    pieces = np.split(along, np.flatnonzero(np.diff(along) > LARGEST_GAP + _ROUNDING) + 1)
    nearest = min(pieces, key=lambda piece: max(piece[0], -piece[-1], 0.0))
    half_cell = workspace.resolution / 2
    low, high = float(nearest[0]) - half_cell, float(nearest[-1]) + half_cell
    return (low, high) if max(low, -high) <= REACH else None
