"""One step of a run as `gi-log report` shows it: words, numbers, and all the maps that it was decided from."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data import report_pictures as pictures
from grasping_invisible.data.action_grid import PUSH_LENGTH, RAISED
from grasping_invisible.data.clock import to_ns
from grasping_invisible.data.errors import BadMessage
from grasping_invisible.data.extensions import REPORT_MAPS, extensions
from grasping_invisible.data.heightmap_message import HeightmapArrays, decode_heightmaps
from grasping_invisible.data.log_commands import wording
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.q_map_message import QMapArrays, decode_q_maps
from grasping_invisible.data.report_pictures import Motion, Panel
from grasping_invisible.data.run_names import EXPLORER
from grasping_invisible.data.steps import LoggedStep

# Maps that another package can add to a step: stacks (rotations, R, C) by name, of which the last was decided from.
MapMaker = Callable[[HeightmapArrays, QMapArrays, gi.Decision], Mapping[str, NDArray[np.float32]]]

M = TypeVar("M")
T = TypeVar("T")


@dataclass(frozen=True)
class Stage:
    """A stage of a decision and its time."""

    name: str
    milliseconds: float


@dataclass(frozen=True)
class StepHead:
    """A step in brief, for what shows all of them at once. `stamp_ns`: of the camera frame it was decided from."""

    number: int
    stamp_ns: int
    policy: str
    motion: str
    came_of: str
    good: bool  # the target came to light or into the gripper
    found: bool  # the target was in view afterwards
    stages: list[Stage]
    thumbnail: str

    @property
    def total_ms(self) -> float:
        """How long the decision took."""
        return sum(stage.milliseconds for stage in self.stages)


@dataclass(frozen=True)
class Row:
    """Panels that belong together."""

    title: str
    panels: list[Panel]
    about: str = ""


@dataclass
class StepReport:
    """One step as the template shows it, with all its pictures."""

    head: StepHead
    place: str
    why: str
    facts: list[tuple[str, str]]
    camera: list[Panel]
    rows: list[Row] = field(default_factory=list)
    rotations: list[str] = field(default_factory=list)
    rotations_of: str = ""
    rotation: int = 0
    missing: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class _MadeMaps:
    """What another package adds to a step, or why it could not."""

    stacks: Mapping[str, NDArray[np.float32]]
    failure: str = ""


def step_head(step: LoggedStep) -> StepHead:
    """Sum up a step."""
    decision, result = step.decision, step.result
    maps = decoded(step.heightmaps, decode_heightmaps)
    return StepHead(
        number=decision.step + 1,
        stamp_ns=to_ns(decision.frame_stamp),
        policy=decision.policy or "unknown policy",
        motion=wording.kind(decision.kind),
        came_of=wording.came_of(step),
        good=result is not None and (result.target_grasped or (result.target_visible and decision.policy == EXPLORER)),
        found=result is not None and result.target_visible,
        stages=[Stage(stage.stage, stage.milliseconds) for stage in decision.stages],
        thumbnail="" if maps is None else pictures.thumbnail(maps, motion_of(step)),
    )


def step_report(step: LoggedStep, head: StepHead, target: str, camera: list[Panel]) -> StepReport:
    """Put together what the log holds of a step. `camera`: what was seen."""
    decision = step.decision
    report = StepReport(
        head=head,
        place=f"({decision.position.x:.3f}, {decision.position.y:.3f}) m at {wording.degrees(decision.yaw)}",
        why=decision.why,
        facts=_numbers(decision),
        camera=camera,
    )
    if not report.camera:
        report.missing.append("the camera image")
    maps = decoded(step.heightmaps, decode_heightmaps)
    if maps is None:
        report.missing.append("heightmaps")
        return report
    motion = motion_of(step)
    report.rows.append(Row("From above", [*pictures.map_panels(maps, target, motion), *_after(step)]))
    q_maps = decoded(step.q_maps, decode_q_maps)
    if q_maps is None or decision.push_level >= len(q_maps.push) or decision.rotation >= len(q_maps.grasp):
        report.missing.append("Q maps")
        return report
    _add_values(report, decision, maps, q_maps, motion)
    return report


def motion_of(step: LoggedStep) -> Motion:
    """What is drawn of a step's decision."""
    decision = step.decision
    position = decision.position.x, decision.position.y, decision.position.z
    length = step.command.length if step.command is not None else PUSH_LENGTH
    return Motion(decision.kind, position, decision.yaw, length)


def _add_values(
    report: StepReport, decision: gi.Decision, maps: HeightmapArrays, q_maps: QMapArrays, motion: Motion
) -> None:
    """The rows of maps that the motion was chosen from."""
    made = _made_maps(maps, q_maps, decision)
    if made.failure:
        report.missing.append(f"exploration maps ({made.failure})")
    k = decision.rotation
    q_push = q_maps.push[decision.push_level]
    push = "Raised push" if decision.push_level == RAISED else "Push"
    by_q = not made.stacks
    panels = []
    for name, stack, kind in ((push, q_push, gi.PUSH), ("Grasp", q_maps.grasp, gi.GRASP)):
        chosen = by_q and decision.kind == kind
        panels.append(pictures.value_panel(f"{name} Q, best of {len(stack)}", stack, maps, motion))
        panels.append(
            pictures.value_panel(f"{name} Q, {wording.degrees(decision.yaw)}", stack, maps, motion, k, chosen=chosen)
        )
    report.rows.append(Row("Critic", panels, "what each motion is expected to be worth"))
    chosen_from, name = (q_push, "push Q") if decision.kind == gi.PUSH else (q_maps.grasp, "grasp Q")
    if made.stacks:
        *factors, last = made.stacks
        panels = [pictures.value_panel(part.capitalize(), made.stacks[part], maps, motion, k) for part in factors]
        panels.append(pictures.value_panel(last.capitalize(), made.stacks[last], maps, motion, k, chosen=True))
        about = f"for pushes towards {wording.degrees(decision.yaw)}; not logged but made again from the maps above"
        report.rows.append(Row("Explorer", panels, about))
        chosen_from, name = made.stacks[last], last
    report.rotations, report.rotations_of, report.rotation = pictures.rotation_strip(chosen_from, maps), name, k


def _made_maps(maps: HeightmapArrays, q_maps: QMapArrays, decision: gi.Decision) -> _MadeMaps:
    for extension in extensions(REPORT_MAPS):
        if extension.failure:
            return _MadeMaps({}, extension.failure)
        try:
            make: MapMaker = extension.loaded
            if stacks := make(maps, q_maps, decision):
                return _MadeMaps(stacks)
        except Exception as error:  # another package's, and a log may hold maps of any size
            return _MadeMaps({}, str(error))
    return _MadeMaps({})


def _after(step: LoggedStep) -> list[Panel]:
    maps = decoded(step.next_heightmaps, decode_heightmaps)
    return [] if maps is None else [pictures.after_panel(maps)]


def _numbers(decision: gi.Decision) -> list[tuple[str, str]]:
    asked = not math.isnan(decision.grasp_probability)
    memory = decision.memory
    return [
        ("value", f"{decision.value:.3f}"),
        ("best push, grasp", f"{decision.q_push:.3f}, {decision.q_grasp:.3f}"),
        ("target", f"{decision.target_pixels} px" if decision.target_pixels else "not seen"),
        ("border occupied", f"{decision.border_ratio:.0%}" if decision.target_pixels else "-"),
        ("grasp would succeed", f"{decision.grasp_probability:.0%}" if asked else "not asked"),
        ("remembered", f"{len(memory.failed_pushes)} failed pushes, {memory.consecutive_grasp_failures} failed grasps"),
    ]


def decoded(message: M | None, decode: Callable[[M], T]) -> T | None:
    """What a message holds; None where it is not there, or damaged."""
    try:
        return None if message is None else decode(message)
    except BadMessage:
        return None
