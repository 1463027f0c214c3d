"""What came of a motion, from what the runtime can see, and what of it to remember."""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from grasping_invisible.data.action_grid import feasible_grasps
from grasping_invisible.data.clock import to_timestamp
from grasping_invisible.data.grasp_result import mostly_gone
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.rewards import freed_cells
from grasping_invisible.data.run_names import EXPLORER
from grasping_invisible.runtime.decision_record import Decision
from grasping_invisible.runtime.failures import REMEMBERED, acts_at
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.last_seen import last_seen_after
from grasping_invisible.runtime.memory import FRUITLESS_REMEMBERED, PUSHES_REMEMBERED, FruitlessAction, Memory
from grasping_invisible.runtime.perception import MIN_TARGET_PIXELS, Perception

HEIGHT_NOISE = 0.008  # metres; a cell that differs by more has changed
# Cells, 6 mm: only changes at least so wide count. At the edges of blocks and of what is hidden behind them single
# cells flicker from frame to frame, hundreds of them in a heap.
CHANGED_WIDTH = 3
CHANGED_AREA = 2.0e-4  # square metres of such changes: a 50 mm block that moved by 6 mm makes 3e-4 on each side


@dataclass(frozen=True)
class Judgement:
    """The facts of `gi.StepResult`. `border_decrease`: of o_b, in heightmap cells. `target_left`: see that function."""

    scene_changed: bool
    target_visible: bool
    object_grasped: bool
    target_grasped: bool
    target_left: bool
    border_decrease: float
    detail: str

    def message(self, decision: Decision, outcome: gi.MotionOutcome, stamp_ns: int) -> gi.StepResult:
        """The judgement as it is logged."""
        return gi.StepResult(
            stamp=to_timestamp(stamp_ns),
            step=decision.step,
            command_id=outcome.command_id,
            status=outcome.status,
            scene_changed=self.scene_changed,
            target_visible=self.target_visible,
            object_grasped=self.object_grasped,
            target_grasped=self.target_grasped,
            border_decrease=self.border_decrease,
            detail=self.detail,
        )


def judge(before: Perception, decision: Decision, outcome: gi.MotionOutcome, after: Perception) -> Judgement:
    """Compare what was seen before and after a motion.

    The target counts as grasped when a grasp aimed at it ended with something in the gripper and the target's
    heightmap cells are mostly gone.
    """
    held = decision.kind == gi.GRASP and outcome.holding
    resolution = before.maps.workspace.resolution
    aimed = bool(feasible_grasps(before.mask, resolution)[decision.rotation, decision.row, decision.column])
    target_grasped = held and aimed and mostly_gone(before.mask, after.mask)
    left = not held and target_left(before, after)  # what is held may show in the image, outside the workspace
    changed = outcome.status != gi.UNREACHABLE and scene_changed(before.maps, after.maps)
    detail = ", ".join(
        filter(
            None,
            (
                outcome.detail,
                "the scene changed" if changed else "the scene is as before",
                _target_story(before, after, held, target_grasped, left),
            ),
        )
    )
    return Judgement(
        scene_changed=changed,
        target_visible=after.target_seen,
        object_grasped=held,
        target_grasped=target_grasped,
        target_left=left,
        border_decrease=freed_cells(before.maps.height, before.mask, after.maps.height, after.mask, resolution),
        detail=detail,
    )


def target_left(before: Perception, after: Perception) -> bool:
    """Whether the target was taken out of the workspace: it was found there, and now shows outside it alone.

    What shows outside must be new there: other things in its colour may lie around the workspace, and the target may
    be hidden again.
    """
    if not before.target_found or not after.target_beyond or after.hint.any():
        return False
    return int(np.count_nonzero(after.patches & ~before.patches)) >= MIN_TARGET_PIXELS


def scene_changed(before: Heightmaps, after: Heightmaps) -> bool:
    """Whether the height changed by more than `HEIGHT_NOISE` in patches of `CHANGED_WIDTH`, `CHANGED_AREA` in all."""
    changed = (np.abs(after.height - before.height) > HEIGHT_NOISE).astype(np.uint8)
    patches = cv2.morphologyEx(changed, cv2.MORPH_OPEN, np.ones((CHANGED_WIDTH, CHANGED_WIDTH), np.uint8))
    return bool(np.count_nonzero(patches) >= round(CHANGED_AREA / before.workspace.resolution**2))


def remember(
    memory: Memory, before: Perception, decision: Decision, outcome: gi.MotionOutcome, judgement: Judgement
) -> Memory:
    """The memory for the next decision. `before`: what the one just carried out was made from.

    A failed push is an explorational one that changed the scene, and the target is still not seen; once it is they are
    forgotten, as they were made to find it where it no longer is. Grasp failures count up until the target is grasped
    or a push changes the scene, for then they tell nothing about the new one. An action that changed nothing is not
    tried again until something changes, and a push not so soon after others: what lay in its way it has moved. A push
    that was stopped on its way down has done nothing of what it was for, whatever it touched.
    """
    x, y, _ = decision.position
    pushed = decision.kind == gi.PUSH
    changed = judgement.scene_changed and not (pushed and _never_began(outcome))
    failed_pushes = memory.failed_pushes
    if before.target_seen or judgement.target_visible:
        failed_pushes = ()
    elif changed and pushed and decision.policy == EXPLORER:
        failed_pushes = (*failed_pushes, acts_at(x, y, decision.yaw))[-REMEMBERED:]
    failures = memory.consecutive_grasp_failures
    if not pushed:
        failures = 0 if judgement.target_grasped else failures + 1
    elif changed:
        failures = 0
    made = FruitlessAction(decision.kind, x, y, decision.yaw, decision.level, not changed)
    if not changed:
        fruitless = (*memory.fruitless, made)[-FRUITLESS_REMEMBERED:]
    elif pushed:
        # Of another scene they say nothing more than that they were made.
        earlier = (replace(action, unchanged=False) for action in memory.fruitless if action.kind == gi.PUSH)
        fruitless = (*earlier, made)[-PUSHES_REMEMBERED:]
    else:
        fruitless = ()
    pushes = memory.consecutive_pushes + 1 if pushed else 0
    last_seen = last_seen_after(memory.last_seen, before, decision) if changed else memory.last_seen
    return Memory(failed_pushes, failures, memory.step + 1, fruitless, pushes, last_seen)


def _never_began(outcome: gi.MotionOutcome) -> bool:
    """Whether a push was stopped before its way along the table."""
    return outcome.status == gi.BLOCKED and outcome.path_fraction == 0.0


def _target_story(before: Perception, after: Perception, held: bool, target_grasped: bool, left: bool) -> str:
    if target_grasped:
        return "the target is in the gripper"
    if held:
        return "something else is in the gripper"
    if left:
        return "the target lies outside the workspace"
    if after.target_seen and not before.target_seen:
        return "the target came to light"
    if before.target_seen and not after.target_seen:
        return "the target is out of sight"
    return "the target is seen" if after.target_seen else "the target is still hidden"
