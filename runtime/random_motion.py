"""Random motions: a baseline, and what practising robots do half of the time (paper, sections VI-B and VII-B)."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import LOW, feasible_grasps
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.choice import Choice, best_action
from grasping_invisible.runtime.coordinator import seen
from grasping_invisible.runtime.critic import QMaps
from grasping_invisible.runtime.motion import low_grasps, open_pushes
from grasping_invisible.runtime.options import instead
from grasping_invisible.runtime.situation import Proposal, Situation


def random_motion(situation: Situation) -> Proposal | None:
    """A push or a grasp by the flip of a coin, at a random cell of the target's mask and a random angle (RAND).

    Only what the arm cannot do is left out, and raised pushes, which pass over it; None where nothing is left. The
    critic has no say: it is asked for the log, so that one sees what was passed by.
    """
    maps = situation.maps
    on_target = feasible_grasps(situation.perception.mask, maps.workspace.resolution)
    allowed = {
        gi.PUSH: on_target & open_pushes(maps.workspace, situation.heights[LOW]),
        gi.GRASP: low_grasps(maps, on_target),
    }
    if not any(kind.any() for kind in allowed.values()):
        return None
    q_maps = situation.q_maps(situation.perception.mask)
    kind, choice, caveat = any_of(allowed, q_maps, situation.rng)
    why = f"{seen(situation)}: any motion on it; the critic values this one {choice.value:.2f}{caveat}"
    return Proposal(kind, choice, q_maps, float(q_maps.push.max()), float(q_maps.grasp.max()), why)


def any_of(
    allowed: Mapping[gi.MotionKind, NDArray[np.bool_]], q_maps: QMaps, rng: np.random.Generator
) -> tuple[gi.MotionKind, Choice, str]:
    """A push or a grasp by the flip of a coin and any allowed one of them, valued by `q_maps`, and what to add to why.

    `allowed`: bool, (16, 112, 112), of pushes also (2, 16, 112, 112); not all false.
    """
    preferred, other = (gi.PUSH, gi.GRASP) if rng.random() < 0.5 else (gi.GRASP, gi.PUSH)
    kind = preferred if allowed[preferred].any() else other
    values = q_maps.push if kind == gi.PUSH else q_maps.grasp
    choice = best_action(np.zeros(allowed[kind].shape, np.float32), allowed[kind], rng)  # of equal ones any
    assert choice is not None  # something is allowed
    return kind, replace(choice, value=float(choice.of(values))), instead(preferred, kind)
