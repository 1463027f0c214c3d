"""Practising: how a robot gathers experience of what its models are not good at yet (paper, section VI-B)."""

from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.coordinator import coordinate, seen
from grasping_invisible.runtime.options import options_for
from grasping_invisible.runtime.random_motion import any_of
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
    allowed = {gi.PUSH: options.pushes, gi.GRASP: options.grasps}
    kind, choice, caveat = any_of(allowed, options.q_maps, situation.rng)
    why = f"{seen(situation)}: practice, any motion for it; the critic values this one {choice.value:.2f}{caveat}"
    return Proposal(kind, choice, options.q_maps, options.q_push, options.q_grasp, why)
