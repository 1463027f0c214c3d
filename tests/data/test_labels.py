import numpy as np
import pytest

from grasping_invisible.data.classes import CLASSES
from grasping_invisible.data.corrections import StepCorrection
from grasping_invisible.data.grasp_result import grasped_class
from grasping_invisible.data.heightmap_message import HeightmapArrays
from grasping_invisible.data.labels import RULES, GoalLabel, StepLabel, label_step
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.steps import LoggedStep

RED_AT, BLUE_AT = (56, 40), (56, 70)  # rows and columns of the action grid
NOTHING_SAID = StepCorrection()


def scene(*blocks: tuple[str, tuple[int, int]]) -> HeightmapArrays:
    """50 mm cubes of some colours, each around a cell of the action grid."""
    labels = np.zeros((224, 224), np.uint8)
    for name, (row, column) in blocks:
        labels[2 * row - 12 : 2 * row + 13, 2 * column - 12 : 2 * column + 13] = CLASSES.index(name)
    height = np.where(labels > 0, 0.05, 0.0).astype(np.float32)
    return HeightmapArrays(1, 0, np.zeros((224, 224, 3), np.uint8), height, labels, 0.002, (0.53, 0.0, 0.0))


BEFORE = scene(("red", RED_AT), ("blue", BLUE_AT))
NO_RED, NO_BLUE = scene(("blue", BLUE_AT)), scene(("red", RED_AT))


def motion(
    kind: gi.MotionKind, row: int, column: int, rotation: int = 0, held: bool = False, target: str = "red"
) -> LoggedStep:
    return LoggedStep(
        decision=gi.Decision(step=4, kind=kind, row=row, column=column, rotation=rotation, q_push=0.3, q_grasp=0.6),
        start=gi.RunStart(target_color=target),
        outcome=gi.MotionOutcome(status=gi.COMPLETED, holding=held),
        result=gi.StepResult(object_grasped=held),
    )


def label(
    step: LoggedStep,
    after: HeightmapArrays | None,
    said: StepCorrection = NOTHING_SAID,
    before: HeightmapArrays | None = BEFORE,
) -> StepLabel:
    return label_step(step, before, after, said)


def goals(found: StepLabel) -> dict[str, GoalLabel]:
    return {goal.goal: goal for goal in found.goals}


def test_a_grasped_target_is_a_success() -> None:
    found = label(motion(gi.GRASP, *RED_AT, held=True), NO_RED)
    assert (found.grasp.target_grasped, found.grasp.color, found.source) == (True, "red", "rule")
    assert list(goals(found)) == ["red"]
    red = goals(found)["red"]
    assert (red.reward, red.success, red.hindsight, red.aimed) == (1.0, True, False, True)
    assert found.classifier is not None
    assert (found.classifier.grasp, found.classifier.q_push, found.classifier.q_grasp) == (True, 0.3, 0.6)
    assert (found.classifier.border_ratio, found.classifier.border_norm) == (red.border_ratio, red.border_norm)


def test_nothing_is_made_up_about_other_colours_where_nobody_looked_again() -> None:
    lifted = motion(gi.GRASP, *BLUE_AT, held=True)
    assert list(goals(label(lifted, NO_BLUE))) == ["red", "blue"]
    assert list(goals(label(lifted, None))) == ["red"]
    told = goals(label(lifted, None, StepCorrection(grasped_color="blue")))
    assert {name: goal.success for name, goal in told.items()} == {"red": False, "blue": True}


def test_a_failed_grasp_of_the_target_earns_its_aim() -> None:
    found = label(motion(gi.GRASP, *RED_AT), BEFORE)
    assert (goals(found)["red"].reward, goals(found)["red"].success) == (0.5, False)
    assert found.classifier is not None
    assert not found.classifier.grasp


def test_grasping_something_else_is_a_success_in_hindsight() -> None:
    found = label(motion(gi.GRASP, *BLUE_AT, held=True), NO_BLUE)
    assert (found.grasp.object_grasped, found.grasp.target_grasped, found.grasp.color) == (True, False, "blue")
    assert set(goals(found)) == {"red", "blue"}
    assert goals(found)["red"].reward == 0.0
    blue = goals(found)["blue"]
    assert (blue.reward, blue.success, blue.hindsight) == (1.0, True, True)
    assert found.classifier is None


def test_what_was_held_must_have_vanished() -> None:
    """Something was held, but the blue block is where it was: it was another one."""
    found = label(motion(gi.GRASP, *BLUE_AT, held=True), BEFORE)
    assert (goals(found)["blue"].reward, goals(found)["blue"].success) == (0.5, False)


@pytest.mark.parametrize(
    ("row", "column", "rewards"),
    [
        (56, 20, {"red": 0.25}),  # to the right, into red
        (56, 48, {"red": 0.0, "blue": 0.25}),  # between them, to the right, into blue
        (20, 20, {"red": 0.0}),  # past both
    ],
)
def test_pushes_teach_about_what_they_pass(row: int, column: int, rewards: dict[str, float]) -> None:
    found = goals(label(motion(gi.PUSH, row, column), BEFORE))
    assert {color: goal.reward for color, goal in found.items()} == rewards


def test_a_push_that_frees_the_target_earns_more() -> None:
    crowded = scene(("red", RED_AT), ("blue", (56, 53)))
    freed = scene(("red", RED_AT), ("blue", (90, 90)))
    found = goals(label(motion(gi.PUSH, 56, 30), freed, before=crowded))
    assert found["red"].reward == 0.5
    assert found["red"].border_ratio > 0


def test_what_was_grasped_at_the_very_edge_is_known() -> None:
    before = scene()
    before.labels[:13, :13] = CLASSES.index("blue")
    assert grasped_class(before, scene(), 0, 0) == CLASSES.index("blue")


@pytest.mark.parametrize("status", [gi.UNREACHABLE, gi.STOPPED, gi.FAULT])
def test_a_motion_that_was_not_made_teaches_nothing(status: gi.MotionStatus) -> None:
    step = motion(gi.PUSH, 56, 20)
    assert step.outcome is not None
    step.outcome.status = status
    found = label(step, BEFORE)
    assert found.goals == ()
    assert found.why_not == f"it ended {gi.MotionStatus.Name(status).lower()}"


def test_why_a_step_teaches_nothing_is_said() -> None:
    push, plane = motion(gi.PUSH, 56, 20), np.zeros((24, 24), np.uint8)
    small = HeightmapArrays(
        1, 0, np.zeros((24, 24, 3), np.uint8), plane.astype(np.float32), plane, 0.002, (0.5, 0.0, 0.0)
    )
    assert "no" not in label(push, BEFORE).why_not
    assert "followed" in label(push, None).why_not
    assert "heightmaps are not" in label(push, BEFORE, before=None).why_not
    assert "another size" in label(push, small, before=small).why_not
    assert "another size" in label(push, small).why_not
    assert "outside the action grid" in label(motion(gi.PUSH, 112, 0), BEFORE).why_not
    assert "outside the action grid" in label(motion(gi.GRASP, 0, 0, rotation=16), BEFORE).why_not
    assert "neither" in label(motion(gi.HOME, 0, 0), BEFORE).why_not
    assert "'pink'" in label(motion(gi.PUSH, 56, 20, target="pink"), BEFORE).why_not
    assert "outcome" in label(LoggedStep(push.decision, push.start), BEFORE).why_not
    assert "start" in label(LoggedStep(push.decision), BEFORE).why_not


def test_of_a_grasp_after_which_nothing_was_seen_the_runtime_knows() -> None:
    step = motion(gi.GRASP, *RED_AT, held=True)
    assert step.result is not None
    step.result.target_grasped = True
    found = label(step, None)
    assert (found.source, found.grasp.target_grasped, goals(found)["red"].reward) == ("runtime", True, 1.0)


def test_of_a_grasp_after_which_nothing_was_seen_nobody_knows_what_else_it_took() -> None:
    assert set(goals(label(motion(gi.GRASP, *BLUE_AT, held=True), None))) == {"red"}


@pytest.mark.parametrize(
    ("said", "held", "after", "rewards"),
    [
        # The rules saw the target vanish, but it was knocked away.
        (StepCorrection(target_grasped=False), True, NO_RED, {"red": 0.5}),
        (StepCorrection(object_grasped=False), True, NO_RED, {"red": 0.5}),
        (StepCorrection(grasped_color="grey"), True, NO_RED, {"red": 0.5}),
        # The gripper's sensor missed what it held.
        (StepCorrection(target_grasped=True), False, BEFORE, {"red": 1.0}),
        (StepCorrection(object_grasped=True), False, NO_RED, {"red": 1.0}),
        (StepCorrection(grasped_color="red"), False, BEFORE, {"red": 1.0}),
        # The colour says more than the rest.
        (StepCorrection(target_grasped=True, grasped_color="nothing"), True, NO_RED, {"red": 0.5}),
    ],
)
def test_people_override_rules_and_all_that_follows(
    said: StepCorrection, held: bool, after: HeightmapArrays, rewards: dict[str, float]
) -> None:
    found = label(motion(gi.GRASP, *RED_AT, held=held), after, said)
    assert found.source == "human"
    assert {color: goal.reward for color, goal in goals(found).items()} == rewards
    assert found.classifier is not None
    assert found.classifier.grasp == (rewards["red"] == 1.0) == found.grasp.target_grasped


def test_hindsight_follows_what_people_say() -> None:
    grasp = motion(gi.GRASP, *BLUE_AT, held=True)
    assert goals(label(grasp, NO_BLUE))["blue"].success
    assert not goals(label(grasp, NO_BLUE, StepCorrection(grasped_color="grey")))["blue"].success
    assert goals(label(grasp, BEFORE, StepCorrection(grasped_color="blue")))["blue"].success


@pytest.mark.parametrize(
    ("said", "taken", "known"),
    [
        (NOTHING_SAID, True, ["red"]),
        (StepCorrection(object_grasped=True), True, ["blue", "red"]),
        (StepCorrection(target_grasped=False), False, ["red"]),  # what else was held is not said
        (StepCorrection(object_grasped=False), False, ["blue", "red"]),
    ],
)
def test_a_person_speaks_of_a_grasp_after_which_nobody_looked(
    said: StepCorrection, taken: bool, known: list[str]
) -> None:
    before = scene(("red", RED_AT), ("blue", (RED_AT[0], RED_AT[1] + 8)))
    grasp = motion(gi.GRASP, RED_AT[0], RED_AT[1] + 4, held=True)
    assert grasp.result is not None
    grasp.result.target_grasped = True
    found = label(grasp, None, said, before=before)
    assert (found.grasp.target_grasped, goals(found)["red"].success) == (taken, taken)
    assert sorted(goals(found)) == known
    assert "blue" not in goals(found) or not goals(found)["blue"].success


def test_an_excluded_step_teaches_nothing() -> None:
    found = label(motion(gi.GRASP, *RED_AT), BEFORE, StepCorrection(exclude=True))
    assert (found.goals, found.classifier, found.source) == ((), None, "human")
    assert "excluded" in found.why_not
    assert label(motion(gi.GRASP, *RED_AT), BEFORE, StepCorrection(exclude=False)).goals


def test_a_correction_makes_no_unusable_step_usable() -> None:
    assert label(motion(gi.GRASP, *RED_AT), BEFORE, StepCorrection(target_grasped=True), before=None).goals == ()


HIDDEN = scene(("blue", BLUE_AT))  # and red nowhere


@pytest.mark.parametrize(
    ("before", "after", "kind", "revealed"),
    [
        (HIDDEN, BEFORE, gi.PUSH, True),
        (HIDDEN, HIDDEN, gi.PUSH, False),
        (HIDDEN, scene(("blue", BLUE_AT), ("green", RED_AT)), gi.PUSH, True),  # it might have been the target
        (HIDDEN, scene(), gi.PUSH, False),
        (BEFORE, BEFORE, gi.PUSH, None),  # no search
        (HIDDEN, BEFORE, gi.GRASP, None),
        (HIDDEN, None, gi.PUSH, None),
    ],
)
def test_a_push_of_a_search_reveals_something_or_nothing(
    before: HeightmapArrays, after: HeightmapArrays | None, kind: gi.MotionKind, revealed: bool | None
) -> None:
    assert label(motion(kind, *RED_AT), after, before=before).revealed is revealed


def test_every_rule_has_a_version() -> None:
    assert set(RULES) == {"border", "classifier", "hindsight", "reveal", "reward", "success", "usable"}
    assert all(version >= 1 for version in RULES.values())
