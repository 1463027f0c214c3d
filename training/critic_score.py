"""How well a critic foresees what executed actions are worth, on runs held out of training."""

from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray

from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.training.critic_batch import example, executed_values
from grasping_invisible.training.critic_net import CriticNet
from grasping_invisible.training.transitions import HIDDEN, GraspsTried, Transition

BATCH = 32


def score_critic(
    net: CriticNet,
    transitions: Sequence[Transition],
    tried: GraspsTried,
    targets: NDArray[np.float32],
    middle: float,
) -> dict[str, float]:
    """Scores of a network in evaluation mode; what the transitions have no example of is left out.

    `tried`: `grasps_tried` of all that the transitions are a part of. `targets`: (T,), what they were worth, see
    `Replay`. `td_error`: mean absolute difference to them.
    `grasp_auc`: how well the Q value tells successful from failed grasps aimed at the goal. `push_auc`: the same of
    pushes after which a grasp took the goal and of those after which all that were tried failed. `reveal_auc`: of
    pushes of a search that brought something to light and others.
    `grasp_accuracy`: with grasps called successful above `middle`.
    """
    values = predicted(net, transitions)
    search = np.array([transition.goal == HIDDEN for transition in transitions], np.bool_)
    aimed = np.array([transition.aimed for transition in transitions], np.bool_)
    success = np.array([transition.success for transition in transitions], np.bool_)
    led_to = _led_to_success(transitions, tried)
    push = np.array([index in led_to for index in range(len(transitions))], np.bool_)
    freed = np.array([led_to.get(index, False) for index in range(len(transitions))], np.bool_)
    scores = {
        "td_error": float(np.abs(values - targets).mean()),
        "grasp_auc": auc(values[aimed], success[aimed]),
        "grasp_accuracy": float(((values > middle) == success)[aimed].mean()) if aimed.any() else np.nan,
        "push_auc": auc(values[push], freed[push]),
        "reveal_auc": auc(values[search], success[search]),
        "held_out_grasps": float(aimed.sum()),
        "held_out_pushes": float(push.sum()),
        "held_out_searches": float(search.sum()),
    }
    return {name: value for name, value in scores.items() if np.isfinite(value)}


def _led_to_success(transitions: Sequence[Transition], tried: GraspsTried) -> dict[int, bool]:
    """Of each push after which the goal was to be grasped: its index, and whether any such grasp took it."""
    return {
        index: tried[id(transition.then), transition.goal]
        for index, transition in enumerate(transitions)
        if transition.kind == gi.PUSH and (id(transition.then), transition.goal) in tried
    }


def predicted(net: CriticNet, transitions: Sequence[Transition]) -> NDArray[np.float32]:
    """Q values of executed actions, (T,)."""
    values = []
    with torch.inference_mode():
        for start in range(0, len(transitions), BATCH):
            batch = transitions[start : start + BATCH]
            examples = [example(transition, net.planes) for transition in batch]
            values.append(executed_values(net, examples, batch).cpu().numpy())
    return np.concatenate(values)


def auc(values: NDArray[np.float32], positive: NDArray[np.bool_]) -> float:
    """The chance that a positive example has a greater value than a negative one; NaN without one of each."""
    negative = np.sort(values[~positive])
    if not positive.any() or not len(negative):
        return float("nan")
    smaller, no_greater = (np.searchsorted(negative, values[positive], side) for side in ("left", "right"))
    return float((smaller + no_greater).mean() / 2 / len(negative))
