"""What went wrong with single motions for the target, by rules, from a log and its ground truth."""

import math
from enum import Enum

import numpy as np

from grasping_invisible.data.classes import CLASSES
from grasping_invisible.data.heightmap_message import decode_heightmaps
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.rewards import is_freed
from grasping_invisible.data.run_names import COORDINATOR
from grasping_invisible.data.steps import LoggedStep
from grasping_invisible.data.target_border import target_border
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.perception import MIN_TARGET_CELLS, MIN_TARGET_PIXELS
from grasping_invisible.runtime.workspace import Workspace
from grasping_invisible.training.free_sides import has_free_sides

SLIPPED_BY = 0.02  # metres that a target must have moved for a grasp to have had hold of it
MOVED_BY = 0.005  # metres that a target must have moved to have been pushed


class Fault(Enum):
    """What was wrong with a motion for the target, in words."""

    UNREACHABLE = "the arm could not reach"
    BLOCKED = "a grasp's fingers met a neighbour"
    BESIDE = "a grasp closed beside the target"
    SLIPPED = "the target slipped out of the fingers"
    OTHER = "something else was grasped"
    NO_EFFECT = "a push moved nothing"
    HID = "a push hid the target"
    NEEDLESS = "a push where a grasp had room"
    GROUP = "a push moved the target together with its neighbours"
    MISSED = "a push moved others and freed nothing"


def fault_of(step: LoggedStep) -> Fault | None:
    """What was wrong with a motion; None where it did its part, or where the log does not tell."""
    outcome, result = step.outcome, step.result
    if outcome is None or result is None or result.target_grasped:
        return None
    if outcome.status == gi.UNREACHABLE:
        return Fault.UNREACHABLE
    return _grasp_fault(step, outcome) if step.decision.kind == gi.GRASP else _push_fault(step, result)


def saw_target(step: LoggedStep) -> bool:
    """Whether the runtime saw the target when it decided."""
    if step.decision.policy == COORDINATOR or step.heightmaps is None or step.start is None:
        return step.decision.policy == COORDINATOR
    labels = decode_heightmaps(step.heightmaps).labels
    cells = np.count_nonzero(labels == CLASSES.index(step.start.target_color))
    return bool(step.decision.target_pixels >= MIN_TARGET_PIXELS and cells >= MIN_TARGET_CELLS)


def truly_visible(step: LoggedStep) -> int | None:
    """How many pixels of the target the camera image truly shows before a motion; None without ground truth."""
    if step.truth is None or step.start is None:
        return None
    return sum(item.visible_pixels for item in targets(step.truth, step.start))


def targets(truth: gi.TruthState, start: gi.RunStart) -> list[gi.ObjectTruth]:
    """The objects of the colour that a run is after, whatever its scene is made for."""
    return [item for item in truth.objects if item.color == start.target_color]


def maps_of(message: gi.Heightmaps) -> Heightmaps:
    """Logged heightmaps as the runtime had them."""
    maps = decode_heightmaps(message)
    workspace = Workspace(maps.center, maps.resolution * message.rows, maps.resolution)
    return Heightmaps(maps.stamp_ns, maps.color, maps.height, maps.labels, workspace)


def _grasp_fault(step: LoggedStep, outcome: gi.MotionOutcome) -> Fault:
    if outcome.holding:
        return Fault.OTHER
    if outcome.status == gi.BLOCKED:
        return Fault.BLOCKED
    moved = _moved(step)
    return Fault.SLIPPED if moved is not None and moved > SLIPPED_BY else Fault.BESIDE


def _push_fault(step: LoggedStep, result: gi.StepResult) -> Fault | None:
    if not result.scene_changed:
        return Fault.NO_EFFECT
    if not saw_target(step):
        return None  # an exploration is judged by the whole of it
    if not result.target_visible:
        return Fault.HID
    if _had_room(step):
        return Fault.NEEDLESS
    if step.heightmaps is None or step.next_heightmaps is None or _freed(step, step.heightmaps, step.next_heightmaps):
        return None
    moved = _moved(step)
    return Fault.MISSED if moved is not None and moved < MOVED_BY else Fault.GROUP


def _had_room(step: LoggedStep) -> bool:
    if step.heightmaps is None or step.start is None:
        return False
    maps = maps_of(step.heightmaps)
    return has_free_sides(maps, maps.labels == CLASSES.index(step.start.target_color))


def _freed(step: LoggedStep, before: gi.Heightmaps, after: gi.Heightmaps) -> bool:
    """Whether so much of the border became free as earns a push its reward."""
    assert step.start is not None  # or the target was not seen
    index = CLASSES.index(step.start.target_color)
    one, other = (
        target_border(maps.height, maps.labels == index, maps.resolution)
        for maps in (decode_heightmaps(before), decode_heightmaps(after))
    )
    return is_freed(one, other, before.resolution)


def _moved(step: LoggedStep) -> float | None:
    """By how many metres the target moved, the one of several that moved most; None without ground truth."""
    if step.truth is None or step.next_truth is None or step.start is None:
        return None
    before = {item.name: _position(item) for item in targets(step.truth, step.start)}
    after = {item.name: _position(item) for item in targets(step.next_truth, step.start)}
    distances = [math.dist(before[name], after[name]) for name in before.keys() & after.keys()]
    return float(np.max(distances, initial=0.0))


def _position(item: gi.ObjectTruth) -> tuple[float, float, float]:
    return item.position.x, item.position.y, item.position.z
