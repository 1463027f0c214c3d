"""What the critic learns from: state, executed action, reward, next state, for a goal."""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import LOW
from grasping_invisible.data.classes import CLASSES
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.rewards import PUSH_FREED
from grasping_invisible.data.target_border import GROUND_HEIGHT
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.workspace import Workspace
from grasping_invisible.training.packed_maps import PackedMaps

# As a goal: whatever is moved or grasped counts, as for VPG (paper, section II). Its rewards are half of VPG's 1 and
# 0.5: a grasp is no end there and looks ahead like a push, which returns up to 2, and our Q values are bounded by 1.
ANY_OBJECT = 0
# As a goal: whatever is hidden. A push of a search is worth whether a candidate comes to light by it.
HIDDEN = -1
OBJECT_GRASPED, SCENE_CHANGED = 0.5, 0.25
# Of states and goals, (id of the state, goal), for which grasps were tried: whether one of them took the goal.
GraspsTried = dict[tuple[int, int], bool]
_KINDS = {"push": gi.PUSH, "grasp": gi.GRASP}


@dataclass(frozen=True)
class Transition:
    """One action and what it was worth for one goal; see `data.labels` for how that is known.

    `seen`: the state before. `goal`: class index of the target, `ANY_OBJECT` or `HIDDEN`. `row`, `column`: on the
    action grid. `reward`: the paper's. `success`: the goal was grasped or came to light, which ends the episode.
    `then`: the state that followed, None at an end. `hindsight`: the goal was not what the robot was after. `aimed`: it
    is a grasp aimed at the goal. `run`: which run it is from. `consecutive_grasp_failures`: c_g when it was decided on.
    `level`: of a push, `LOW` or `RAISED`.
    """

    seen: PackedMaps
    goal: int
    kind: gi.MotionKind
    rotation: int
    row: int
    column: int
    reward: float
    success: bool
    then: PackedMaps | None
    hindsight: bool
    aimed: bool
    run: str
    consecutive_grasp_failures: int
    level: int = LOW

    @property
    def looks_ahead(self) -> bool:
        """Whether the value of what followed counts.

        It does for pushes. A failed grasp mostly leaves the scene as it was: were the next state's value added to what
        it earns for its aim, failing would be worth as much as succeeding, and the critic could not tell them apart.
        Nor does a push of a search: what it did not bring to light may lie anywhere, so the next one is worth as much.
        """
        for_what_is_seen = self.kind == gi.PUSH and self.goal != HIDDEN
        return self.then is not None and (for_what_is_seen or self.goal == ANY_OBJECT)

    def before(self) -> tuple[Heightmaps, NDArray[np.bool_]]:
        """The state before the action, and the goal's mask in it, (N, N)."""
        maps = self.seen.unpack()
        return maps, goal_mask(maps, self.goal)


def goal_mask(maps: Heightmaps, goal: int) -> NDArray[np.bool_]:
    """The mask that a critic is asked with for a goal, (N, N): its cells, or ones for any object."""
    return np.ones_like(maps.labels, np.bool_) if goal in (ANY_OBJECT, HIDDEN) else maps.labels == goal


def goal_cells(maps: Heightmaps, goal: int) -> NDArray[np.bool_]:
    """Where a goal is, (N, N); any object, and what is hidden, is where something stands."""
    return maps.height > GROUND_HEIGHT if goal in (ANY_OBJECT, HIDDEN) else maps.labels == goal


def grasps_tried(transitions: Sequence[Transition]) -> GraspsTried:
    """What came of the grasps that were aimed at a goal."""
    taken: GraspsTried = {}
    for transition in transitions:
        if transition.aimed:
            key = id(transition.seen), transition.goal
            taken[key] = taken.get(key, False) or transition.success
    return taken


class TransitionReader:
    """Makes transitions of a dataset's rows; each state is kept once, however many motions began or ended with it."""

    def __init__(self) -> None:
        self._states: dict[bytes, PackedMaps] = {}

    def of(self, row: dict[str, Any]) -> Iterator[Transition]:
        """What a row teaches, for the run's target, for others, and for whatever is hidden."""
        for goal in row["goals"]:
            yield self._transition(
                row,
                goal=CLASSES.index(goal["goal"]),
                reward=goal["reward"],
                success=goal["success"],
                hindsight=goal["hindsight"],
                aimed=goal["aimed"],
            )
        if row["revealed"] is not None:
            reward = PUSH_FREED if row["revealed"] else 0.0
            yield self._transition(row, goal=HIDDEN, reward=reward, success=row["revealed"])

    def of_any_object(self, row: dict[str, Any]) -> Iterator[Transition]:
        """What a row teaches where any object counts; what follows counts where something was held or moved.

        Nobody looks after a grasp while branching: the state before it, but for the object, stands for what follows,
        or any push would be worth as much as a grasp that holds.
        """
        if not row["usable"] or row["scene_changed"] is None:
            return
        held = bool(row["object_grasped"])
        moved = row["kind"] == "push" and row["scene_changed"]
        reward = OBJECT_GRASPED if held else SCENE_CHANGED if moved else 0.0
        transition = self._transition(row, ANY_OBJECT, reward, success=held, aimed=row["kind"] == "grasp")
        after = self._state(row, "after") or (self._state(row, "before") if held else None)
        yield replace(transition, then=after if held or moved else None)

    def _transition(
        self, row: dict[str, Any], goal: int, reward: float, success: bool, hindsight: bool = False, aimed: bool = False
    ) -> Transition:
        seen = self._state(row, "before")
        assert seen is not None  # every row has what was seen before
        return Transition(
            seen=seen,
            goal=goal,
            kind=_KINDS[row["kind"]],
            rotation=row["rotation"],
            row=row["row"],
            column=row["column"],
            level=row["push_level"],
            reward=reward,
            success=success,
            then=None if success else self._state(row, "after"),
            hindsight=hindsight,
            aimed=aimed,
            run=row["run_id"],
            consecutive_grasp_failures=row["consecutive_grasp_failures"],
        )

    def _state(self, row: dict[str, Any], when: str) -> PackedMaps | None:
        stamp_ns = row["frame_stamp_ns" if when == "before" else "after_stamp_ns"]
        if stamp_ns is None:
            return None
        images = [row[f"{when}_{what}"] for what in ("color", "height", "labels")]
        content = hashlib.blake2b(b"".join(images), digest_size=16).digest()
        if content not in self._states:
            center = row["center_x"], row["center_y"], row["center_z"]
            workspace = Workspace(center, row["resolution"] * row["cells"], row["resolution"])
            color, height, labels = images
            self._states[content] = PackedMaps(stamp_ns, color, height, labels, workspace)
        return self._states[content]
