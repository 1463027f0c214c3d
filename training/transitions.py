"""What the critic learns from: state, executed action, reward, next state, for a goal."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.classes import CLASSES
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.workspace import Workspace
from grasping_invisible.training.packed_maps import PackedMaps

_KINDS = {"push": gi.PUSH, "grasp": gi.GRASP}


@dataclass(frozen=True)
class Transition:
    """One action and what it was worth for one goal; see `data.labels` for how that is known.

    `seen`: the state before. `goal`: class index of the target. `row`, `column`: on the action grid. `success`: the
    goal was grasped, which ends the episode. `then`: the state that followed, None at an end. `hindsight`: the goal
    was not what the robot was after. `aimed`: it is a grasp aimed at the goal. `run`: which run it is from.
    `consecutive_grasp_failures`: c_g when it was decided on.
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

    def before(self) -> tuple[Heightmaps, NDArray[np.bool_]]:
        """The state before the action, and the goal's cells in it, (N, N)."""
        maps = self.seen.unpack()
        return maps, maps.labels == self.goal


class TransitionReader:
    """Makes transitions of a dataset's rows; a frame that was after one motion and before the next is kept once."""

    def __init__(self) -> None:
        self._run: tuple[str, int] | None = None
        self._frames: dict[int, PackedMaps] = {}

    def of(self, row: dict[str, Any]) -> Iterator[Transition]:
        """What a row teaches, for the run's target and for others."""
        run = row["run_id"], row["run_started_ns"]
        if run != self._run:
            self._run, self._frames = run, {}
        seen, then = self._frame(row, "before", row["frame_stamp_ns"]), self._frame(row, "after", row["after_stamp_ns"])
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

    def _frame(self, row: dict[str, Any], when: str, stamp_ns: int | None) -> PackedMaps | None:
        if stamp_ns is None:
            return None
        if stamp_ns not in self._frames:
            color, height, labels = (row[f"{when}_{what}"] for what in ("color", "height", "labels"))
            center = row["center_x"], row["center_y"], row["center_z"]
            workspace = Workspace(center, row["resolution"] * row["cells"], row["resolution"])
            self._frames[stamp_ns] = PackedMaps(stamp_ns, color, height, labels, workspace)
        return self._frames[stamp_ns]
