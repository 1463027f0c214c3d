"""Rows of a dataset as a picture: what was seen, what was done, what came of it, and what it teaches."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import PUSH_LENGTH
from grasping_invisible.data.classes import CLASSES, RGB
from grasping_invisible.data.drawing import GRASP_COLOR, PUSH_COLOR, height_colors, outline, painted, strokes
from grasping_invisible.data.heightmap_message import decode_heights
from grasping_invisible.data.log_commands import wording
from grasping_invisible.data.png import decode_color_image, decode_plane
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.rewards import PUSH_FREED

_PANELS = ("before, and the motion", "height", "classes", "after")
_PANEL_INCHES, _TEXT_INCHES = 2.3, 3.6
_GOOD, _BAD, _DIM = "#1a7f37", "#b3261e", "#5f6670"


def draw_samples(rows: Sequence[dict[str, Any]], title: str, out: Path) -> None:
    """Draw the rows one below the other; PNG or whatever the name of `out` says. Raises `BadMessage`, `OSError`."""
    matplotlib.use("agg")
    height = _PANEL_INCHES * len(rows)
    figure = Figure((_PANEL_INCHES * len(_PANELS) + _TEXT_INCHES, height + 0.75), dpi=110, facecolor="white")
    grid = figure.add_gridspec(
        len(rows),
        len(_PANELS) + 1,
        width_ratios=[*[1.0] * len(_PANELS), _TEXT_INCHES / _PANEL_INCHES],
        left=0.012,
        right=0.995,
        bottom=0.08 / (height + 0.75),
        top=height / (height + 0.75),
        wspace=0.04,
        hspace=0.06,
    )
    figure.suptitle(title, x=0.012, y=1 - 0.12 / (height + 0.75), ha="left", va="top", fontsize=12, weight="bold")
    for index, row in enumerate(rows):
        for column, picture in enumerate(_pictures(row)):
            axes = figure.add_subplot(grid[index, column])
            _show(axes, picture, row)
            if column == 0:
                _draw_motion(axes, row)
            if index == 0:
                axes.set_title(_PANELS[column], fontsize=9, color=_DIM)
        _describe(figure.add_subplot(grid[index, len(_PANELS)]), row)
    figure.savefig(out)


def _pictures(row: dict[str, Any]) -> list[NDArray[np.uint8] | None]:
    shape = row["cells"], row["cells"]
    labels = decode_plane(row["before_labels"], np.uint8, shape)
    seen = decode_color_image(row["before_color"]).copy()
    if row["target"] in CLASSES:
        outline(seen, labels == CLASSES.index(row["target"]), RGB[row["target"]])
    heights = decode_heights(row["before_height"], shape)
    after = None if row["after_color"] is None else decode_color_image(row["after_color"])
    return [seen, height_colors(heights), painted(labels), after]


def _show(axes: Axes, picture: NDArray[np.uint8] | None, row: dict[str, Any]) -> None:
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set_edgecolor("#d0d4da")
    if picture is None:
        axes.text(0.5, 0.5, "not in the log", ha="center", va="center", fontsize=9, color=_DIM)
        return
    half = row["cells"] * row["resolution"] / 2
    x, y = row["center_x"], row["center_y"]
    axes.imshow(picture, extent=(x - half, x + half, y - half, y + half), interpolation="nearest")


def _draw_motion(axes: Axes, row: dict[str, Any]) -> None:
    kind = gi.PUSH if row["kind"] == "push" else gi.GRASP
    color = [part / 255 for part in (PUSH_COLOR if kind == gi.PUSH else GRASP_COLOR)]
    for start, end in strokes(kind, row["x"], row["y"], row["yaw"], PUSH_LENGTH):
        for ink, width in (("black", 4.0), (color, 1.8)):
            arrow = {"arrowstyle": "-|>", "color": ink, "linewidth": width, "shrinkA": 0, "shrinkB": 0}
            drawn = axes.annotate("", end, start, arrowprops=arrow, annotation_clip=False)
            if drawn.arrow_patch is not None:
                drawn.arrow_patch.set_clip_box(axes.bbox)


def _describe(axes: Axes, row: dict[str, Any]) -> None:
    axes.set_axis_off()
    said = row["status"] or "no outcome"
    lines = [
        (f"{row['kind']} at {wording.degrees(row['yaw'])}, for {row['target']}", "black", True),
        (f"{said}; {_came_of(row)}", "black", False),
        *_taught(row),
        (f"q push {row['q_push']:.2f}, q grasp {row['q_grasp']:.2f}, border {row['border_ratio']:.0%}", _DIM, False),
        (f"{row['scene'] or 'scene unknown'}, seed {row['seed']}, step {row['step']}", _DIM, False),
        (f"run {row['run_id'][:24]}, labelled by {row['label_source']}", _DIM, False),
    ]
    for index, (text, color, bold) in enumerate(lines):
        weight = "bold" if bold else "normal"
        axes.text(0.02, 0.95 - 0.125 * index, text, color=color, fontsize=8.5, va="top", weight=weight)


def _came_of(row: dict[str, Any]) -> str:
    if row["target_grasped"]:
        return "the target is in the gripper"
    if row["object_grasped"]:
        return f"took {row['grasped_color'] or 'something else'}"
    if row["kind"] == "grasp":
        return "nothing in the gripper"
    return "the clutter moved" if row["scene_changed"] else "nothing moved"


def _taught(row: dict[str, Any]) -> list[tuple[str, str, bool]]:
    """What the row teaches about each goal."""
    if not row["usable"]:
        return [(f"teaches nothing: {row['why_not']}", _BAD, False)]
    if not row["goals"]:
        return [("teaches nothing: no goal in view nearby", _DIM, False)]
    return [
        (
            f"for {goal['goal']}{' (hindsight)' if goal['hindsight'] else ''}: reward {goal['reward']:g}",
            _GOOD if goal["success"] or (row["kind"] == "push" and goal["reward"] == PUSH_FREED) else _BAD,
            True,
        )
        for goal in row["goals"][:3]
    ]
