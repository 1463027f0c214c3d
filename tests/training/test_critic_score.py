"""What a critic's scores are of."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
import torch

from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.workspace import Workspace
from grasping_invisible.training.critic_net import CriticNet
from grasping_invisible.training.critic_score import score_critic
from grasping_invisible.training.packed_maps import PackedMaps
from grasping_invisible.training.transitions import HIDDEN, Transition, grasps_tried


class HeightAsValue(CriticNet):
    """Says of every motion how high it is where it starts."""

    def __init__(self) -> None:
        super().__init__(2)
        self.weight = torch.nn.Parameter(torch.zeros(1))

    def forward(self, planes: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        return planes[:, [0, 0]], planes[:, 0]


def state(height: float) -> PackedMaps:
    labels = np.zeros((224, 224), np.uint8)
    labels[100:124, 100:124] = 1
    heights = np.full((224, 224), height, np.float32)
    return PackedMaps.of(Heightmaps(1, np.zeros((224, 224, 3), np.uint8), heights, labels, Workspace()))


def motion(seen: PackedMaps, then: PackedMaps | None, kind: gi.MotionKind, *, success: bool = False) -> Transition:
    aimed = kind == gi.GRASP
    return Transition(seen, 1, kind, 0, 55, 55, float(success), success, then, False, aimed, "r", 0)


def scores_of(*transitions: Transition, among: Sequence[Transition] = ()) -> dict[str, float]:
    tried = grasps_tried(among or transitions)
    return score_critic(HeightAsValue().eval(), transitions, tried, np.zeros(len(transitions), np.float32), 0.5)


def test_a_push_is_good_when_a_grasp_after_it_takes_the_goal() -> None:
    high, low, freed, stuck, unknown = (state(height) for height in (0.09, 0.01, 0.05, 0.04, 0.03))
    motions = (
        motion(high, freed, gi.PUSH),
        motion(low, stuck, gi.PUSH),
        motion(low, unknown, gi.PUSH),  # after which nothing was tried
        motion(freed, freed, gi.GRASP),
        motion(freed, None, gi.GRASP, success=True),
        motion(stuck, stuck, gi.GRASP),
    )
    scores = scores_of(*motions)
    assert (scores["push_auc"], scores["held_out_pushes"]) == (1.0, 2.0)
    assert scores_of(replace(motions[0], seen=low), replace(motions[1], seen=high), *motions[2:])["push_auc"] == 0.0
    assert scores["grasp_auc"] == pytest.approx(0.75)  # the one that took it stood as high as one that did not


def test_what_was_tried_is_known_of_a_sample_too() -> None:
    high, low, freed, stuck = (state(height) for height in (0.09, 0.01, 0.05, 0.04))
    pushes = motion(high, freed, gi.PUSH), motion(low, stuck, gi.PUSH)
    grasps = motion(freed, None, gi.GRASP, success=True), motion(stuck, stuck, gi.GRASP)
    assert scores_of(*pushes, among=(*pushes, *grasps))["push_auc"] == 1.0
    assert "push_auc" not in scores_of(*pushes)


def test_searches_have_a_score_of_their_own() -> None:
    high, low = state(0.09), state(0.01)
    found = replace(motion(high, None, gi.PUSH, success=True), goal=HIDDEN)
    in_vain = replace(motion(low, low, gi.PUSH), goal=HIDDEN)
    scores = scores_of(found, in_vain)
    assert (scores["reveal_auc"], scores["held_out_searches"]) == (1.0, 2.0)
    assert "push_auc" not in scores
