from collections import Counter

from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.coordinator import coordinate
from grasping_invisible.runtime.options import options_for
from grasping_invisible.runtime.practice import practise

RED = (0.53, 0.0, 0.05, 0.05, "red")


def test_half_of_the_motions_are_the_coordinators_and_half_any_that_it_chooses_from(situation, set_models) -> None:
    set_models.q.push[:], set_models.q.grasp[:] = 0.2, 0.3
    set_models.q.grasp[4, 56, 56] = 0.9
    by = Counter()
    cells = set()
    for seed in range(100):
        asked = situation(RED, seed=seed)
        proposal, options = practise(asked), options_for(asked, asked.perception.mask)
        assert proposal is not None
        assert options is not None
        choice = proposal.choice
        allowed = options.pushes if proposal.kind == gi.PUSH else options.grasps
        assert choice.of(allowed)
        practised = "practice" in proposal.why
        by[practised, proposal.kind] += 1
        if practised:
            cells.add((choice.row, choice.column))
    assert 35 <= by[True, gi.PUSH] + by[True, gi.GRASP] <= 65
    assert min(by[True, gi.PUSH], by[True, gi.GRASP]) >= 15
    assert len(cells) > 25


def test_what_is_not_practice_is_what_the_coordinator_does(situation, set_models) -> None:
    set_models.q.push[:], set_models.q.grasp[:] = 0.2, 0.3
    set_models.q.grasp[4, 56, 56] = 0.9
    greedy = [p for seed in range(20) if (p := practise(situation(RED, seed=seed))) and "practice" not in p.why]
    expected = coordinate(situation(RED, seed=0))
    assert expected is not None
    assert {(p.kind, p.choice) for p in greedy} == {(expected.kind, expected.choice)}
