"""The coordination policy: push or grasp once the target is seen (paper, section IV-B)."""

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.target_border import TargetBorder
from grasping_invisible.runtime.options import options_for
from grasping_invisible.runtime.situation import Proposal, Situation

GRASP_THRESHOLD = 0.5  # from this probability on, grasp


def classifier_features(
    q_push: float, q_grasp: float, border: TargetBorder, consecutive_grasp_failures: int
) -> NDArray[np.float32]:
    """The action classifier's input, (5,) float32: q_p, q_g, r_b, n_b, c_g."""
    return np.array([q_push, q_grasp, border.ratio, border.norm, consecutive_grasp_failures], np.float32)


def coordinate(situation: Situation) -> Proposal | None:
    """Ask the classifier whether to grasp, then take the best motion of that kind for the target.

    Where that kind allows no motion, or a push would be the run's last, the other kind is taken; None where neither
    allows one.
    """
    options = options_for(situation, situation.perception.mask)
    if options is None:
        return None
    q_push, q_grasp = options.q_push, options.q_grasp
    features = classifier_features(q_push, q_grasp, situation.border, situation.memory.consecutive_grasp_failures)
    probability = situation.models.grasp_probability(features)
    preferred = gi.GRASP if probability >= GRASP_THRESHOLD else gi.PUSH
    kind, choice, caveat = options.best(preferred, situation.rng)
    why = (
        f"{seen(situation)}: a grasp would succeed with probability {probability:.2f}; best push {q_push:.2f}, "
        f"best grasp {q_grasp:.2f}, border {situation.border.ratio:.0%} occupied{caveat}"
    )
    return Proposal(kind, choice, options.q_maps, q_push, q_grasp, why, probability)


def seen(situation: Situation) -> str:
    """That the target is seen, and how much of it."""
    return f"seen ({situation.perception.target_pixels} px)"
