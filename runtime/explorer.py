"""The exploration policy: where to push while the target is not seen (paper, sections IV-B and VII-A)."""

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import LOW, RAISED
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.choice import Choice, best_action, best_value
from grasping_invisible.runtime.explorer_maps import ExplorationMaps, exploration_maps
from grasping_invisible.runtime.motion import ends_inside, open_pushes, pushes_for
from grasping_invisible.runtime.situation import Proposal, Situation


def explore(situation: Situation, method: str = "explorer") -> Proposal:
    """The explorational push of a method in `FACTORS`; there is always one, if only through thin air."""
    q_maps = situation.agnostic_q_maps()
    maps = exploration_maps(situation.maps, q_maps.push, situation.memory.failed_pushes, method)
    allowed, caveat = _towards_hint(situation, *pushes_left(situation))
    choice, by = best_push(maps, allowed, situation.rng)
    return Proposal(
        gi.PUSH,
        choice,
        q_maps,
        best_value(q_maps.push, allowed) or 0.0,
        float(q_maps.grasp.max()),
        f"{unseen(situation)}: explore by {by} {choice.value:.3f} = clutter {choice.of(maps.clutter):.2f}, "
        f"agnostic push {choice.of(maps.agnostic):.2f}, failures {choice.of(maps.failure):.2f}{caveat}",
        exploration=maps,
    )


def best_push(maps: ExplorationMaps, allowed: NDArray[np.bool_], rng: np.random.Generator) -> tuple[Choice, str]:
    """The push of the greatest posterior, and what it was chosen by.

    `allowed`: (2, 16, 112, 112) bool, not all false. Where the posterior is 0 everywhere, as on a heap without
    edges, the failure likelihood together with either of the other factors decides, and at last the failure
    likelihood alone.
    """
    for values, by in (
        (maps.posterior, "posterior"),
        (maps.clutter * maps.failure, "clutter and failures"),
        (maps.agnostic * maps.failure, "agnostic push and failures"),
        (maps.failure, "failures alone"),
    ):
        choice = best_action(values, allowed, rng)
        if choice is not None and choice.value > 0.0:
            return choice, by
    raise ValueError("no push is allowed")


def pushes_left(situation: Situation) -> tuple[NDArray[np.bool_], str]:
    """The pushes to choose from, (2, 16, 112, 112) bool, never none, and what a person should know about them."""
    untried_pushes = situation.untried(gi.PUSH)
    workspace = situation.maps.workspace
    open_way = open_pushes(workspace, situation.heights)
    if not open_way.any():
        everywhere = np.broadcast_to(ends_inside(workspace), situation.heights.shape)
        return everywhere, "; everything seems too high to be reached"
    for allowed, caveat in (
        (situation.pushes & untried_pushes, ""),
        (situation.pushes, "; all that was left was tried before"),
        (open_way & untried_pushes, "; nothing stands high enough to be pushed"),
    ):
        if allowed.any():
            return allowed, caveat
    return open_way, "; nothing stands high enough to be pushed"


def _towards_hint(situation: Situation, allowed: NDArray[np.bool_], caveat: str) -> tuple[NDArray[np.bool_], str]:
    """Of some pushes those that pass where a little of the target shows or last did, if there are any.

    Where as much shows as would be enough, but for what lies on it, only those that take that off, if there are any.
    """
    hint, workspace = situation.hint, situation.maps.workspace
    if not hint.cells.any():
        return allowed, caveat
    there = pushes_for(allowed, hint.cells, workspace, hint.places)
    if situation.perception.target_glimpsed and there[RAISED].any():
        there[LOW] = False
        return there, f"{caveat}; it shows there, under something"
    if not there.any():
        return allowed, caveat
    shows = situation.perception.hint.any()
    return there, f"{caveat}; {'a little of it shows there' if shows else 'it may be there since it was last seen'}"


def unseen(situation: Situation) -> str:
    """Why the target is not what is acted on."""
    return "no motion for it is possible" if situation.perception.target_seen else "not seen"
