"""A run as one HTML file that needs nothing else: what was seen, what was chosen from, and what came of it."""

from importlib import resources
from itertools import cycle
from pathlib import Path

from jinja2 import Environment

from grasping_invisible.data import report_pictures as pictures
from grasping_invisible.data.camera_frames import camera_frames
from grasping_invisible.data.classes import GREY, RGB
from grasping_invisible.data.clock import to_ns
from grasping_invisible.data.heightmap_message import decode_heightmaps
from grasping_invisible.data.log_commands import wording
from grasping_invisible.data.log_summary import LogSummary, summarise
from grasping_invisible.data.report_pictures import Motion, Panel
from grasping_invisible.data.report_steps import StepReport, decoded, motion_of, step_report, total_ms
from grasping_invisible.data.steps import LoggedStep, steps
from grasping_invisible.data.topics import CAMERA_INFO, COLOR_IMAGE, SEGMENTATION, TRANSFORMS

_TEMPLATE = "report.html"
_CAMERA = (COLOR_IMAGE, CAMERA_INFO, TRANSFORMS, SEGMENTATION)
_STAGE_COLORS = ("#4c78a8", "#72b7b2", "#bab0ac", "#f58518", "#54a24b", "#b279a2", "#e45756", "#eeca3b")


def write_report(path: Path, out: Path) -> int:
    """Tell the run whose log begins at `path` in an HTML file, and return how many steps it has.

    Of a damaged log, what can be read is shown. Raises `BadLog`, `OSError`.
    """
    summary = summarise(path)
    target = summary.run.target if summary.run else ""
    logged = list(steps(path))
    cameras = _camera_panels(path, logged, target)
    longest = max((total_ms(step.decision) for step in logged), default=0.0)
    reports = [step_report(step, target, cameras, longest) for step in logged]
    page = Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True).from_string(
        resources.files("grasping_invisible.data").joinpath(_TEMPLATE).read_text(encoding="utf-8")
    )
    text = page.render(
        title=_title(summary),
        target_color=f"rgb{RGB.get(target, RGB[GREY])}",
        verdict=_verdict(summary),
        good=summary.end is not None and summary.end.grasped,
        facts=_facts(summary),
        damage=summary.damage,
        steps=reports,
        stage_colors=_stage_colors(reports),
        end=_end_panels(logged, cameras, target),
    )
    out.write_text(text, encoding="utf-8")
    return len(reports)


def _title(summary: LogSummary) -> str:
    if summary.run is None:
        return f"A run whose start is not in {Path(summary.path).name}"
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
    return [*facts, ("log", f"{Path(summary.path).name}, {wording.size(summary.bytes)}")]


def _camera_panels(path: Path, logged: list[LoggedStep], target: str) -> dict[int, list[Panel]]:
    """By stamp, of the frames that decisions were made from and of the last one."""
    motions: dict[int, Motion | None] = {to_ns(step.decision.frame_stamp): motion_of(step) for step in logged}
    if logged and (after := logged[-1].next_heightmaps) is not None:
        motions.setdefault(to_ns(after.stamp), None)
    return {
        frame.stamp_ns: pictures.camera_panels(frame.messages, target, motions[frame.stamp_ns])
        for frame in camera_frames(path, motions, _CAMERA)
    }


def _end_panels(logged: list[LoggedStep], cameras: dict[int, list[Panel]], target: str) -> list[Panel]:
    """What the camera saw when the run ended."""
    after = logged[-1].next_heightmaps if logged else None
    if after is None:
        return []
    maps = decoded(after, decode_heightmaps)
    above = [] if maps is None else pictures.map_panels(maps, target, None)[:2]
    return [*cameras.get(to_ns(after.stamp), []), *above]


def _stage_colors(reports: list[StepReport]) -> dict[str, str]:
    names = dict.fromkeys(stage.name for report in reports for stage in report.stages)
    return dict(zip(names, cycle(_STAGE_COLORS), strict=False))
