"""A baseline: the action policy of Mechanical Search (Danielczuk et al.; paper, appendix A).

Object by object, the target first and then the largest visible one, an object is taken away if its grasp seems good
enough, and pushed otherwise; three pushes in a row are the most. The paper gives no thresholds: those here are ours.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.target_border import target_border
from grasping_invisible.runtime.coordinator import classifier_features
from grasping_invisible.runtime.object_masks import object_masks
from grasping_invisible.runtime.options import Options, options_for
from grasping_invisible.runtime.situation import Proposal, Situation
from grasping_invisible.runtime.target_agnostic import vpg

LOW_QUALITY, HIGH_QUALITY = 0.25, 0.5  # t_low for the target, t_high for what lies in its way
MOST_PUSHES = 3  # in a row
MOST_OBJECTS = 8  # looked at for one decision


@dataclass(frozen=True)
class _Candidate:
    """An object, its mask (N, N), and how likely its best grasp is to succeed."""

    name: str
    mask: NDArray[np.bool_]
    options: Options
    quality: float
    threshold: float


def mechanical_search(situation: Situation) -> Proposal:
    """The first good grasp or possible push down the list of objects.

    Where the list ends without one, which is where Mechanical Search gives up: the likeliest grasp of the list, or
    with an empty list what VPG would do.
    """
    passed: list[_Candidate] = []
    for candidate in _candidates(situation):
        if candidate.quality > candidate.threshold and candidate.options.grasps.any():
            return _proposal(candidate, gi.GRASP, situation, "good enough")
        if candidate.options.pushes.any() and situation.memory.consecutive_pushes < MOST_PUSHES:
            return _proposal(candidate, gi.PUSH, situation, "not good enough")
        passed.append(candidate)
    graspable = [candidate for candidate in passed if candidate.options.grasps.any()]
    if graspable:
        return _proposal(max(graspable, key=lambda item: item.quality), gi.GRASP, situation, "the best of all")
    return vpg(situation)


def _candidates(situation: Situation) -> Iterator[_Candidate]:
    for name, mask, threshold in _priorities(situation):
        options = options_for(situation, mask)
        if options is not None:
            yield _Candidate(name, mask, options, _quality(situation, mask, options), threshold)


def _priorities(situation: Situation) -> Iterator[tuple[str, NDArray[np.bool_], float]]:
    """Names, masks (N, N) and thresholds: the target if it is seen, then the others by their visible size."""
    target = situation.perception.mask
    if target.any():
        yield "the target", target, LOW_QUALITY
    others = [mask & ~target for mask in object_masks(situation.maps)]
    others = [mask for mask in others if mask.any()]
    for number, mask in enumerate(others[:MOST_OBJECTS], start=1):
        yield f"object {number} of {len(others)}", mask, HIGH_QUALITY


def _quality(situation: Situation, mask: NDArray[np.bool_], options: Options) -> float:
    """How likely the best grasp of an object is to succeed, by the action classifier."""
    border = target_border(situation.maps.height, mask, situation.maps.workspace.resolution)
    failures = situation.memory.consecutive_grasp_failures
    return situation.models.grasp_probability(classifier_features(options.q_push, options.q_grasp, border, failures))


def _proposal(candidate: _Candidate, kind: gi.MotionKind, situation: Situation, judgement: str) -> Proposal:
    options = candidate.options
    kind, choice, caveat = options.best(kind, situation.rng)
    sight = "seen" if situation.perception.target_seen else "not seen"
    why = (
        f"{sight}: {gi.MotionKind.Name(kind).lower()} {candidate.name}, whose grasp would succeed with probability "
        f"{candidate.quality:.2f}, {judgement}{caveat}"
    )
    return Proposal(
        kind, choice, options.q_maps, options.q_push, options.q_grasp, why, candidate.quality, mask=candidate.mask
    )
