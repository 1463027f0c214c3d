"""Makes every decision of a log again, from what the log says it was made from, and compares."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from google.protobuf.message import Message

from grasping_invisible.data.camera_frames import LoggedFrame, camera_frames
from grasping_invisible.data.clock import to_ns
from grasping_invisible.data.log_reader import readers_of
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.topics import CAMERA_INFO, COLOR_IMAGE, DECISION, DEPTH_IMAGE, RUN_START, TRANSFORMS
from grasping_invisible.runtime.config import parse_config
from grasping_invisible.runtime.decision import DecisionSettings, decide
from grasping_invisible.runtime.errors import BadInput, GraspingError
from grasping_invisible.runtime.frame_sets import FrameParts
from grasping_invisible.runtime.memory import memory_from_message
from grasping_invisible.runtime.situation import Models

_CAMERA = (COLOR_IMAGE, DEPTH_IMAGE, CAMERA_INFO, TRANSFORMS)
_MEASURED = ("stamp", "stages")  # when and how fast: never the same twice
_ROUNDED = "why"  # a sentence with rounded numbers, which can differ when the numbers differ within a tolerance


class OtherModels(BadInput):
    """A log whose decisions were made by other models than those at hand."""


@dataclass(frozen=True)
class Difference:
    """A field of `gi.Decision`, such as `position.x`, that came out differently."""

    field: str
    logged: Any
    recomputed: Any


@dataclass(frozen=True)
class ReplayedDecision:
    """A logged decision and how its replay differs; `unchecked`: why it could not be made again, if so."""

    logged: gi.Decision
    differences: tuple[Difference, ...] = ()
    unchecked: str = ""


@dataclass(frozen=True)
class ReplayResult:
    """All decisions of a log in their order, and what is wrong with the log itself, a line each."""

    decisions: tuple[ReplayedDecision, ...]
    damage: tuple[str, ...]
    onnxruntime_versions: tuple[str, ...] = ()  # that the decisions were logged with

    @property
    def checked(self) -> int:
        """How many decisions could be made again."""
        return sum(not decision.unchecked for decision in self.decisions)

    @property
    def different(self) -> int:
        """How many came out differently."""
        return sum(bool(decision.differences) for decision in self.decisions)

    @property
    def identical(self) -> bool:
        """Whether all that could be checked came out as logged."""
        return self.different == 0


@dataclass(frozen=True)
class LoggedDecisions:
    """The decisions of a log, each with the start of its run, if the log holds that; `damage`: of the log."""

    decisions: tuple[tuple[gi.Decision, gi.RunStart | None], ...]
    damage: tuple[str, ...]

    @property
    def starts(self) -> list[gi.RunStart]:
        """The runs in the log, which is one unless logs were merged."""
        return list({start.run_id: start for _, start in self.decisions if start is not None}.values())


def read_decisions(path: Path) -> LoggedDecisions:
    """What there is to replay in the log that begins at `path`. Raises `BadLog`."""
    start: gi.RunStart | None = None
    decisions: list[tuple[gi.Decision, gi.RunStart | None]] = []
    damage: list[str] = []
    for reader in readers_of(path):
        for logged in reader.messages((RUN_START.key, DECISION.key)):
            if isinstance(logged.message, gi.RunStart):
                start = logged.message
            elif isinstance(logged.message, gi.Decision):
                decisions.append((logged.message, start))
        damage += reader.named_damage
    return LoggedDecisions(tuple(decisions), tuple(damage))


def replay_log(
    path: Path,
    models: Models,
    *,
    tolerance: float = 0.0,
    bundle_sha256: str | None = None,
    on_decision: Callable[[int, int], None] | None = None,
) -> ReplayResult:
    """Make every decision of the log that begins at `path` again.

    Each is made from the camera frame with its `frame_stamp`, the memory and the seed logged with it, and the settings
    of its run. All fields must be equal, but for when and how fast; with a `tolerance`, numbers that are not whole may
    be that far off, and the sentence that says why, which rounds them, is not compared.

    `bundle_sha256`: of `models`; decisions by others are refused, unless it is None. `on_decision` is told how many of
    how many are done. Raises `BadLog`, `OtherModels`, and `BadInput` where the target or a setting of the run cannot be
    used.
    """
    logged = read_decisions(path)
    for start in logged.starts:
        if bundle_sha256 not in (None, start.bundle_sha256):
            raise OtherModels(
                f"{path} was decided by bundle {start.bundle_sha256[:12] or 'unknown'}, these models are "
                f"{str(bundle_sha256)[:12]}"
            )
    replay = _Replay(models, tolerance, {start.run_id: settings_of(start) for start in logged.starts})
    waiting: dict[int, list[int]] = {}
    for number, (decision, _) in enumerate(logged.decisions):
        waiting.setdefault(to_ns(decision.frame_stamp), []).append(number)

    replayed: dict[int, ReplayedDecision] = {}
    for frame in camera_frames(path, waiting, _CAMERA):
        for number in waiting.pop(frame.stamp_ns):
            replayed[number] = replay.decide(*logged.decisions[number], frame)
            if on_decision is not None:
                on_decision(len(replayed), len(logged.decisions))
    for number in (number for numbers in waiting.values() for number in numbers):
        replayed[number] = ReplayedDecision(logged.decisions[number][0], unchecked="its camera frame is not in the log")
    versions = tuple(sorted({start.onnxruntime_version for start in logged.starts}))
    return ReplayResult(tuple(replayed[number] for number in sorted(replayed)), logged.damage, versions)


def settings_of(start: gi.RunStart) -> DecisionSettings:
    """What a run decided with. Raises `BadInput`."""
    config = parse_config(start.config_toml, f"the configuration of run {start.run_id}")
    return DecisionSettings(
        start.target_color,
        config.workspace.workspace(),
        config.policy.exploration,
        config.policy.coordination,
    )


def differences(logged: gi.Decision, recomputed: gi.Decision, tolerance: float = 0.0) -> tuple[Difference, ...]:
    """The fields in which two decisions differ, but for those that are measured."""
    ignored = (*_MEASURED, _ROUNDED) if tolerance else _MEASURED
    before, after = dict(_leaves(logged)), dict(_leaves(recomputed))
    return tuple(
        Difference(name, before.get(name), after.get(name))
        for name in {**before, **after}
        if name.split(".")[0].split("[")[0] not in ignored and not _equal(before.get(name), after.get(name), tolerance)
    )


@dataclass(frozen=True)
class _Replay:
    models: Models
    tolerance: float
    settings: dict[str, DecisionSettings]  # by run

    def decide(self, logged: gi.Decision, start: gi.RunStart | None, frame: LoggedFrame) -> ReplayedDecision:
        if start is None:
            return ReplayedDecision(logged, unchecked="the start of its run is not in the log")
        parts = FrameParts(*(frame.messages.get(topic.key) for topic in _CAMERA))  # type: ignore[arg-type]
        if parts.missing:
            return ReplayedDecision(logged, unchecked=f"the log lacks {', '.join(parts.missing)} of its camera frame")
        try:
            image = parts.decode()
        except GraspingError as error:
            return ReplayedDecision(logged, unchecked=str(error))
        memory = memory_from_message(logged.memory)
        made = decide(image, memory, self.models, self.settings[start.run_id], logged.seed)
        return ReplayedDecision(logged, differences(logged, made.decision.message(0, {}), self.tolerance))


def _leaves(message: Message, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """All fields that are no messages, also those left at their default, by their path such as `position.x`."""
    for field in message.DESCRIPTOR.fields:
        value = getattr(message, field.name)
        name = f"{prefix}{field.name}"
        if field.is_repeated:
            yield f"{name}.length", len(value)
            for index, item in enumerate(value):
                yield from _leaves(item, f"{name}[{index}].") if field.message_type else [(f"{name}[{index}]", item)]
        elif field.message_type:
            yield from _leaves(value, f"{name}.")
        else:
            yield name, value


def _equal(logged: Any, recomputed: Any, tolerance: float) -> bool:
    if isinstance(logged, float) and isinstance(recomputed, float):
        if math.isnan(logged) or math.isnan(recomputed):
            return math.isnan(logged) and math.isnan(recomputed)
        return logged == recomputed or abs(logged - recomputed) <= tolerance
    return logged == recomputed
