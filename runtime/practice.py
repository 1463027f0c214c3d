"""Practising: how a robot gathers experience of what its models are not good at yet (paper, section VI-B)."""

from dataclasses import replace

import numpy as np

from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.choice import best_action
from grasping_invisible.runtime.coordinator import coordinate, instead, seen
from grasping_invisible.runtime.options import options_for
from grasping_invisible.runtime.situation import Proposal, Situation

RANDOM_SHARE = 0.5  # of motions; what the models think best teaches too, most of all where they are wrong


def practise(situation: Situation) -> Proposal | None:
    """Half of the time what the coordinator would do, otherwise any possible motion for the target.

    A push or a grasp by the flip of a coin; as safe as any other, for it is one of those that the coordinator chooses
    from. None where there is none.
    """
    if situation.rng.random() >= RANDOM_SHARE:
        return coordinate(situation)
    options = options_for(situation, situation.perception.mask)
    if options is None:
        return None
    preferred, other = (gi.PUSH, gi.GRASP) if situation.rng.random() < 0.5 else (gi.GRASP, gi.PUSH)
    allowed = {gi.PUSH: options.pushes, gi.GRASP: options.grasps}
    kind = preferred if allowed[preferred].any() else other
    choice = best_action(np.zeros(allowed[kind].shape, np.float32), allowed[kind], situation.rng)  # of equal ones any
    assert choice is not None  # there are options
    values = options.q_maps.push if kind == gi.PUSH else options.q_maps.grasp
    choice = replace(choice, value=float(values[choice.rotation, choice.row, choice.column]))
    why = f"{seen(situation)}: practice, any motion for it; the critic values this one {choice.value:.2f}"
    return Proposal(kind, choice, options.q_maps, options.q_push, options.q_grasp, why + instead(preferred, kind))
