from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.run_names import OUTSIDE
from grasping_invisible.runtime.decision import DecisionSettings, Deliberation
from grasping_invisible.runtime.errors import RobotError
from grasping_invisible.runtime.frame import RgbdFrame
from grasping_invisible.runtime.loop import Goal, RunPlan, RunProgress, run_loop
from grasping_invisible.runtime.safety import SafetyLimits, UnsafeCommand

RED = DecisionSettings("red")


class Diary:
    """A watcher that writes down what it is told."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def perceived(self, frame: Any, perception: Any, step: int) -> None:
        self.lines.append(f"saw {step} {'target' if perception.target_seen else '-'}")

    def decided(self, frame: Any, deliberation: Deliberation) -> None:
        self.lines.append(f"decided {deliberation.decision.step} {deliberation.decision.policy}")

    def judged(self, deliberation: Deliberation, outcome: Any, judgement: Any) -> None:
        self.lines.append(f"judged {deliberation.decision.step} {judgement.target_grasped}")


def kinds(robot: Any) -> list[str]:
    return [gi.MotionKind.Name(command.kind) for command in robot.commands]


def test_finds_then_grasps_and_tells_its_watchers_in_order(table_robot: Any, color_models: Any) -> None:
    diary = Diary()
    progress = run_loop(table_robot, color_models, RED, RunPlan(), (diary,))
    assert (progress.grasped, progress.found, progress.motions) == (True, True, 2)
    assert kinds(table_robot) == ["HOME", "PUSH", "GRASP"]
    assert [command.id for command in table_robot.commands] == [1, 2, 3]
    assert len(progress.decision_ms) == 2
    assert diary.lines == [
        "saw 0 -",
        "decided 0 explorer",
        "judged 0 False",
        "saw 1 target",
        "decided 1 coordinator",
        "judged 1 True",
        "saw 2 -",
    ]


def test_same_seed_same_commands(table_robot: Any, color_models: Any) -> None:
    def commands(seed: int) -> list[tuple[float, float, float]]:
        robot = type(table_robot)()
        run_loop(robot, color_models, RED, RunPlan(seed=seed))
        return [(command.position.x, command.position.y, command.yaw) for command in robot.commands]

    assert commands(3) == commands(3)
    assert commands(3) != commands(4)  # the models' maps are flat: the seed breaks ties


def test_budget_ends_the_run(table_robot: Any, color_models: Any) -> None:
    table_robot.grasps_fail = 99
    progress = run_loop(table_robot, color_models, RED, RunPlan(max_motions=4))
    assert (progress.grasped, progress.found, progress.motions) == (False, True, 4)


def test_the_last_motion_is_known_as_such(table_robot: Any, color_models: Any) -> None:
    known: list[bool] = []

    class Notes(Diary):
        def decided(self, frame: Any, deliberation: Deliberation) -> None:
            known.append(deliberation.decision.memory.last_motion)

    table_robot.grasps_fail = 99
    run_loop(table_robot, color_models, RED, RunPlan(max_motions=3), (Notes(),))
    assert known == [False, False, True]


def test_a_search_ends_when_the_target_is_seen(table_robot: Any, color_models: Any) -> None:
    progress = run_loop(table_robot, color_models, RED, RunPlan(goal=Goal.FIND))
    assert (progress.found, progress.motions) == (True, 1)
    already = run_loop(table_robot, color_models, RED, RunPlan(goal=Goal.FIND))
    assert (already.found, already.motions) == (True, 0)


def test_a_target_that_leaves_the_workspace_ends_the_run(table_robot: Any, color_models: Any) -> None:
    table_robot.grasps_fail, table_robot.failed_grasps_knock_it_out = 1, True
    progress = run_loop(table_robot, color_models, RED, RunPlan())
    assert (progress.found, progress.grasped, progress.target_left, progress.motions) == (True, False, True, 2)
    assert progress.ended_because == OUTSIDE


def test_another_object_is_put_down_without_counting_as_a_motion(table_robot: Any, color_models: Any) -> None:
    table_robot.decoy_first = True
    progress = run_loop(table_robot, color_models, RED, RunPlan())
    assert kinds(table_robot) == ["HOME", "PUSH", "GRASP", "PLACE", "GRASP"]
    assert (progress.grasped, progress.motions) == (True, 3)


def test_what_is_held_at_the_start_is_put_down_first(table_robot: Any, color_models: Any) -> None:
    table_robot.holding = True
    run_loop(table_robot, color_models, RED, RunPlan())
    assert kinds(table_robot)[:2] == ["HOME", "PLACE"]


def test_what_cannot_be_put_down_ends_the_run(
    table_robot: Any, color_models: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    execute = table_robot.execute

    def keep_hold(command: gi.MotionCommand) -> gi.MotionOutcome:
        outcome = execute(command)
        outcome.holding = True
        return outcome

    monkeypatch.setattr(table_robot, "execute", keep_hold)
    with pytest.raises(RobotError, match="PLACE ended with something still in the gripper"):
        run_loop(table_robot, color_models, RED, RunPlan())


def test_a_camera_that_goes_blind_is_no_grasped_target(
    table_robot: Any, color_models: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    observe = table_robot.observe

    def blind_once_it_holds() -> RgbdFrame:
        frame = observe()
        return replace(frame, depth=np.zeros_like(frame.depth)) if table_robot.holding else frame

    monkeypatch.setattr(table_robot, "observe", blind_once_it_holds)
    progress = RunProgress()
    with pytest.raises(RobotError, match="the depth image shows 0% of the workspace"):
        run_loop(table_robot, color_models, RED, RunPlan(), progress=progress)
    assert not progress.grasped


@pytest.mark.parametrize("status", [gi.STOPPED, gi.FAULT, gi.BLOCKED, gi.UNREACHABLE])
def test_a_robot_that_does_not_come_home_ends_the_run(
    table_robot: Any, color_models: Any, status: gi.MotionStatus
) -> None:
    table_robot.status = status
    with pytest.raises(RobotError, match=r"HOME 1 .*done"):
        run_loop(table_robot, color_models, RED, RunPlan())


def test_nothing_unsafe_is_sent_and_progress_survives(table_robot: Any, color_models: Any) -> None:
    progress = RunProgress()
    plan = RunPlan(limits=SafetyLimits(min_height=0.2))
    with pytest.raises(UnsafeCommand, match="height"):
        run_loop(table_robot, color_models, RED, plan, progress=progress)
    assert kinds(table_robot) == ["HOME"]
    assert len(progress.decision_ms) == 1
