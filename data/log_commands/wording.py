"""How times, sizes, angles and motions read for a person."""

import math
from datetime import UTC, datetime

from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.steps import LoggedStep


def when(stamp_ns: int) -> str:
    """A moment in UTC to the second, or a dash for 0."""
    if stamp_ns == 0:
        return "-"
    return datetime.fromtimestamp(stamp_ns // 1_000_000_000, UTC).strftime("%Y-%m-%d %H:%M:%S")


def duration(nanoseconds: int) -> str:
    """Such as `4.2 s` or `12 min 03 s`."""
    seconds = nanoseconds / 1e9
    if seconds < 60:
        return f"{seconds:.1f} s"
    return f"{int(seconds // 60)} min {int(seconds % 60):02d} s"


def size(count: int) -> str:
    """Bytes with a decimal prefix."""
    value = float(count)
    for unit in ("B", "kB", "MB"):
        if value < 1000:
            return f"{value:.0f} {unit}" if unit == "B" else f"{value:.1f} {unit}"
        value /= 1000
    return f"{value:.1f} GB"


def kind(motion: gi.MotionKind) -> str:
    """`push`, `grasp`, ... also for kinds this version does not know."""
    return gi.MotionKind.Name(motion).lower() if motion in gi.MotionKind.values() else f"motion {motion}"


def status(outcome: gi.MotionStatus) -> str:
    """`completed`, `blocked`, ... also for statuses this version does not know."""
    return gi.MotionStatus.Name(outcome).lower() if outcome in gi.MotionStatus.values() else f"status {outcome}"


def degrees(radians: float) -> str:
    """An angle, rounded to half a degree."""
    return f"{round(math.degrees(radians) * 2) / 2:g}°" if math.isfinite(radians) else "?"


def came_of(step: LoggedStep) -> str:
    """What the motion of a step led to, in one line."""
    outcome, result = step.outcome, step.result
    if result is not None and result.detail:
        return result.detail
    if outcome is None:
        return "no outcome in the log"
    said = [status(outcome.status), outcome.detail, *(_judged(result) if result is not None else [])]
    return ", ".join(word for word in said if word)


def _judged(result: gi.StepResult) -> list[str]:
    changed = "the scene changed" if result.scene_changed else "nothing moved"
    if result.target_grasped:
        return [changed, "target grasped"]
    if result.object_grasped:
        return [changed, "grasped something else"]
    return [changed, "target in view"] if result.target_visible else [changed]
