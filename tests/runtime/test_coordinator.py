from dataclasses import replace

import numpy as np
import pytest

from grasping_invisible.data.action_grid import feasible_grasps
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.coordinator import classifier_features, coordinate
from grasping_invisible.runtime.memory import FruitlessAction, Memory
from grasping_invisible.runtime.options import options_for

RED = (0.53, 0.0, 0.05, 0.05, "red")
WALL = (0.59, 0.0, 0.05, 0.05, "grey")
FLAT = (0.5, 0.0, 0.012, 0.015, "red")  # nothing of it can be pushed
EVERY_GRASP_FAILED = Memory(fruitless=tuple(FruitlessAction(gi.GRASP, 0.5, 0.0, k * np.pi / 8) for k in range(8)))


@pytest.fixture
def valued(situation, set_models):
    """A situation in which one push and one grasp stand out: worth 0.5 and 0.75."""
    asked = situation(RED, WALL, memory=Memory(consecutive_grasp_failures=2))
    options = options_for(asked, asked.perception.mask)
    assert options is not None
    set_models.q.push[tuple(np.argwhere(options.pushes)[7])] = 0.5
    set_models.q.grasp[tuple(np.argwhere(options.grasps)[7])] = 0.75
    set_models.masks.clear()
    return asked


@pytest.mark.parametrize(
    ("probability", "kind", "value"), [(0.5, gi.GRASP, 0.75), (0.9, gi.GRASP, 0.75), (0.49, gi.PUSH, 0.5)]
)
def test_the_classifier_chooses_the_kind_and_the_critic_the_place(valued, set_models, probability, kind, value):
    set_models.probability = probability
    proposal = coordinate(valued)
    assert proposal is not None
    assert (proposal.kind, proposal.choice.value) == (kind, value)
    assert (proposal.q_push, proposal.q_grasp, proposal.grasp_probability) == (0.5, 0.75, probability)
    (mask,) = set_models.masks
    np.testing.assert_array_equal(mask, valued.perception.mask)


def test_the_last_motion_is_a_grasp(valued, set_models):
    set_models.probability = 0.1
    proposal = coordinate(replace(valued, memory=replace(valued.memory, last_motion=True)))
    assert proposal is not None
    assert (proposal.kind, proposal.choice.value, proposal.grasp_probability) == (gi.GRASP, 0.75, 0.1)
    assert "the last motion" in proposal.why


def test_the_classifier_is_told_the_values_the_border_and_the_failures(valued, set_models):
    coordinate(valued)
    border = valued.border
    assert border.ratio > 0
    np.testing.assert_allclose(set_models.features[0], [0.5, 0.75, border.ratio, border.norm, 2], rtol=1e-6)
    assert set_models.features[0].dtype == np.float32
    np.testing.assert_array_equal(set_models.features[0], classifier_features(0.5, 0.75, border, 2))


def test_values_of_impossible_motions_count_nothing(valued, set_models):
    elsewhere = ~feasible_grasps(valued.perception.mask, valued.maps.workspace.resolution)
    set_models.q.grasp[elsewhere] = 9.0
    proposal = coordinate(valued)
    assert proposal is not None
    assert proposal.q_grasp == 0.75


def test_the_other_kind_is_taken_where_one_is_impossible(situation, set_models):
    set_models.probability = 0.1
    proposal = coordinate(situation(FLAT))
    assert proposal is not None
    assert proposal.kind == gi.GRASP
    assert "no push is possible" in proposal.why


def test_nothing_is_possible(situation):
    assert coordinate(situation(FLAT, memory=EVERY_GRASP_FAILED)) is None
