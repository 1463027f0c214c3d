"""Failed runs as tables in Markdown, and as a sheet with a picture of each cause."""

from collections import Counter, defaultdict
from collections.abc import Sequence
from pathlib import Path
from textwrap import wrap

import matplotlib as mpl
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from grasping_invisible.data.action_grid import PUSH_LENGTH
from grasping_invisible.data.camera_frames import camera_frames
from grasping_invisible.data.classes import CLASSES
from grasping_invisible.data.clock import to_ns
from grasping_invisible.data.drawing import GRASP_COLOR, PUSH_COLOR, strokes
from grasping_invisible.data.errors import BadMessage
from grasping_invisible.data.images import decode_color
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.steps import LoggedStep
from grasping_invisible.data.topics import COLOR_IMAGE
from grasping_invisible.training.failed_motions import Fault, maps_of
from grasping_invisible.training.failed_runs import Cause, Failure, Run
from grasping_invisible.training.result_tables import cell

_GROUP = tuple[str, str, str]  # suite, method and the bundle's hash
DPI = 110


def failure_tables(runs: Sequence[tuple[Run, Failure | None]]) -> str:
    """For each suite, method and bundle how many runs failed of what, and what was wrong with failed runs' motions."""
    groups: dict[_GROUP, list[tuple[Run, Failure | None]]] = defaultdict(list)
    for run, failure in runs:
        groups[run.suite, run.method, run.start.bundle_sha256].append((run, failure))
    bundles = Counter((suite, method) for suite, method, _ in groups)
    parts = []
    for suite, method, bundle in sorted(groups):
        members = groups[suite, method, bundle]
        failures = [failure for _, failure in members if failure is not None]
        which = f", bundle {bundle[:12] or 'unknown'}" if bundles[suite, method] > 1 else ""
        parts.append(f"## {suite}: {method}{which}\n\n{len(failures)} of {len(members)} runs failed.")
        if failures:
            parts += [_causes(failures), _motions(failures)]
    return "\n\n".join(parts) + "\n"


def draw_failures(failures: Sequence[Failure], path: Path) -> None:
    """A PNG with a row for each cause, the most frequent first: before, in the camera and from above, and after.

    No file where there is nothing to show.
    """
    shown = _examples(failures)
    if not shown:
        path.unlink(missing_ok=True)  # that of other failures says nothing of these
        return
    with mpl.rc_context({"font.family": "DejaVu Sans", "font.size": 8}):
        figure = Figure(figsize=(11.2, 3.5 * len(shown)), dpi=DPI, layout="constrained")
        for part, (failure, count) in zip(figure.subfigures(len(shown), 1, squeeze=False)[:, 0], shown, strict=True):
            part.suptitle(f"{failure.cause.value} ({count})", fontsize=10, fontweight="bold", x=0.02, ha="left")
            camera, before, after = part.subplots(1, 3, width_ratios=(4, 3, 3))
            assert failure.step is not None
            _draw_camera(camera, failure.run.path, failure.step)
            before.set_title("from above, with the motion", fontsize=8, loc="left")
            _draw_map(before, failure.step.heightmaps, failure.step)
            _draw_map(after, failure.step.next_heightmaps, None)
            camera.set_title(_caption(failure.run, failure.step), fontsize=8, loc="left")
            after.set_title(_after(failure.step), fontsize=8, loc="left")
        figure.savefig(path, metadata={"Software": None})


def _causes(failures: Sequence[Failure]) -> str:
    counts = Counter(failure.cause for failure in failures)
    lines = ["| cause | runs | for example |", "|---|---|---|"]
    for cause, count in sorted(counts.items(), key=lambda item: (-item[1], item[0].value)):
        example = next(failure.run for failure in failures if failure.cause is cause)
        lines.append(f"| {cause.value} | {count} | {cell(example.start.scene)}, seed {example.start.seed} |")
    return "\n".join(lines)


def _motions(failures: Sequence[Failure]) -> str:
    motions = sum(len(failure.run.steps) for failure in failures)
    faults = Counter(fault.value for failure in failures for fault in failure.faults)
    lines = [f"| of their {motions} motions | how many |", "|---|---|"]
    lines += [f"| {fault} | {count} |" for fault, count in sorted(faults.items(), key=lambda item: (-item[1], item[0]))]
    return "\n".join(lines)


def _examples(failures: Sequence[Failure]) -> list[tuple[Failure, int]]:
    """The first failure of each cause that has a picture, and how many there are of it."""
    counts = Counter(failure.cause for failure in failures)
    first: dict[Cause | Fault, Failure] = {}
    for failure in failures:
        if failure.step is not None and failure.step.heightmaps is not None:
            first.setdefault(failure.cause, failure)
    return [(first[cause], count) for cause, count in counts.most_common() if cause in first]


def _draw_camera(axes: Axes, path: Path, step: LoggedStep) -> None:
    """What the camera saw before the motion."""
    axes.set_axis_off()
    frames = camera_frames(path, (to_ns(step.decision.frame_stamp),), (COLOR_IMAGE,))
    try:
        for image in (frame.messages[COLOR_IMAGE.key] for frame in frames):
            assert isinstance(image, CompressedImage)
            axes.imshow(decode_color(image))
    except BadMessage:
        _say(axes, "damaged in the log")


def _draw_map(axes: Axes, message: gi.Heightmaps | None, step: LoggedStep | None) -> None:
    axes.set_xticks([])
    axes.set_yticks([])
    if message is None:
        _say(axes, "not in the log")
        return
    try:
        maps = maps_of(message)
    except BadMessage:
        _say(axes, "damaged in the log")
        return
    (left, low), (right, high) = maps.workspace.low, maps.workspace.high
    axes.imshow(maps.color, extent=(left, right, low, high), interpolation="nearest")
    if step is None or step.start is None:
        return
    mask = maps.labels == CLASSES.index(step.start.target_color)
    if mask.any():
        axes.contour(mask[::-1], levels=[0.5], extent=(left, right, low, high), colors="white", linewidths=1.2)
    decision = step.decision
    ink = tuple(level / 255 for level in (PUSH_COLOR if decision.kind == gi.PUSH else GRASP_COLOR))
    for start, end in strokes(decision.kind, decision.position.x, decision.position.y, decision.yaw, PUSH_LENGTH):
        for color, width in (("black", 4.0), (ink, 2.0)):
            axes.annotate("", end, start, arrowprops={"arrowstyle": "->", "color": color, "lw": width})


def _say(axes: Axes, text: str) -> None:
    """Words where a picture should be."""
    axes.text(0.5, 0.5, text, ha="center", va="center", transform=axes.transAxes)


def _caption(run: Run, step: LoggedStep) -> str:
    kind = gi.MotionKind.Name(step.decision.kind).lower()
    return f"{run.start.scene}, seed {run.start.seed}, step {step.decision.step}: {kind} for {run.start.target_color}"


def _after(step: LoggedStep) -> str:
    """What came of it, in lines that fit."""
    return "afterwards" if step.result is None else "\n".join(wrap(step.result.detail, 50)[:3])
