"""What a method decides from, and what it answers."""

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.target_border import TargetBorder, target_border
from grasping_invisible.runtime.choice import Choice
from grasping_invisible.runtime.critic import QMaps
from grasping_invisible.runtime.doubt import doubted
from grasping_invisible.runtime.explorer_maps import ExplorationMaps
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.hint import Hint, hint_to_follow, raised_tips
from grasping_invisible.runtime.memory import Memory, untried
from grasping_invisible.runtime.motion import feasible_pushes, push_heights
from grasping_invisible.runtime.perception import Perception
from grasping_invisible.runtime.stopwatch import Stopwatch


class Models(Protocol):
    """The learned models that a decision asks."""

    def segment(self, color: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Class index of every pixel, (H, W) uint8, of an (H, W, 3) uint8 RGB image."""
        ...

    def q_maps(self, maps: Heightmaps, mask: NDArray[np.bool_]) -> QMaps:
        """Q maps for the target under `mask`, (N, N) bool; all true stands for any object."""
        ...

    def grasp_probability(self, features: NDArray[np.float32]) -> float:
        """How likely a grasp is to succeed, from (q_p, q_g, r_b, n_b, c_g)."""
        ...


@dataclass(frozen=True)
class Situation:
    """What a method decides from.

    `target`: its colour. `heights` and `pushes`: (2, 16, 112, 112), of `runtime.motion`: how high a push would be, and
    which pushes can be made and would meet something. `hint`: where to look for the target, if anywhere.
    `border`: of the target. `rng`: seeded for this very step.
    """

    target: str
    perception: Perception
    memory: Memory
    models: Models
    rng: np.random.Generator
    heights: NDArray[np.float32]
    pushes: NDArray[np.bool_]
    hint: Hint
    border: TargetBorder
    watch: Stopwatch

    @property
    def maps(self) -> Heightmaps:
        """The workspace from above."""
        return self.perception.maps

    def q_maps(self, mask: NDArray[np.bool_]) -> QMaps:
        """What the critic says for a mask (N, N), and of pushes what is to be doubted of it."""
        self.watch.lap("feasibility")
        q_maps = self.models.q_maps(self.maps, mask)
        self.watch.lap("critic")
        return replace(q_maps, push=doubted(q_maps.push, self.memory.fruitless, self.maps.workspace))

    def agnostic_q_maps(self) -> QMaps:
        """What the critic says under a mask of ones: any object counts as the target."""
        return self.q_maps(np.ones_like(self.perception.mask))

    def untried(self, kind: gi.MotionKind) -> NDArray[np.bool_]:
        """Which actions of a kind are not known to change nothing, (16, 112, 112) bool, of pushes (2, 16, 112, 112)."""
        return untried(kind, self.memory, self.maps.workspace)


@dataclass(frozen=True)
class Proposal:
    """The motion that a method chose, and from what.

    `q_maps`: those it chose by. `q_push`, `q_grasp`: the greatest Q values of the motions it chose from; 0 where there
    were none. `grasp_probability`: None where the classifier was not asked. `exploration`: None but for an
    exploration by maps. `why`: one line for a person, to stand after the target's name and a blank. `mask`: (N, N), of
    what a grasp is to be fitted to; None for the target.
    """

    kind: gi.MotionKind
    choice: Choice
    q_maps: QMaps
    q_push: float
    q_grasp: float
    why: str
    grasp_probability: float | None = None
    exploration: ExplorationMaps | None = None
    mask: NDArray[np.bool_] | None = None


def situation_of(perception: Perception, target: str, memory: Memory, models: Models, seed: int) -> Situation:
    """Work out what every method needs to know of a frame."""
    watch = Stopwatch()
    maps = perception.maps
    hint = hint_to_follow(perception, memory)
    heights = push_heights(maps, raised_tips(perception, hint))
    return Situation(
        target=target,
        perception=perception,
        memory=memory,
        models=models,
        rng=np.random.default_rng((seed, memory.step)),
        heights=heights,
        pushes=feasible_pushes(maps, heights),
        hint=hint,
        border=target_border(maps.height, perception.mask, maps.workspace.resolution),
        watch=watch,
    )
