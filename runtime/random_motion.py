"""A baseline: any motion on the target (paper, section VII-B, RAND)."""

from dataclasses import replace

import numpy as np

from grasping_invisible.data.action_grid import feasible_grasps
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.choice import best_action
from grasping_invisible.runtime.coordinator import instead, seen
from grasping_invisible.runtime.motion import low_grasps, open_pushes
from grasping_invisible.runtime.situation import Proposal, Situation


def random_motion(situation: Situation) -> Proposal | None:
    """A push or a grasp by the flip of a coin, at a random cell of the target's mask and a random angle.

    Only what the arm cannot do is left out; None where nothing is left. The critic has no say: it is asked for the
    log, so that one sees what was passed by.
    """
    maps = situation.maps
    on_target = feasible_grasps(situation.perception.mask, maps.workspace.resolution)
    allowed = {
        gi.PUSH: on_target & open_pushes(maps.workspace, situation.heights),
        gi.GRASP: low_grasps(maps, on_target),
    }
    preferred, other = (gi.PUSH, gi.GRASP) if situation.rng.random() < 0.5 else (gi.GRASP, gi.PUSH)
    kind = preferred if allowed[preferred].any() else other
    flat = np.zeros(on_target.shape, np.float32)
    choice = best_action(flat, allowed[kind], situation.rng)  # of equal ones any
    if choice is None:
        return None
    q_maps = situation.q_maps(situation.perception.mask)
    values = q_maps.push if kind == gi.PUSH else q_maps.grasp
    choice = replace(choice, value=float(values[choice.rotation, choice.row, choice.column]))
    why = (
        f"{seen(situation)}: any motion on it; the critic values this one {choice.value:.2f}{instead(preferred, kind)}"
    )
    return Proposal(kind, choice, q_maps, float(q_maps.push.max()), float(q_maps.grasp.max()), why)
