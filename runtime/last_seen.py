"""Where the target may be once nothing of it shows: where it last did, and where pushes since may have taken it."""

import math

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import PUSH_LENGTH
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.decision_record import Decision
from grasping_invisible.runtime.motion import FINGERS_ACROSS
from grasping_invisible.runtime.perception import Perception
from grasping_invisible.runtime.workspace import Workspace

Place = tuple[float, float]

PLACES_REMEMBERED = 3
PLACE_RADIUS = 0.03  # metres: the target is some 5 cm wide
ASIDE = FINGERS_ACROSS / 2 + 0.025  # metres beside a push's way within which it takes something of that size along
CARRIED = 0.04  # metres ahead of a push's end, where the middle of what it took along lies


def last_seen_after(places: tuple[Place, ...], before: Perception, decision: Decision) -> tuple[Place, ...]:
    """Where the target may be after a motion that changed the scene, (x, y) in the base frame, likeliest last.

    `places`: where it might have been before, unless it showed. A push may have taken it along, or have slid over it.
    """
    shown = before.mask if before.mask.any() else before.hint
    if shown.any():
        places = (before.maps.workspace.middle_of(shown),)
    if decision.kind == gi.PUSH:
        places = (*places, *(taken for place in places if (taken := _taken_along(place, decision)) is not None))
    return places[-PLACES_REMEMBERED:]


def cells_around(places: tuple[Place, ...], workspace: Workspace) -> NDArray[np.bool_]:
    """The heightmap's cells within `PLACE_RADIUS` of some places, (N, N)."""
    x, y = workspace.cell_centers()
    around = np.zeros((workspace.cells, workspace.cells), np.bool_)
    for place_x, place_y in places:
        around |= (x - place_x) ** 2 + (y - place_y) ** 2 <= PLACE_RADIUS**2
    return around


def _taken_along(place: Place, push: Decision) -> Place | None:
    """Where a push takes what lies at a place in its way; None where it passes by."""
    x, y = place[0] - push.position[0], place[1] - push.position[1]
    ahead = x * math.cos(push.yaw) + y * math.sin(push.yaw)
    aside = y * math.cos(push.yaw) - x * math.sin(push.yaw)
    further = PUSH_LENGTH + CARRIED - ahead
    if abs(aside) > ASIDE or ahead < 0.0 or further <= 0.0:
        return None
    return place[0] + further * math.cos(push.yaw), place[1] + further * math.sin(push.yaw)
