"""A run as one HTML file that needs nothing else: what was seen, what was chosen from, and what came of it."""

from collections import Counter, OrderedDict
from collections.abc import Callable, Iterator
from importlib import resources
from itertools import cycle, islice
from pathlib import Path

from jinja2 import Environment

from grasping_invisible.data import report_pictures as pictures
from grasping_invisible.data.camera_frames import LoggedFrame, camera_frames
from grasping_invisible.data.classes import GREY, RGB
from grasping_invisible.data.clock import to_ns
from grasping_invisible.data.drawing import GRASP_COLOR, PUSH_COLOR
from grasping_invisible.data.heightmap_message import decode_heightmaps
from grasping_invisible.data.log_commands import wording
from grasping_invisible.data.log_summary import LogSummary, summarise
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.report_pictures import Motion, Panel
from grasping_invisible.data.report_steps import (
    StepHead,
    StepReport,
    decoded,
    motion_of,
    step_head,
    step_report,
)
from grasping_invisible.data.run_names import EXPLORER
from grasping_invisible.data.shown_name import shown
from grasping_invisible.data.steps import steps
from grasping_invisible.data.topics import CAMERA_INFO, COLOR_IMAGE, SEGMENTATION, TRANSFORMS

_TEMPLATE = "report.html"
_CAMERA = (COLOR_IMAGE, CAMERA_INFO, TRANSFORMS, SEGMENTATION)
_FRAMES_HELD = 8  # camera frames: the log's order and the steps' are nearly the same
_STAGE_COLORS = ("#4c78a8", "#72b7b2", "#bab0ac", "#f58518", "#54a24b", "#b279a2", "#e45756", "#eeca3b")


def write_report(path: Path, out: Path, on_step: Callable[[int, int], None] | None = None) -> int:
    """Tell the run whose log begins at `path` in an HTML file, and return how many steps it has.

    Of a damaged log, what can be read is shown. Pictures are made and written step by step, so that a long run takes no
    more memory than a short one; `on_step` is told how many of how many are done. `out` appears when it is complete.
    Raises `BadLog`, `OSError`.
    """
    summary = summarise(path)
    target = summary.run.target if summary.run else ""
    heads: list[StepHead] = []
    after: gi.Heightmaps | None = None  # the last step's: how the run ended
    for step in steps(path):
        heads.append(step_head(step))
        after = step.next_heightmaps
    cameras = _Cameras(path, [head.stamp_ns for head in heads], after, target)
    page = Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True).from_string(
        resources.files("grasping_invisible.data").joinpath(_TEMPLATE).read_text(encoding="utf-8")
    )
    unfinished = out.with_name(f".{out.name}.unfinished")
    try:
        with unfinished.open("w", encoding="utf-8") as file:
            file.writelines(
                page.generate(
                    title=_title(summary),
                    push_color=PUSH_COLOR,
                    grasp_color=GRASP_COLOR,
                    target=target or "the target",
                    target_color=f"rgb{RGB.get(target, RGB[GREY])}",
                    verdict=_verdict(summary),
                    good=summary.end is not None and summary.end.grasped,
                    story=_story(heads),
                    facts=_facts(summary),
                    damage=summary.damage,
                    heads=heads,
                    longest=max((head.total_ms for head in heads), default=0.0) or 1.0,
                    stage_colors=_stage_colors(heads),
                    steps=_reports(path, heads, cameras, target, on_step),
                    end=lambda: _end_panels(after, cameras, target),  # asked for after the steps
                )
            )
        unfinished.replace(out)
    finally:
        unfinished.unlink(missing_ok=True)
    return len(heads)


def _reports(
    path: Path, heads: list[StepHead], cameras: "_Cameras", target: str, on_step: Callable[[int, int], None] | None
) -> Iterator[StepReport]:
    for number, (step, head) in enumerate(zip(steps(path), heads, strict=True), 1):
        yield step_report(step, head, target, cameras.panels(head.stamp_ns, motion_of(step)))
        if on_step is not None:
            on_step(number, len(heads))


class _Cameras:
    """What the camera saw at the moments of the steps, read on through the log as it is asked for."""

    def __init__(self, path: Path, stamps: list[int], after: gi.Heightmaps | None, target: str) -> None:
        self._target = target
        wanted = stamps if after is None else [*stamps, to_ns(after.stamp)]
        self._frames = camera_frames(path, wanted, _CAMERA)
        self._read: OrderedDict[int, LoggedFrame] = OrderedDict()

    def panels(self, stamp_ns: int, motion: Motion | None) -> list[Panel]:
        """Of the frame with that stamp, with the motion drawn in; none where the log lacks it."""
        if stamp_ns not in self._read:
            self._read_on(stamp_ns)
        frame = self._read.get(stamp_ns)
        return [] if frame is None else pictures.camera_panels(frame.messages, self._target, motion)

    def _read_on(self, stamp_ns: int) -> None:
        for frame in islice(self._frames, _FRAMES_HELD):
            self._read[frame.stamp_ns] = frame
            if len(self._read) > _FRAMES_HELD:
                self._read.popitem(last=False)
            if frame.stamp_ns == stamp_ns:
                return


def _title(summary: LogSummary) -> str:
    if summary.run is None:
        return f"A run whose start is not in {shown(Path(summary.path).name)}"
    return f"Find and grasp {summary.run.target or 'the target'} in {summary.run.scene or 'an unnamed scene'}"


def _verdict(summary: LogSummary) -> str:
    if summary.end is None:
        return "the log ends before the run"
    if summary.end.grasped:
        return "grasped"
    return f"{'found, not grasped' if summary.end.found else 'not found'} ({summary.end.ended_because})"


def _facts(summary: LogSummary) -> list[tuple[str, str]]:
    facts = [("began", f"{wording.when(summary.begun_ns)} UTC")]
    facts.append(("took", wording.duration(summary.ended_ns - summary.begun_ns)))
    if summary.run is not None:
        run = summary.run
        facts += [
            ("seed", str(run.seed)),
            ("robot", run.robot or "-"),
            ("models", run.bundle_sha256[:12] or "-"),
            ("version", run.project_version or "-"),
        ]
    if summary.end is not None:
        end = summary.end
        facts.append(("motions", f"{end.motions} of {summary.run.max_motions}" if summary.run else str(end.motions)))
        facts.append(("decision", f"{end.decision_ms_p50:.0f} ms median, {end.decision_ms_p99:.0f} ms p99"))
    return [*facts, ("log", f"{shown(Path(summary.path).name)}, {wording.size(summary.bytes)}")]


def _end_panels(after: gi.Heightmaps | None, cameras: _Cameras, target: str) -> list[Panel]:
    """What was seen when the run ended."""
    if after is None:
        return []
    maps = decoded(after, decode_heightmaps)
    above = [] if maps is None else pictures.map_panels(maps, target, None)[:2]
    return [*cameras.panels(to_ns(after.stamp), None), *above]


def _story(heads: list[StepHead]) -> str:
    """The run in two sentences."""
    if not heads:
        return ""
    first = next((head.number for head in heads if head.found), None)
    if heads[0].policy != EXPLORER:
        seen = "The target was in view from the start."
    elif first is None:
        seen = "The target never came to light."
    else:
        seen = f"The target first came to light after step {first}."
    counts = Counter((head.policy, head.motion) for head in heads).items()
    motions = ", ".join(f"{count} {_plural(motion, count)} by the {policy}" for (policy, motion), count in counts)
    return f"{seen} {motions[0].upper()}{motions[1:]}."


def _plural(motion: str, count: int) -> str:
    return motion if count == 1 else f"{motion}es" if motion.endswith("sh") else f"{motion}s"


def _stage_colors(heads: list[StepHead]) -> dict[str, str]:
    names = dict.fromkeys(stage.name for head in heads for stage in head.stages)
    return dict(zip(names, cycle(_STAGE_COLORS), strict=False))
