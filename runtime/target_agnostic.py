"""Baselines whose critic knows no target: VPG, and Mask-VPG, which masks its maps afterwards (paper, section VII)."""

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import blocks, feasible_grasps
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.target_border import GROUND_HEIGHT, distance_to
from grasping_invisible.runtime.choice import best_action
from grasping_invisible.runtime.coordinator import seen
from grasping_invisible.runtime.explorer import pushes_left, unseen
from grasping_invisible.runtime.motion import PUSH_NEARNESS
from grasping_invisible.runtime.options import Options, options_among
from grasping_invisible.runtime.situation import Proposal, Situation


def vpg(situation: Situation) -> Proposal:
    """The motion of the greatest target-agnostic Q value, whatever it moves or grasps, seen or not.

    Where nothing can be grasped or pushed, the best push through thin air.
    """
    q_maps = situation.agnostic_q_maps()
    maps = situation.maps
    something = feasible_grasps(maps.height > GROUND_HEIGHT, maps.workspace.resolution)
    options = options_among(situation, q_maps, np.ones_like(situation.pushes), something)
    if options is not None:
        return _greatest(options, situation, "any object")
    allowed, caveat = pushes_left(situation)
    choice = best_action(q_maps.push, allowed, situation.rng)
    assert choice is not None  # there is always a push left
    why = f"{unseen(situation)}: the greatest agnostic push {choice.value:.2f}{caveat}"
    return Proposal(gi.PUSH, choice, q_maps, choice.value, 0.0, why)


def mask_vpg(situation: Situation) -> Proposal | None:
    """The motion of the greatest target-agnostic Q value among grasps on the target and pushes that start near it.

    None where there are none.
    """
    mask, workspace = situation.perception.mask, situation.maps.workspace
    options = options_among(
        situation,
        situation.agnostic_q_maps(),
        np.broadcast_to(_near(mask, workspace.resolution), situation.pushes.shape),
        feasible_grasps(mask, workspace.resolution),
    )
    return None if options is None else _greatest(options, situation, "the target's mask")


def _near(mask: NDArray[np.bool_], resolution: float) -> NDArray[np.bool_]:
    """The target's mask, dilated so that it holds the fingers beside it, on the action grid, (112, 112)."""
    return np.asarray(blocks(distance_to(mask) * resolution <= PUSH_NEARNESS).any(axis=(1, 3)))


def _greatest(options: Options, situation: Situation, within: str) -> Proposal:
    preferred = gi.GRASP if options.q_grasp >= options.q_push else gi.PUSH
    kind, choice, caveat = options.best(preferred, situation.rng)
    sight = seen(situation) if situation.perception.target_seen else "not seen"
    why = (
        f"{sight}: the greatest agnostic value within {within}; best push {options.q_push:.2f}, "
        f"best grasp {options.q_grasp:.2f}{caveat}"
    )
    return Proposal(kind, choice, options.q_maps, options.q_push, options.q_grasp, why)
