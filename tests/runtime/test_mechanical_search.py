import numpy as np
import pytest

from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.mechanical_search import HIGH_QUALITY, LOW_QUALITY, mechanical_search
from grasping_invisible.runtime.memory import Memory

RED = (0.45, 0.1, 0.05, 0.05, "red")
SMALL, LARGE = (0.62, 0.1, 0.04, 0.05, "grey"), (0.55, -0.1, 0.07, 0.05, "grey")


def covers(mask: np.ndarray, situation, block) -> bool:
    row, column = situation.maps.workspace.cell_of(*block[:2])
    return bool(mask[row, column])


def test_the_target_comes_first_and_may_be_a_worse_grasp(situation, set_models) -> None:
    set_models.probability = (LOW_QUALITY + HIGH_QUALITY) / 2
    asked = situation(RED, LARGE)
    proposal = mechanical_search(asked)
    assert proposal.kind == gi.GRASP
    assert covers(set_models.masks[-1], asked, RED)
    assert "the target" in proposal.why


def test_without_the_target_the_largest_object_is_next(situation, set_models) -> None:
    set_models.probability = HIGH_QUALITY + 0.1
    asked = situation(SMALL, LARGE)
    proposal = mechanical_search(asked)
    assert proposal.kind == gi.GRASP
    assert len(set_models.masks) == 1
    assert covers(set_models.masks[0], asked, LARGE)
    assert not covers(set_models.masks[0], asked, SMALL)
    assert "not seen" in proposal.why
    assert proposal.mask is not None  # the fingers are fitted to what is grasped
    assert covers(proposal.mask, asked, LARGE)


@pytest.mark.parametrize("quality", [LOW_QUALITY - 0.1, (LOW_QUALITY + HIGH_QUALITY) / 2])
def test_what_cannot_be_grasped_well_is_pushed(situation, set_models, quality) -> None:
    set_models.probability = quality
    proposal = mechanical_search(situation(LARGE))
    assert proposal.kind == gi.PUSH


def test_after_three_pushes_the_list_is_gone_through_for_its_best_grasp(situation, set_models) -> None:
    set_models.probability = 0.1
    pushed = mechanical_search(situation(RED, LARGE, memory=Memory(consecutive_pushes=2)))
    assert pushed.kind == gi.PUSH
    set_models.masks.clear()
    proposal = mechanical_search(situation(RED, LARGE, memory=Memory(consecutive_pushes=3)))
    assert proposal.kind == gi.GRASP
    assert len(set_models.masks) == 2
    assert "the best of all" in proposal.why


def test_an_empty_table_still_gives_a_motion(situation) -> None:
    assert mechanical_search(situation()).kind == gi.PUSH
