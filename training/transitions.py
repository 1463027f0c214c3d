"""What the critic learns from: state, executed action, reward, next state, for a goal."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
OBJECT_GRASPED, SCENE_CHANGED = 0.5, 0.25
_KINDS = {"push": gi.PUSH, "grasp": gi.GRASP}


@dataclass(frozen=True)
class Transition:
    """One action and what it was worth for one goal; see `data.labels` for how that is known.

    `seen`: the state before. `goal`: class index of the target, or `ANY_OBJECT`. `row`, `column`: on the action grid.
    `success`: the goal was grasped, which ends the episode. `then`: the state that followed, None at an end.
    `hindsight`: the goal was not what the robot was after. `aimed`: it is a grasp aimed at the goal. `run`: which run
    it is from. `consecutive_grasp_failures`: c_g when it was decided on.
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

    @property
    def looks_ahead(self) -> bool:
        """Whether the value of what followed counts.

        It does for pushes. A failed grasp mostly leaves the scene as it was: were the next state's value added to what
        it earns for its aim, failing would be worth as much as succeeding, and the critic could not tell them apart.
        """
        return self.then is not None and (self.kind == gi.PUSH or self.goal == ANY_OBJECT)

    @property
    def did_its_part(self) -> bool:
        """Whether a push freed its goal, or changed the scene where any object counts."""
        return self.reward >= (SCENE_CHANGED if self.goal == ANY_OBJECT else PUSH_FREED)

    def before(self) -> tuple[Heightmaps, NDArray[np.bool_]]:
        """The state before the action, and the goal's mask in it, (N, N)."""
        maps = self.seen.unpack()
        return maps, goal_mask(maps, self.goal)


def goal_mask(maps: Heightmaps, goal: int) -> NDArray[np.bool_]:
    """The mask that a critic is asked with for a goal, (N, N): its cells, or ones for any object."""
    return np.ones_like(maps.labels, np.bool_) if goal == ANY_OBJECT else maps.labels == goal


def goal_cells(maps: Heightmaps, goal: int) -> NDArray[np.bool_]:
    """Where a goal is, (N, N); any object is where something stands."""
    return maps.height > GROUND_HEIGHT if goal == ANY_OBJECT else maps.labels == goal


class TransitionReader:
    """Makes transitions of a dataset's rows; a frame that was after one motion and before the next is kept once."""

    def __init__(self) -> None:
        self._run: tuple[str, int] | None = None
        self._frames: dict[int, PackedMaps] = {}

    def of(self, row: dict[str, Any]) -> Iterator[Transition]:
        """What a row teaches, for the run's target and for others."""
        seen, then = self._seen_and_then(row)
        for goal in row["goals"]:
            assert seen is not None  # or there would be no goals
            yield Transition(
                seen=seen,
                goal=CLASSES.index(goal["goal"]),
                kind=_KINDS[row["kind"]],
                rotation=row["rotation"],
                row=row["row"],
                column=row["column"],
                reward=goal["reward"],
                success=goal["success"],
                then=None if goal["success"] else then,
                hindsight=goal["hindsight"],
                aimed=goal["aimed"],
                run=row["run_id"],
                consecutive_grasp_failures=row["consecutive_grasp_failures"],
            )

    def of_any_object(self, row: dict[str, Any]) -> Iterator[Transition]:
        """What a row teaches where any object counts; what follows counts where something was held or moved."""
        seen, then = self._seen_and_then(row)
        if not row["usable"] or row["scene_changed"] is None:
            return
        assert seen is not None  # or it would not be usable
        kind, held = _KINDS[row["kind"]], bool(row["object_grasped"])
        moved = kind == gi.PUSH and row["scene_changed"]
        yield Transition(
            seen=seen,
            goal=ANY_OBJECT,
            kind=kind,
            rotation=row["rotation"],
            row=row["row"],
            column=row["column"],
            reward=OBJECT_GRASPED if held else SCENE_CHANGED if moved else 0.0,
            success=held,
            then=then if held or moved else None,
            hindsight=False,
            aimed=kind == gi.GRASP,
            run=row["run_id"],
            consecutive_grasp_failures=row["consecutive_grasp_failures"],
        )

    def _seen_and_then(self, row: dict[str, Any]) -> tuple[PackedMaps | None, PackedMaps | None]:
        """The states before and after a row's motion."""
        run = row["run_id"], row["run_started_ns"]
        if run != self._run:
            self._run, self._frames = run, {}
        return self._frame(row, "before", row["frame_stamp_ns"]), self._frame(row, "after", row["after_stamp_ns"])

    def _frame(self, row: dict[str, Any], when: str, stamp_ns: int | None) -> PackedMaps | None:
        if stamp_ns is None:
            return None
        if stamp_ns not in self._frames:
            color, height, labels = (row[f"{when}_{what}"] for what in ("color", "height", "labels"))
            center = row["center_x"], row["center_y"], row["center_z"]
            workspace = Workspace(center, row["resolution"] * row["cells"], row["resolution"])
            self._frames[stamp_ns] = PackedMaps(stamp_ns, color, height, labels, workspace)
        return self._frames[stamp_ns]
