import numpy as np
import pytest

from grasping_invisible.data.target_border import TargetBorder
from grasping_invisible.runtime.choice import Choice
from grasping_invisible.runtime.coordinator import classifier_features, coordinate
from grasping_invisible.runtime.critic import QMaps

SHAPE = (16, 112, 112)
BORDER = TargetBorder(occupied=50, border=200, target=100)
ANY, NONE = np.ones(SHAPE, bool), np.zeros(SHAPE, bool)
PUSH = Choice(1, 20, 30, 0.5)
GRASP = Choice(9, 50, 60, 0.75)


@pytest.fixture
def q_maps() -> QMaps:
    push, grasp = np.zeros(SHAPE, np.float32), np.zeros(SHAPE, np.float32)
    push[1, 20, 30], grasp[9, 50, 60] = 0.5, 0.75
    return QMaps(push, grasp)


def ask(q_maps, probability, push_allowed=ANY, grasp_allowed=ANY, asked=None):
    def classifier(features):
        if asked is not None:
            asked.append(features)
        return probability

    return coordinate(q_maps, push_allowed, grasp_allowed, BORDER, 2, classifier, np.random.default_rng(0))


@pytest.mark.parametrize(
    ("probability", "grasp", "choice"), [(0.5, True, GRASP), (0.9, True, GRASP), (0.49, False, PUSH)]
)
def test_the_classifier_chooses_the_kind_and_the_critic_the_place(q_maps, probability, grasp, choice):
    coordination = ask(q_maps, probability)
    assert coordination is not None
    assert coordination.grasp is grasp
    assert coordination.choice == choice
    assert (coordination.q_push, coordination.q_grasp) == (0.5, 0.75)


def test_the_classifier_is_told_the_values_the_border_and_the_failures(q_maps):
    asked = []
    ask(q_maps, 0.5, asked=asked)
    np.testing.assert_allclose(asked[0], [0.5, 0.75, 0.25, 0.5, 2])
    assert asked[0].dtype == np.float32
    np.testing.assert_array_equal(asked[0], classifier_features(0.5, 0.75, BORDER, 2))


@pytest.mark.parametrize(
    ("probability", "push_allowed", "grasp_allowed", "choice"),
    [(0.1, NONE, ANY, GRASP), (0.9, ANY, NONE, PUSH)],
)
def test_the_other_kind_is_taken_where_one_is_impossible(q_maps, probability, push_allowed, grasp_allowed, choice):
    coordination = ask(q_maps, probability, push_allowed, grasp_allowed)
    assert coordination is not None
    assert coordination.choice == choice
    assert coordination.grasp != coordination.prefers_grasp


def test_values_of_impossible_actions_are_not_reported(q_maps):
    coordination = ask(q_maps, 0.9, grasp_allowed=NONE)
    assert coordination is not None
    assert coordination.q_grasp == 0.0


def test_nothing_is_possible(q_maps):
    assert ask(q_maps, 0.9, NONE, NONE) is None
