from collections import Counter

from grasping_invisible.data.action_grid import LOW, feasible_grasps
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.random_motion import random_motion

RED = (0.53, 0.0, 0.05, 0.05, "red")
TOO_HIGH = (0.53, 0.0, 0.1, 0.29, "red")


def test_any_cell_and_angle_on_the_target_by_the_flip_of_a_coin(situation, set_models) -> None:
    set_models.q.push[:], set_models.q.grasp[:] = 0.2, 0.3
    kinds, cells, rotations = Counter(), set(), set()
    for seed in range(100):
        asked = situation(RED, seed=seed)
        proposal = random_motion(asked)
        assert proposal is not None
        choice = proposal.choice
        on_target = feasible_grasps(asked.perception.mask, asked.maps.workspace.resolution)
        assert choice.of(on_target)
        assert choice.level == LOW
        assert choice.value == (set_models.q.push if proposal.kind == gi.PUSH else set_models.q.grasp).flat[0]
        kinds[proposal.kind] += 1
        cells.add((choice.row, choice.column))
        rotations.add(choice.rotation)
    assert min(kinds.values()) > 30
    assert len(cells) > 40
    assert len(rotations) == 16


def test_what_the_arm_cannot_do_is_left_out(situation) -> None:
    proposals = [random_motion(situation(TOO_HIGH, seed=seed)) for seed in range(20)]
    assert {proposal.kind for proposal in proposals if proposal} == {gi.GRASP}  # beside its edge, low enough
    assert any("no push is possible" in proposal.why for proposal in proposals if proposal)
