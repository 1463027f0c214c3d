"""Doubt in pushes like those that changed nothing.

A critic sees the same scene as before, values the same pushes as before, and is wrong as before: a push that moved
nothing, because it passed beside or above things or what it met stands too firm, says so of those like it. By how much
is measured: of pushes tried from one state in generated clutter, odds of success fell to 0.4 where another had changed
nothing near by.
"""

import math

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import ACTION_CELLS, PUSH_LEVELS, ROTATIONS
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.failures import ACTS_AHEAD, acts_at
from grasping_invisible.runtime.memory import FruitlessAction
from grasping_invisible.runtime.rotation import ANGLES, ahead_of_cells
from grasping_invisible.runtime.workspace import Workspace

LOG_ODDS = -0.9  # of success, what one such push adds for itself
OTHER_LEVEL = 0.5  # of that, for pushes at the other height
DEVIATION = 0.05  # metres between where pushes act, standard deviation of the Gaussian
TURN_DEVIATION = 0.8  # radians between their directions


def doubted(
    q_push: NDArray[np.float32], fruitless: tuple[FruitlessAction, ...], workspace: Workspace
) -> NDArray[np.float32]:
    """Q values of pushes, (2, 16, 112, 112) float32, probabilities, after those that changed nothing are heard."""
    in_vain = [action for action in fruitless if action.kind == gi.PUSH and action.unchanged]
    if not in_vain:
        return q_push
    evidence = np.zeros((len(PUSH_LEVELS), ROTATIONS, ACTION_CELLS, ACTION_CELLS), np.float32)
    for push in in_vain:
        alike = _likeness(push, workspace)
        for level in PUSH_LEVELS:
            evidence[level] += alike if level == push.level else OTHER_LEVEL * alike
    odds = np.exp(LOG_ODDS * evidence)
    return (q_push * odds / (1.0 - q_push + q_push * odds)).astype(np.float32, copy=False)


def _likeness(push: FruitlessAction, workspace: Workspace) -> NDArray[np.float32]:
    """How like a push each on the action grid is, (16, 112, 112) float32, 1 for itself."""
    acts_x, acts_y = ahead_of_cells(ACTS_AHEAD, workspace)
    x, y = acts_at(push.x, push.y, push.yaw)
    turn = (ANGLES - push.yaw + math.pi) % (2 * math.pi) - math.pi
    along_x, along_y, turned = (
        np.exp(-((distance / deviation) ** 2) / 2.0)
        for distance, deviation in (
            (acts_x - x, DEVIATION),
            (acts_y - y, DEVIATION),
            (turn[:, None, None], TURN_DEVIATION),
        )
    )
    return (turned * along_x * along_y).astype(np.float32)
