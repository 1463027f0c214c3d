"""A baseline: push or grasp by a hand-made rule instead of the classifier (paper, section VII-B and appendix E)."""

import numpy as np

from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.target_border import TargetBorder
from grasping_invisible.runtime.coordinator import seen
from grasping_invisible.runtime.options import options_for
from grasping_invisible.runtime.situation import Proposal, Situation

ALPHA = 1e-2  # the paper's
BASE_RATE = 0.5


def border_heuristic(situation: Situation) -> Proposal | None:
    """The critic's best motion for the target, of the kind that the rule draws; None where none is possible."""
    options = options_for(situation, situation.perception.mask)
    if options is None:
        return None
    failures = situation.memory.consecutive_grasp_failures
    rate = pushing_rate(options.q_push, options.q_grasp, situation.border, failures)
    preferred = drawn_kind(rate, situation.border.ratio, failures, situation.rng)
    kind, choice, caveat = options.best(preferred, situation.rng)
    why = (
        f"{seen(situation)}: pushing rate {rate:.2f}; best push {options.q_push:.2f}, best grasp "
        f"{options.q_grasp:.2f}, border {situation.border.ratio:.0%} occupied, {failures} grasps failed{caveat}"
    )
    return Proposal(kind, choice, options.q_maps, options.q_push, options.q_grasp, why)


def pushing_rate(q_push: float, q_grasp: float, border: TargetBorder, grasp_failures: int) -> float:
    """The pushing exploration rate f_epsilon, 0 to 1 (appendix E).

    With nothing at the border it is its limit: 0 where grasping is worth more, 1 where pushing is.
    """
    crowding = (grasp_failures + 1) * (border.ratio + border.norm)
    if crowding == 0.0:
        return BASE_RATE - 0.5 * float(np.sign(q_grasp - q_push))
    return min(1.0, max(0.0, BASE_RATE - ALPHA * (q_grasp - q_push) / crowding))


def drawn_kind(rate: float, border_ratio: float, grasp_failures: int, rng: np.random.Generator) -> gi.MotionKind:
    """Push or grasp by algorithm 4 of appendix E, which pushes more readily after failed grasps."""
    if rng.random() < rate:
        return gi.PUSH
    if grasp_failures >= 2:
        return gi.PUSH
    if grasp_failures == 1 and rng.random() < border_ratio:
        return gi.PUSH
    return gi.GRASP
