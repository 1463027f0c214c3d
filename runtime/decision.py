"""One decision: from an observation, a memory and a seed to a motion and the reason for it (paper, algorithm 1).

Pure: the same inputs give an equal `Decision`, which is what makes a log replayable.
"""

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import ACTION_CELLS, PUSH_LENGTH, feasible_grasps, rotation_angle
from grasping_invisible.data.classes import TARGET_COLORS
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.target_border import TargetBorder, target_border
from grasping_invisible.runtime.choice import Choice, best_value
from grasping_invisible.runtime.coordinator import COORDINATORS, coordinate
from grasping_invisible.runtime.critic import QMaps
from grasping_invisible.runtime.decision_record import COORDINATOR, EXPLORER, Decision
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.runtime.explorer import EXPLORERS, ExplorationMaps, exploration_maps, explore
from grasping_invisible.runtime.frame import RgbdFrame
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.memory import Memory, untried
from grasping_invisible.runtime.motion import (
    cell_position,
    ends_inside,
    feasible_pushes,
    grasp_height,
    low_grasps,
    open_pushes,
    push_heights,
    pushes_towards,
)
from grasping_invisible.runtime.perception import Perception, perceive
from grasping_invisible.runtime.stopwatch import Stopwatch
from grasping_invisible.runtime.workspace import Workspace


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
class DecisionSettings:
    """What stays the same during a run.

    `target`: the colour to find. `exploration` and `coordination`: named variants of the two policies.
    Raises `BadInput` for an unknown name or a workspace that does not fit the action grid or a push.
    """

    target: str
    workspace: Workspace = field(default_factory=Workspace)
    exploration: str = EXPLORER
    coordination: str = COORDINATOR

    def __post_init__(self) -> None:
        for what, name, known in (
            ("target", self.target, TARGET_COLORS),
            ("exploration method", self.exploration, tuple(EXPLORERS)),
            ("coordination method", self.coordination, COORDINATORS),
        ):
            if name not in known:
                raise BadInput(f"unknown {what} {name!r}; known: {', '.join(known)}")
        if self.workspace.cells % ACTION_CELLS:
            raise BadInput(
                f"a workspace of {self.workspace.cells} cells cannot be used: "
                f"the number must be a multiple of {ACTION_CELLS}"
            )
        if not ends_inside(self.workspace).any():
            raise BadInput(f"a workspace of {self.workspace.size} m is too small for a push of {PUSH_LENGTH} m")


@dataclass(frozen=True)
class Deliberation:
    """A decision with everything it was made from. `exploration`: None where the coordinator decided."""

    decision: Decision
    perception: Perception
    q_maps: QMaps
    exploration: ExplorationMaps | None
    stage_ms: dict[str, float]


def decide(frame: RgbdFrame, memory: Memory, models: Models, settings: DecisionSettings, seed: int) -> Deliberation:
    """Look at a frame and choose the next motion."""
    perception = perceive(frame, models, settings.target, settings.workspace)
    return deliberate(perception, memory, models, settings, seed)


def deliberate(
    perception: Perception, memory: Memory, models: Models, settings: DecisionSettings, seed: int
) -> Deliberation:
    """Choose the next motion from a frame that is perceived already, as judging the last motion needs it too."""
    watch = Stopwatch()
    maps = perception.maps
    heights = push_heights(maps)
    situation = _Situation(
        perception,
        memory,
        settings,
        seed,
        np.random.default_rng((seed, memory.step)),
        heights,
        feasible_pushes(maps, heights),
        target_border(maps.height, perception.mask, maps.workspace.resolution),
    )
    watch.lap("feasibility")
    if perception.target_seen:
        q_maps = models.q_maps(maps, perception.mask)
        watch.lap("critic")
        decision = _coordinate(situation, q_maps, models)
        watch.lap("coordinator")
        if decision is not None:
            return Deliberation(decision, perception, q_maps, None, perception.stage_ms | watch.laps)
    q_maps = models.q_maps(maps, np.ones_like(perception.mask))
    watch.lap("critic")
    exploration = exploration_maps(maps, q_maps.push, memory.failed_pushes, settings.exploration)
    decision = _explore(situation, q_maps, exploration)
    watch.lap("explorer")
    return Deliberation(decision, perception, q_maps, exploration, perception.stage_ms | watch.laps)


@dataclass(frozen=True)
class _Situation:
    """What both policies decide from. `heights` and `pushes`: (16, 112, 112), of `runtime.motion`."""

    perception: Perception
    memory: Memory
    settings: DecisionSettings
    seed: int
    rng: np.random.Generator
    heights: NDArray[np.float32]
    pushes: NDArray[np.bool_]
    border: TargetBorder

    def untried(self, kind: gi.MotionKind) -> NDArray[np.bool_]:
        return untried(kind, self.memory, self.perception.maps.workspace)

    def decision(
        self,
        policy: str,
        method: str,
        kind: gi.MotionKind,
        choice: Choice,
        q_push: float,
        q_grasp: float,
        grasp_probability: float | None,
        why: str,
    ) -> Decision:
        maps = self.perception.maps
        x, y = cell_position(choice.row, choice.column, maps.workspace)
        if kind == gi.GRASP:
            height = grasp_height(maps, choice.row, choice.column)
        else:
            height = float(self.heights[choice.rotation, choice.row, choice.column])
        return Decision(
            frame_stamp_ns=maps.stamp_ns,
            step=self.memory.step,
            policy=policy,
            method=method,
            kind=kind,
            rotation=choice.rotation,
            row=choice.row,
            column=choice.column,
            position=(x, y, maps.workspace.center[2] + height),
            yaw=float(rotation_angle(choice.rotation)),
            value=choice.value,
            q_push=q_push,
            q_grasp=q_grasp,
            border_ratio=self.border.ratio,
            border_norm=self.border.norm,
            grasp_probability=grasp_probability,
            target_pixels=self.perception.target_pixels,
            memory=self.memory,
            seed=self.seed,
            why=why,
        )


def _coordinate(situation: _Situation, q_maps: QMaps, models: Models) -> Decision | None:
    """The coordinator's decision; None where no push and no grasp is possible."""
    perception = situation.perception
    maps, workspace = perception.maps, perception.maps.workspace
    coordination = coordinate(
        q_maps,
        situation.pushes & situation.untried(gi.PUSH) & pushes_towards(perception.mask, workspace),
        low_grasps(maps, feasible_grasps(perception.mask, workspace.resolution)) & situation.untried(gi.GRASP),
        situation.border,
        situation.memory.consecutive_grasp_failures,
        models.grasp_probability,
        situation.rng,
    )
    if coordination is None:
        return None
    why = (
        f"{situation.settings.target} seen ({situation.perception.target_pixels} px): a grasp would succeed with "
        f"probability {coordination.grasp_probability:.2f}; best push {coordination.q_push:.2f}, best grasp "
        f"{coordination.q_grasp:.2f}, border {situation.border.ratio:.0%} occupied"
    )
    if coordination.grasp != coordination.prefers_grasp:
        why += f"; no {'push' if coordination.grasp else 'grasp'} is possible"
    return situation.decision(
        COORDINATOR,
        situation.settings.coordination,
        gi.GRASP if coordination.grasp else gi.PUSH,
        coordination.choice,
        coordination.q_push,
        coordination.q_grasp,
        coordination.grasp_probability,
        why,
    )


def _explore(situation: _Situation, q_maps: QMaps, exploration: ExplorationMaps) -> Decision:
    """The explorer's decision; there is always one, if only a push through thin air."""
    allowed, caveat = _pushes_left(situation)
    choice, by = explore(exploration, allowed, situation.rng)
    seen = "no motion for it is possible" if situation.perception.target_seen else "not seen"
    at = choice.rotation, choice.row, choice.column
    why = (
        f"{situation.settings.target} {seen}: explore by {by} {choice.value:.3f} = clutter "
        f"{exploration.clutter[at]:.2f}, agnostic push {exploration.agnostic[at]:.2f}, "
        f"failures {exploration.failure[at]:.2f}{caveat}"
    )
    return situation.decision(
        EXPLORER,
        situation.settings.exploration,
        gi.PUSH,
        choice,
        best_value(q_maps.push, allowed) or 0.0,
        float(q_maps.grasp.max()),
        None,
        why,
    )


def _pushes_left(situation: _Situation) -> tuple[NDArray[np.bool_], str]:
    """The pushes to choose from, never none, and what a person should know about them."""
    untried_pushes = situation.untried(gi.PUSH)
    workspace = situation.perception.maps.workspace
    open_way = open_pushes(workspace, situation.heights)
    if not open_way.any():
        return ends_inside(workspace), "; everything seems too high to be reached"
    for allowed, caveat in (
        (situation.pushes & untried_pushes, ""),
        (situation.pushes, "; all that was left was tried before"),
        (open_way & untried_pushes, "; nothing stands high enough to be pushed"),
    ):
        if allowed.any():
            return allowed, caveat
    return open_way, "; nothing stands high enough to be pushed"
