from dataclasses import replace

import numpy as np
import pytest

from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.failures import acts_at
from grasping_invisible.runtime.judge import judge
from grasping_invisible.runtime.judge import remember as judge_remember
from grasping_invisible.runtime.memory import Memory

TARGET = (0.5, 0.0, 0.05, 0.05, "red")
NEIGHBOUR = (0.552, 0.0, 0.05, 0.05, "grey")
ASIDE = (0.62, 0.0, 0.05, 0.05, "grey")


def outcome(holding: bool = False) -> gi.MotionOutcome:
    return gi.MotionOutcome(command_id=9, status=gi.COMPLETED, holding=holding, detail="done")


@pytest.mark.parametrize(
    ("aim", "holding", "left", "object_grasped", "target_grasped"),
    [
        ((0.5, 0.0), True, [ASIDE], True, True),
        ((0.5, 0.0), False, [ASIDE], False, False),  # the fingers closed on nothing
        ((0.62, 0.0), True, [], True, False),  # aimed at another block
        ((0.5, 0.0), True, [TARGET], True, False),  # the target is still there
        ((0.5, 0.0), True, [(0.5, 0.0, 0.024, 0.05, "red"), ASIDE], True, True),  # 77 % gone
        ((0.5, 0.0), True, [(0.5, 0.0, 0.030, 0.05, "red"), ASIDE], True, False),  # 64 % gone
    ],
)
def test_what_a_grasp_brought(decision, perceived, aim, holding, left, object_grasped, target_grasped):
    result = judge(perceived(TARGET, ASIDE), decision(gi.GRASP, *aim), outcome(holding), perceived(*left))
    assert result.object_grasped is object_grasped
    assert result.target_grasped is target_grasped


def test_a_push_that_makes_room(decision, perceived):
    result = judge(perceived(TARGET, NEIGHBOUR), decision(gi.PUSH), outcome(), perceived(TARGET, ASIDE))
    assert result.scene_changed
    assert result.target_visible
    assert result.border_decrease > 100
    assert not result.object_grasped
    message = result.message(decision(gi.PUSH), outcome(), 1)
    assert (message.step, message.command_id, message.status) == (2, 9, gi.COMPLETED)
    assert message.border_decrease == result.border_decrease


def test_a_scene_that_only_flickers_is_as_before(decision, perceived):
    before, after = perceived(TARGET), perceived(TARGET)
    after.maps.height[:] += 0.005
    after.maps.height[20:120, 50:52] += 0.03  # an edge, two cells wide
    after.maps.height[60:67, 100:107] += 0.03  # 49 cells
    assert not judge(before, decision(gi.PUSH), outcome(), after).scene_changed
    after.maps.height[67, 100:107] += 0.03  # 56
    assert judge(before, decision(gi.PUSH), outcome(), after).scene_changed


def test_a_target_that_shows_outside_the_workspace_alone_has_left_it(decision, perceived):
    there, hidden = perceived(TARGET), perceived()
    outside = np.zeros_like(hidden.patches)
    outside[:10, :10] = True  # as many pixels as a target must show
    gone = replace(hidden, patches=outside, target_beyond=True)
    result = judge(there, decision(gi.PUSH), outcome(), gone)
    assert result.target_left
    assert "outside the workspace" in result.detail
    for before, holding, after in (
        (hidden, False, gone),  # not that it had been in there
        (there, True, gone),  # something is held: what shows is not what was taken
        (there, False, hidden),
        (there, False, replace(gone, patches=outside & ~np.eye(len(outside), outside.shape[1], dtype=bool))),
        (there, False, replace(gone, target_beyond=False)),
        (there, False, replace(gone, hint=there.mask)),  # and a little shows within
        (replace(there, patches=there.patches | outside), False, gone),  # it had been there all the time
    ):
        assert not judge(before, decision(gi.GRASP), outcome(holding), after).target_left


def test_an_arm_that_did_not_start_changed_nothing(decision, perceived):
    unreachable = gi.MotionOutcome(command_id=9, status=gi.UNREACHABLE, detail="too far")
    assert not judge(perceived(TARGET), decision(gi.PUSH), unreachable, perceived()).scene_changed


@pytest.mark.parametrize(
    ("before", "after", "story"),
    [
        ([ASIDE], [TARGET], "came to light"),
        ([TARGET], [ASIDE], "out of sight"),
        ([ASIDE], [ASIDE], "still hidden"),
    ],
)
def test_the_story_names_what_became_of_the_target(decision, perceived, before, after, story):
    result = judge(perceived(*before), decision(gi.PUSH), outcome(), perceived(*after))
    assert story in result.detail
    assert result.detail.startswith("done")


class TestMemory:
    @pytest.fixture
    def unchanged(self, decision, perceived):
        return judge(perceived(ASIDE), decision(gi.PUSH), outcome(), perceived(ASIDE))

    @pytest.fixture
    def changed(self, unchanged):
        return replace(unchanged, scene_changed=True)

    @pytest.fixture
    def remember(self, perceived):
        """Of a scene in which nothing of the target shows."""
        before = perceived(ASIDE)

        def of(memory, decision, judgement, came=None):
            return judge_remember(memory, before, decision, came or outcome(), judgement)

        return of

    def test_explorational_pushes_that_found_nothing_are_remembered_three_deep(self, decision, remember, changed):
        memory = Memory()
        for x in (0.41, 0.42, 0.43, 0.44):
            memory = remember(memory, decision(gi.PUSH, x, policy="explorer"), changed)
        acted = acts_at(0.42, 0.0, 0.0), acts_at(0.43, 0.0, 0.0), acts_at(0.44, 0.0, 0.0)
        assert memory.failed_pushes == acted
        assert memory.step == 4

    def test_explorational_pushes_that_changed_nothing_did_not_search(self, decision, remember, unchanged):
        assert remember(Memory(), decision(gi.PUSH, policy="explorer"), unchanged).failed_pushes == ()

    def test_pushes_that_found_the_target_and_those_of_the_coordinator_are_not(self, decision, remember, changed):
        found = replace(changed, target_visible=True)
        assert remember(Memory(), decision(gi.PUSH, policy="explorer"), found).failed_pushes == ()
        assert remember(Memory(), decision(gi.PUSH), changed).failed_pushes == ()

    def test_failed_pushes_are_forgotten_once_the_target_is_seen(self, decision, perceived, remember, changed):
        """They were made elsewhere, should it go out of sight again."""
        failed = Memory(failed_pushes=((0.4, 0.0), (0.42, 0.0), (0.44, 0.0)))
        found = replace(changed, target_visible=True)
        assert remember(failed, decision(gi.PUSH, policy="explorer"), found).failed_pushes == ()
        hidden_again = judge_remember(failed, perceived(TARGET), decision(gi.PUSH), outcome(), changed)
        assert hidden_again.failed_pushes == ()

    def test_a_push_that_was_stopped_on_its_way_down_has_done_nothing(self, decision, perceived, changed):
        """Whatever the hand touched."""
        before, push = perceived(TARGET), decision(gi.PUSH, 0.5, 0.1, policy="explorer")
        stopped = gi.MotionOutcome(status=gi.BLOCKED, path_fraction=0.0)
        memory = Memory(consecutive_grasp_failures=2, last_seen=((0.6, 0.1),))
        then = judge_remember(memory, before, push, stopped, changed)
        assert (then.failed_pushes, then.consecutive_grasp_failures, then.last_seen) == ((), 2, memory.last_seen)
        assert [action.unchanged for action in then.fruitless] == [True]
        on_its_way = gi.MotionOutcome(status=gi.BLOCKED, path_fraction=0.4)
        assert not judge_remember(memory, before, push, on_its_way, changed).fruitless[0].unchanged

    def test_doubt_in_a_push_ends_with_the_scene_that_it_left_as_it_was(self, decision, remember, unchanged, changed):
        memory = remember(Memory(), decision(gi.PUSH, 0.41), unchanged)
        memory = remember(memory, decision(gi.PUSH, 0.45), changed)
        assert [(action.x, action.unchanged) for action in memory.fruitless] == [(0.41, False), (0.45, False)]

    def test_grasp_failures_count_until_success_or_change(self, decision, remember, unchanged, changed):
        twice = remember(remember(Memory(), decision(gi.GRASP), changed), decision(gi.GRASP), unchanged)
        assert twice.consecutive_grasp_failures == 2
        assert remember(twice, decision(gi.PUSH), unchanged).consecutive_grasp_failures == 2
        assert remember(twice, decision(gi.PUSH), changed).consecutive_grasp_failures == 0
        success = replace(changed, target_grasped=True)
        assert remember(twice, decision(gi.GRASP), success).consecutive_grasp_failures == 0

    def test_fruitless_actions_are_kept_until_the_scene_changes(self, decision, remember, unchanged, changed):
        memory = Memory()
        for _ in range(10):
            memory = remember(memory, decision(gi.PUSH), unchanged)
        assert len(memory.fruitless) == 8
        assert (memory.fruitless[-1].x, memory.fruitless[-1].kind) == (0.5, gi.PUSH)
        assert all(action.unchanged for action in memory.fruitless)
        assert remember(memory, decision(gi.GRASP), changed).fruitless == ()

    def test_a_push_is_not_repeated_before_some_others(self, decision, remember, unchanged, changed):
        memory = remember(Memory(), decision(gi.GRASP), unchanged)
        for x in (0.41, 0.42, 0.43, 0.44):
            memory = remember(memory, decision(gi.PUSH, x), changed)
        assert [(action.kind, action.x) for action in memory.fruitless] == [(gi.PUSH, x) for x in (0.42, 0.43, 0.44)]
        assert not any(action.unchanged for action in memory.fruitless)

    def test_the_place_of_a_target_that_was_seen_is_remembered_once_something_moved(
        self, decision, perceived, unchanged, changed
    ):
        seen, push = perceived(TARGET), decision(gi.PUSH, 0.5, 0.1)
        assert judge_remember(Memory(), seen, push, outcome(), unchanged).last_seen == ()
        ((x, y),) = judge_remember(Memory(), seen, push, outcome(), changed).last_seen
        assert (x, y) == pytest.approx(TARGET[:2], abs=0.003)
