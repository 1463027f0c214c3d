"""The coordination policy: push or grasp once the target is seen (paper, section IV-B)."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.target_border import TargetBorder
from grasping_invisible.runtime.choice import Choice, best_action, best_value
from grasping_invisible.runtime.critic import QMaps

COORDINATORS: tuple[str, ...] = ("coordinator",)
GRASP_THRESHOLD = 0.5  # from this probability on, grasp


@dataclass(frozen=True)
class Coordination:
    """What the coordinator chose, and from what.

    `q_push`, `q_grasp`: q_p and q_g, the greatest Q values of allowed actions; 0 where none is allowed.
    `grasp_probability`: the classifier's answer.
    """

    grasp: bool
    choice: Choice
    q_push: float
    q_grasp: float
    grasp_probability: float

    @property
    def prefers_grasp(self) -> bool:
        """What the classifier would rather have; `grasp` differs where that is not possible."""
        return self.grasp_probability >= GRASP_THRESHOLD


def classifier_features(
    q_push: float, q_grasp: float, border: TargetBorder, consecutive_grasp_failures: int
) -> NDArray[np.float32]:
    """The action classifier's input, (5,) float32: q_p, q_g, r_b, n_b, c_g."""
    return np.array([q_push, q_grasp, border.ratio, border.norm, consecutive_grasp_failures], np.float32)


def coordinate(
    q_maps: QMaps,
    push_allowed: NDArray[np.bool_],
    grasp_allowed: NDArray[np.bool_],
    border: TargetBorder,
    consecutive_grasp_failures: int,
    grasp_probability: Callable[[NDArray[np.float32]], float],
    rng: np.random.Generator,
) -> Coordination | None:
    """Ask the classifier whether to grasp, then take the best allowed action of that kind.

    `push_allowed`, `grasp_allowed`: (16, 112, 112) bool. Where the preferred kind allows no action the other
    kind is taken; None where neither does.
    """
    q_push = best_value(q_maps.push, push_allowed)
    q_grasp = best_value(q_maps.grasp, grasp_allowed)
    if q_push is None and q_grasp is None:
        return None
    features = classifier_features(q_push or 0.0, q_grasp or 0.0, border, consecutive_grasp_failures)
    probability = grasp_probability(features)
    grasp = q_push is None or (q_grasp is not None and probability >= GRASP_THRESHOLD)
    choice = best_action(q_maps.grasp, grasp_allowed, rng) if grasp else best_action(q_maps.push, push_allowed, rng)
    if choice is None:
        return None
    return Coordination(grasp, choice, q_push or 0.0, q_grasp or 0.0, probability)
