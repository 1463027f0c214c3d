from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage

from grasping_invisible.data.images import encode_color
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.recorder import Recorder
from grasping_invisible.data.topics import COLOR_IMAGE
from grasping_invisible.training.failed_runs import Cause, Failure, failure_of
from grasping_invisible.training.failure_report import draw_failures, failure_tables


def runs_of(steps):
    blocked, beside = steps.step(gi.GRASP, status=gi.BLOCKED), steps.step(gi.GRASP)
    made = [
        steps.run(blocked, blocked, beside),
        steps.run(blocked),
        steps.run(beside),
        steps.run(blocked, ended="grasped"),
    ]
    return [(run, failure_of(run)) for run in made]


def test_causes_and_motions_are_counted_for_each_suite_and_method(steps):
    assert failure_tables(runs_of(steps)) == (
        "## invisible: explorer, coordinator\n\n"
        "3 of 4 runs failed.\n\n"
        "| cause | runs | for example |\n|---|---|---|\n"
        "| a grasp's fingers met a neighbour | 2 | exploration-00, seed 4 |\n"
        "| a grasp closed beside the target | 1 | exploration-00, seed 4 |\n\n"
        "| of their 5 motions | how many |\n|---|---|\n"
        "| a grasp's fingers met a neighbour | 3 |\n"
        "| a grasp closed beside the target | 2 |\n"
    )


def test_runs_of_two_bundles_are_counted_apart(steps):
    of_bundles = []
    for bundle in ("", "a" * 64):
        start = gi.RunStart()
        start.CopyFrom(steps.start)
        start.bundle_sha256 = bundle
        of_bundles += [(replace(run, start=start), failure) for run, failure in runs_of(steps)[len(of_bundles) // 4 :]]
    headings = [line for line in failure_tables(of_bundles).splitlines() if line.startswith("## ") or "failed" in line]
    assert headings == [
        "## invisible: explorer, coordinator, bundle unknown",
        "3 of 4 runs failed.",
        "## invisible: explorer, coordinator, bundle aaaaaaaaaaaa",
        "2 of 3 runs failed.",
    ]


def test_a_bar_in_a_scenes_name_ends_no_cell(steps):
    steps.start.scene = "a|b"
    assert "| 2 | a\\|b, seed 4 |" in failure_tables(runs_of(steps))


def test_the_sheet_has_a_row_for_each_cause_and_is_the_same_again(steps, tmp_path: Path):
    steps.path = tmp_path / "run.mcap"
    with Recorder(steps.path) as recorder:
        picture = encode_color(np.full((48, 64, 3), 90, np.uint8), 0)
        recorder.put(COLOR_IMAGE, picture.SerializeToString(), 0)
    failures = [failure for _, failure in runs_of(steps) if failure is not None]
    draw_failures(failures, tmp_path / "two.png")
    draw_failures(failures[:1], tmp_path / "one.png")
    draw_failures(failures, tmp_path / "again.png")
    assert (tmp_path / "two.png").read_bytes() == (tmp_path / "again.png").read_bytes()
    two, one = (cv2.imread(str(tmp_path / f"{name}.png")) for name in ("two", "one"))
    assert two is not None
    assert one is not None
    assert two.shape[0] == 2 * one.shape[0]


def test_a_damaged_picture_ends_no_sheet(steps, tmp_path: Path):
    steps.path = tmp_path / "run.mcap"
    with Recorder(steps.path) as recorder:
        recorder.put(COLOR_IMAGE, CompressedImage(data=b"damaged").SerializeToString(), 0)
    damaged = gi.Heightmaps(rows=224, columns=224, color_png=b"damaged")
    step = replace(steps.step(gi.PUSH), heightmaps=damaged, next_heightmaps=damaged)
    draw_failures([Failure(steps.run(step), Cause.ROBOT, step)], tmp_path / "sheet.png")
    assert (tmp_path / "sheet.png").exists()


def test_no_failure_makes_no_sheet(tmp_path: Path):
    draw_failures([], tmp_path / "none.png")
    assert not (tmp_path / "none.png").exists()
