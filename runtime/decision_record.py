"""The record of one decision, and the messages it becomes."""

import math
from dataclasses import dataclass

from grasping_invisible.data.action_grid import PUSH_LENGTH
from grasping_invisible.data.clock import to_timestamp
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.memory import Memory, memory_message


@dataclass(frozen=True)
class Decision:
    """A chosen motion and why; the fields of `gi.Decision` but for what is measured.

    `position`: commanded TCP position, metres, base frame; `yaw`: radians. `opening`: of a grasp, metres between the
    finger pads, 0 for as far as the hand opens. `row`, `column`: of the action grid. `level`: of a push, `LOW` or
    `RAISED`. `grasp_probability`: None where the classifier was not asked.
    """

    frame_stamp_ns: int
    step: int
    policy: str
    method: str
    kind: gi.MotionKind
    rotation: int
    row: int
    column: int
    level: int
    position: tuple[float, float, float]
    yaw: float
    opening: float
    value: float
    q_push: float
    q_grasp: float
    border_ratio: float
    border_norm: float
    grasp_probability: float | None
    target_pixels: int
    memory: Memory
    seed: int
    why: str

    def command(self, command_id: int, stamp_ns: int) -> gi.MotionCommand:
        """The motion as it is sent to a robot."""
        x, y, z = self.position
        return gi.MotionCommand(
            id=command_id,
            stamp=to_timestamp(stamp_ns),
            kind=self.kind,
            position=gi.Point(x=x, y=y, z=z),
            yaw=self.yaw,
            length=PUSH_LENGTH if self.kind == gi.PUSH else 0.0,
            opening=self.opening,
        )

    def message(self, stamp_ns: int, stage_ms: dict[str, float]) -> gi.Decision:
        """The decision as it is logged."""
        x, y, z = self.position
        return gi.Decision(
            stamp=to_timestamp(stamp_ns),
            frame_stamp=to_timestamp(self.frame_stamp_ns),
            step=self.step,
            policy=self.policy,
            method=self.method,
            kind=self.kind,
            rotation=self.rotation,
            row=self.row,
            column=self.column,
            push_level=self.level,
            position=gi.Point(x=x, y=y, z=z),
            yaw=self.yaw,
            opening=self.opening,
            value=self.value,
            q_push=self.q_push,
            q_grasp=self.q_grasp,
            border_ratio=self.border_ratio,
            border_norm=self.border_norm,
            grasp_probability=math.nan if self.grasp_probability is None else self.grasp_probability,
            target_pixels=self.target_pixels,
            memory=memory_message(self.memory),
            seed=self.seed,
            why=self.why,
            stages=[gi.StageTime(stage=name, milliseconds=ms) for name, ms in stage_ms.items()],
        )
