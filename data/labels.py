"""What a logged motion teaches, for every goal that it could have been made for (paper, sections V-B and VI-B).

Each motion has labels for its run's target, and for other colours too (hindsight): a grasp aimed at another colour, or
a push past it, teaches what it would have been worth had that colour been the target. Whether a colour gets a label
depends on where the motion was aimed and never on how it ended, so values stay unbiased.
"""

import math

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import (
    ACTION_CELLS,
    PUSH_LENGTH,
    ROTATIONS,
    feasible_grasps,
    heightmap_cell,
    rotation_angle,
)
from grasping_invisible.data.classes import CLASSES, TARGET_COLORS
from grasping_invisible.data.corrections import NOTHING, StepCorrection
from grasping_invisible.data.enum_value import value_name
from grasping_invisible.data.grasp_result import grasped_class, mostly_gone
from grasping_invisible.data.heightmap_message import HeightmapArrays
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.rewards import grasp_reward, push_passes, push_reward
from grasping_invisible.data.steps import LoggedStep
from grasping_invisible.data.target_border import target_border

# Every rule that a label comes from, and its version, which counts up when the rule or a number in it changes:
# border: o_b, r_b and n_b (`target_border`). reward: R_p and R_g (`rewards`). success: what a grasp took
# (`grasp_result`). hindsight: which other colours a motion teaches about. usable: which motions teach at all. reveal:
# whether a push of a search brought something to light.
# classifier: which grasps are examples for the classifier, and its features.
RULES: dict[str, int] = {
    "border": 1,
    "classifier": 1,
    "hindsight": 2,
    "reveal": 1,
    "reward": 1,
    "success": 2,
    "usable": 1,
}

FEWEST_CELLS = 12  # of a colour in view, for it to be a goal
REVEALED_CELLS = 16  # of a colour that was not in view before, for it to have come to light
NEAR_PUSH = 0.02  # metres beside a push within which it teaches about another colour

HUMAN, RULE, RUNTIME = "human", "rule", "runtime"  # where a value is from
_MADE = {gi.COMPLETED, gi.BLOCKED}


class GoalLabel(msgspec.Struct, frozen=True):
    """What the motion was worth had this colour been the target.

    `hindsight`: it was not. `aimed`: the motion is a grasp aimed at it. `success`: it was grasped, which ends the
    episode. `reward`: see `data.rewards`. `border_ratio`, `border_norm`: r_b and n_b before the motion.
    """

    goal: str
    hindsight: bool
    aimed: bool
    success: bool
    reward: float
    border_ratio: float
    border_norm: float


class ClassifierExample(msgspec.Struct, frozen=True):
    """A grasp aimed at the run's target: what the action classifier is asked with, and the right answer.

    `q_push`, `q_grasp` are those of the critic that decided then. `grasp`: it took the target.
    """

    q_push: float
    q_grasp: float
    border_ratio: float
    border_norm: float
    consecutive_grasp_failures: int
    grasp: bool


class GraspResult(msgspec.Struct, frozen=True):
    """What was grasped, and where that is known from. `color`: None where nothing was, or it is not known."""

    object_grasped: bool = False
    target_grasped: bool = False
    color: str | None = None
    source: str = RULE


class StepLabel(msgspec.Struct, frozen=True):
    """All labels of one step. `why_not`: why it teaches nothing, empty where it does; then there are no goals.

    `revealed`: whether a push, made while its run's target was hidden, brought any target colour to light that was
    hidden before; None for every other motion.
    """

    step: int
    why_not: str
    usable_source: str
    grasp: GraspResult
    goals: tuple[GoalLabel, ...] = ()
    classifier: ClassifierExample | None = None
    revealed: bool | None = None

    @property
    def source(self) -> str:
        """Where the label as a whole is from: a person, the runtime's own judgement, or rules alone."""
        sources = {self.usable_source, self.grasp.source}
        return next(source for source in (HUMAN, RUNTIME, RULE) if source in sources)


def label_step(
    step: LoggedStep, before: HeightmapArrays | None, after: HeightmapArrays | None, correction: StepCorrection
) -> StepLabel:
    """Label one step by today's rules and what people say of it.

    `before`, `after`: the step's heightmaps and the next step's, decoded; None where the log does not hold them.
    """
    number = step.decision.step
    why_not = _why_not(step, before, after)
    if why_not or step.start is None or before is None:
        return StepLabel(number, why_not, RULE, GraspResult())
    grasp = _grasp_result(step, step.start.target_color, before, after, correction)
    if correction.exclude:
        return StepLabel(number, "excluded by a person", HUMAN, grasp)
    goals = tuple(_goals(step.decision, step.start.target_color, before, after, grasp))
    source = RULE if correction.exclude is None else HUMAN
    revealed = _revealed(step, before, after)
    return StepLabel(number, "", source, grasp, goals, _classifier_example(step.decision, goals), revealed)


def _why_not(step: LoggedStep, before: HeightmapArrays | None, after: HeightmapArrays | None) -> str:
    decision, outcome = step.decision, step.outcome
    if step.start is None:
        return "the start of its run is not in the log"
    if step.start.target_color not in TARGET_COLORS:
        return f"the run's target {step.start.target_color!r} is none of the known colours"
    if before is None:
        return "its heightmaps are not in the log"
    if not _fits_the_grid(before) or (after is not None and not _alike(before, after)):
        return "its heightmaps are of another size than the action grid's"
    if decision.kind not in (gi.PUSH, gi.GRASP):
        return "it is neither a push nor a grasp"
    if decision.rotation >= ROTATIONS or decision.row >= ACTION_CELLS or decision.column >= ACTION_CELLS:
        return "its cell lies outside the action grid"
    if outcome is None:
        return "its outcome is not in the log"
    if outcome.status not in _MADE:
        return f"it ended {value_name(gi.MotionStatus, outcome.status).lower()}"
    if after is None and (decision.kind == gi.PUSH or step.result is None):
        return "what followed it is not in the log"
    return ""


def _fits_the_grid(maps: HeightmapArrays) -> bool:
    rows, columns = maps.labels.shape
    side = rows * maps.resolution  # of what is no workspace, nothing can be said
    return rows == columns and rows in range(ACTION_CELLS, 16 * ACTION_CELLS, ACTION_CELLS) and 0.05 < side < 5.0


def _alike(one: HeightmapArrays, other: HeightmapArrays) -> bool:
    geometry = ((maps.labels.shape, maps.resolution, maps.center) for maps in (one, other))
    return next(geometry) == next(geometry)


def _grasp_result(
    step: LoggedStep,
    target: str,
    before: HeightmapArrays,
    after: HeightmapArrays | None,
    correction: StepCorrection,
) -> GraspResult:
    """What was grasped; of what people say, the colour counts before the target, and that before whether anything."""
    decision = step.decision
    if decision.kind != gi.GRASP:
        return GraspResult()
    if correction.grasped_color is not None:
        color = correction.grasped_color
        return GraspResult(color != NOTHING, color == target, None if color == NOTHING else color, HUMAN)
    by_rule = _grasp_result_by_rule(step, target, before, after)
    if correction.target_grasped:
        return GraspResult(True, True, target, HUMAN)
    if correction.target_grasped is None and correction.object_grasped is None:
        return by_rule
    held = by_rule.object_grasped if correction.object_grasped is None else correction.object_grasped
    if not held:
        return GraspResult(False, False, None, HUMAN)
    if correction.target_grasped is None:
        # Where nobody looked afterwards, a person who says that something was held says nothing against its colour.
        taken = by_rule.color if after is None else _taken(decision, target, before, after)
        return GraspResult(True, taken == target, taken, HUMAN)
    return GraspResult(True, False, None if by_rule.color == target else by_rule.color, HUMAN)


def _grasp_result_by_rule(
    step: LoggedStep, target: str, before: HeightmapArrays, after: HeightmapArrays | None
) -> GraspResult:
    held = step.outcome is not None and step.outcome.holding
    if after is None and step.result is not None:  # nobody saw the scene again: the robot's own word
        taken = target if step.result.target_grasped else None
        return GraspResult(held, taken is not None, taken, RUNTIME)
    taken = _taken(step.decision, target, before, after) if held else None
    return GraspResult(held, taken == target, taken)


def _taken(decision: gi.Decision, target: str, before: HeightmapArrays, after: HeightmapArrays | None) -> str | None:
    """The colour of what the gripper holds: the target if the grasp was aimed at it and it is gone from sight."""
    if after is None:
        return None
    index = CLASSES.index(target)
    mask = before.labels == index
    if _aimed(decision, mask, before.resolution) and mostly_gone(mask, after.labels == index):
        return target
    other = grasped_class(before, after, decision.row, decision.column)
    return None if other is None or other >= len(CLASSES) or other == index else CLASSES[other]


def _goals(
    decision: gi.Decision, target: str, before: HeightmapArrays, after: HeightmapArrays | None, grasp: GraspResult
) -> list[GoalLabel]:
    labels = []
    # Of a grasp after which nobody looked, only the target is known to be held or not, unless a person knows more.
    known = grasp.color is not None or not grasp.object_grasped
    others_known = after is not None or (grasp.source == HUMAN and known)
    for color in TARGET_COLORS:
        mask = before.labels == CLASSES.index(color)
        if np.count_nonzero(mask) < FEWEST_CELLS:
            continue
        aimed = decision.kind == gi.GRASP and _aimed(decision, mask, before.resolution)
        if color != target and not (others_known and (aimed or _passes(decision, mask, before.resolution))):
            continue
        success = grasp.color == color
        border = target_border(before.height, mask, before.resolution)
        reward = _reward(decision, CLASSES.index(color), before, after, success)
        labels.append(GoalLabel(color, color != target, aimed, success, reward, border.ratio, border.norm))
    return labels


def _revealed(step: LoggedStep, before: HeightmapArrays, after: HeightmapArrays | None) -> bool | None:
    assert step.start is not None
    cells_before, cells_after = (
        np.bincount(maps.labels.ravel(), minlength=len(CLASSES))[: len(CLASSES)] for maps in (before, after or before)
    )
    hidden = cells_before < FEWEST_CELLS
    if step.decision.kind != gi.PUSH or after is None or not hidden[CLASSES.index(step.start.target_color)]:
        return None
    candidates = [CLASSES.index(color) for color in TARGET_COLORS]
    return bool((hidden & (cells_after >= REVEALED_CELLS))[candidates].any())


def _classifier_example(decision: gi.Decision, goals: tuple[GoalLabel, ...]) -> ClassifierExample | None:
    goal = next((goal for goal in goals if goal.aimed and not goal.hindsight), None)
    if goal is None:
        return None
    return ClassifierExample(
        q_push=decision.q_push,
        q_grasp=decision.q_grasp,
        border_ratio=goal.border_ratio,
        border_norm=goal.border_norm,
        consecutive_grasp_failures=decision.memory.consecutive_grasp_failures,
        grasp=goal.success,
    )


def _reward(
    decision: gi.Decision, goal: int, before: HeightmapArrays, after: HeightmapArrays | None, success: bool
) -> float:
    mask = before.labels == goal
    start = heightmap_cell(decision.row, decision.column, len(mask))
    if decision.kind == gi.GRASP or after is None:
        return grasp_reward(mask, *start, success)
    yaw = rotation_angle(decision.rotation)
    return push_reward(
        before.height, mask, after.height, after.labels == goal, start, yaw, PUSH_LENGTH, before.resolution
    )


def _aimed(decision: gi.Decision, mask: NDArray[np.bool_], resolution: float) -> bool:
    return bool(feasible_grasps(mask, resolution)[decision.rotation, decision.row, decision.column])


def _passes(decision: gi.Decision, mask: NDArray[np.bool_], resolution: float) -> bool:
    """Whether the motion is a push that comes near a colour, whose mask this is."""
    if decision.kind != gi.PUSH:
        return False
    reach = math.ceil(NEAR_PUSH / resolution)
    near = cv2.dilate(mask.astype(np.uint8), cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1,) * 2))
    start = heightmap_cell(decision.row, decision.column, len(mask))
    return push_passes(near > 0, start, rotation_angle(decision.rotation), PUSH_LENGTH / resolution)
