import numpy as np
import pytest

from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.motion import PUSH_NEARNESS, cell_position
from grasping_invisible.runtime.target_agnostic import mask_vpg, vpg

RED = (0.45, 0.1, 0.05, 0.05, "red")
GREY = (0.62, -0.1, 0.06, 0.05, "grey")


def place_of(proposal, asked) -> tuple[float, float]:
    return cell_position(proposal.choice.row, proposal.choice.column, asked.maps.workspace)


def near(asked, x: float, y: float, radius: float) -> np.ndarray:
    """(112, 112): the cells about a place."""
    at = np.array([[cell_position(row, column, asked.maps.workspace) for column in range(112)] for row in range(112)])
    return np.hypot(at[..., 0] - x, at[..., 1] - y) <= radius


@pytest.mark.parametrize("kind", [gi.PUSH, gi.GRASP])
def test_vpg_takes_the_greatest_value_of_all_whatever_it_is_for(situation, set_models, kind) -> None:
    asked = situation(RED, GREY)
    values = set_models.q.push if kind == gi.PUSH else set_models.q.grasp
    values[..., near(asked, *GREY[:2], 0.08)] = 0.6
    proposal = vpg(asked)
    assert proposal.kind == kind
    assert np.hypot(*np.subtract(place_of(proposal, asked), GREY[:2])) <= 0.08
    assert all(mask.all() for mask in set_models.masks)  # asked for any object


def test_vpg_grasps_where_something_is(situation, set_models) -> None:
    asked = situation(GREY)
    set_models.q.grasp[:, ~near(asked, *GREY[:2], 0.06)] = 0.9  # the critic errs about the empty table
    set_models.q.grasp[:, near(asked, *GREY[:2], 0.01)] = 0.3
    proposal = vpg(asked)
    assert (proposal.kind, proposal.choice.value) == (gi.GRASP, pytest.approx(0.3))
    assert "not seen" in proposal.why


def test_vpg_pushes_through_thin_air_where_there_is_nothing(situation) -> None:
    proposal = vpg(situation())
    assert proposal.kind == gi.PUSH
    assert "nothing stands high enough" in proposal.why


@pytest.mark.parametrize("kind", [gi.PUSH, gi.GRASP])
def test_mask_vpg_keeps_to_the_targets_mask(situation, set_models, kind) -> None:
    asked = situation(RED, GREY)
    values = set_models.q.push if kind == gi.PUSH else set_models.q.grasp
    values[..., near(asked, *GREY[:2], 0.08)] = 0.9  # better, but not the target's
    values[..., near(asked, *RED[:2], 0.08)] = 0.6
    proposal = mask_vpg(asked)
    assert proposal is not None
    assert (proposal.kind, proposal.choice.value) == (kind, pytest.approx(0.6))
    assert all(mask.all() for mask in set_models.masks)
    x, y = place_of(proposal, asked)
    reach = RED[2] / 2 + (PUSH_NEARNESS if kind == gi.PUSH else 0.01)
    assert max(abs(x - RED[0]), abs(y - RED[1])) <= reach + 0.004
