"""The motions that a method chooses from, and what the critic says of them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import feasible_grasps
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.choice import Choice, best_action, best_value
from grasping_invisible.runtime.critic import QMaps
from grasping_invisible.runtime.motion import low_grasps, pushes_for
from grasping_invisible.runtime.situation import Situation


@dataclass(frozen=True)
class Options:
    """Pushes, (2, 16, 112, 112) bool, and grasps, (16, 112, 112) bool; not all false.

    `last`: the target is in view and no motion can follow, so that a push would be in vain.
    """

    q_maps: QMaps
    pushes: NDArray[np.bool_]
    grasps: NDArray[np.bool_]
    last: bool = False

    @property
    def q_push(self) -> float:
        """q_p: the greatest Q value of these pushes, 0 where there are none."""
        return best_value(self.q_maps.push, self.pushes) or 0.0

    @property
    def q_grasp(self) -> float:
        """q_g: the greatest Q value of these grasps, 0 where there are none."""
        return best_value(self.q_maps.grasp, self.grasps) or 0.0

    def best(self, preferred: gi.MotionKind, rng: np.random.Generator) -> tuple[gi.MotionKind, Choice, str]:
        """The best motion of a kind, and what to add to why where it is of the other: for want of any, or the last."""
        if self.last and preferred == gi.PUSH and self.grasps.any():
            kind, caveat = gi.GRASP, "; the last motion"
        else:
            kind = preferred if self._allowed(preferred).any() else gi.GRASP if preferred == gi.PUSH else gi.PUSH
            caveat = instead(preferred, kind)
        values = self.q_maps.push if kind == gi.PUSH else self.q_maps.grasp
        choice = best_action(values, self._allowed(kind), rng)
        assert choice is not None  # there are options
        return kind, choice, caveat

    def _allowed(self, kind: gi.MotionKind) -> NDArray[np.bool_]:
        return self.pushes if kind == gi.PUSH else self.grasps


def instead(preferred: gi.MotionKind, kind: gi.MotionKind) -> str:
    """What a person should know where a method could not do what it wanted."""
    return "" if kind == preferred else f"; no {gi.MotionKind.Name(preferred).lower()} is possible"


def options_for(situation: Situation, mask: NDArray[np.bool_]) -> Options | None:
    """What can be done for an object under a mask (N, N), as its critic values it; None where nothing can."""
    workspace = situation.maps.workspace
    return options_among(
        situation,
        situation.q_maps(mask),
        pushes_for(situation.pushes, mask, workspace),
        feasible_grasps(mask, workspace.resolution),
    )


def options_among(
    situation: Situation, q_maps: QMaps, pushes: NDArray[np.bool_], grasps: NDArray[np.bool_]
) -> Options | None:
    """What of some pushes and grasps can be done and is not known to change nothing; None where nothing is."""
    options = Options(
        q_maps,
        situation.pushes & situation.untried(gi.PUSH) & pushes,
        low_grasps(situation.maps, grasps) & situation.untried(gi.GRASP),
        last=situation.memory.last_motion and situation.perception.target_seen,
    )
    return options if options.pushes.any() or options.grasps.any() else None
