"""One decision: from an observation, a memory and a seed to a motion and the reason for it (paper, algorithm 1).

Pure: the same inputs give an equal `Decision`, which is what makes a log replayable.
"""

import math
from dataclasses import dataclass, field

from grasping_invisible.data.action_grid import ACTION_CELLS, PUSH_LENGTH, RAISED, rotation_angle
from grasping_invisible.data.classes import TARGET_COLORS
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.run_names import COORDINATOR, EXPLORER
from grasping_invisible.runtime.critic import QMaps
from grasping_invisible.runtime.decision_record import Decision
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.runtime.explorer_maps import ExplorationMaps
from grasping_invisible.runtime.frame import RgbdFrame
from grasping_invisible.runtime.memory import Memory
from grasping_invisible.runtime.methods import COORDINATION, EXPLORATION
from grasping_invisible.runtime.motion import cell_position, ends_inside, grasp_height
from grasping_invisible.runtime.perception import Perception, perceive
from grasping_invisible.runtime.preshape import FULLY_OPEN, preshape
from grasping_invisible.runtime.situation import Models, Proposal, Situation, situation_of
from grasping_invisible.runtime.workspace import Workspace


@dataclass(frozen=True)
class DecisionSettings:
    """What stays the same during a run.

    `target`: the colour to find. `exploration` and `coordination`: names of methods, see `runtime.methods`.
    Raises `BadInput` for an unknown name or a workspace that does not fit the action grid or a push.
    """

    target: str
    workspace: Workspace = field(default_factory=Workspace)
    exploration: str = EXPLORER
    coordination: str = COORDINATOR

    def __post_init__(self) -> None:
        for what, name, known in (
            ("target", self.target, TARGET_COLORS),
            ("exploration method", self.exploration, EXPLORATION),
            ("coordination method", self.coordination, COORDINATION),
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
    """A decision with everything it was made from. `exploration`: None but where a push was chosen by such maps."""

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
    situation = situation_of(perception, settings.target, memory, models, seed)
    policy, method = COORDINATOR, settings.coordination
    proposal = COORDINATION[method](situation) if perception.target_seen else None
    if proposal is None:
        policy, method = EXPLORER, settings.exploration
        proposal = EXPLORATION[method](situation)
    decision = _decision(situation, proposal, policy, method, seed)
    situation.watch.lap(policy)
    stage_ms = perception.stage_ms | situation.watch.laps
    return Deliberation(decision, perception, proposal.q_maps, proposal.exploration, stage_ms)


def _decision(situation: Situation, proposal: Proposal, policy: str, method: str, seed: int) -> Decision:
    maps, choice = situation.maps, proposal.choice
    x, y = cell_position(choice.row, choice.column, maps.workspace)
    yaw = float(rotation_angle(choice.rotation))
    if proposal.kind == gi.GRASP:
        height = grasp_height(maps, choice.row, choice.column)
        fitted_to = situation.perception.mask if proposal.mask is None else proposal.mask
        fingers = preshape(fitted_to, maps.workspace, (x, y), yaw)
        x, y = x + fingers.shift * math.cos(yaw), y + fingers.shift * math.sin(yaw)
    else:
        height = float(choice.of(situation.heights))
        fingers = FULLY_OPEN
    return Decision(
        frame_stamp_ns=maps.stamp_ns,
        step=situation.memory.step,
        policy=policy,
        method=method,
        kind=proposal.kind,
        rotation=choice.rotation,
        row=choice.row,
        column=choice.column,
        level=choice.level,
        position=(x, y, maps.workspace.center[2] + height),
        yaw=yaw,
        opening=fingers.opening,
        value=choice.value,
        q_push=proposal.q_push,
        q_grasp=proposal.q_grasp,
        border_ratio=situation.border.ratio,
        border_norm=situation.border.norm,
        grasp_probability=proposal.grasp_probability,
        target_pixels=situation.perception.target_pixels,
        memory=situation.memory,
        seed=seed,
        why=f"{situation.target} {proposal.why}{'; raised' if choice.level == RAISED else ''}",
    )
