import re
import shutil
import subprocess
from pathlib import Path

import cv2
import numpy as np
import pytest

from grasping_invisible.data.cli import main
from grasping_invisible.data.heightmap_message import decode_heightmaps
from grasping_invisible.data.q_map_message import decode_q_maps
from grasping_invisible.data.steps import steps
from grasping_invisible.runtime.report_maps import exploration_of

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


def test_maps_made_again_from_the_log_explain_the_decision(recorded_run: Path) -> None:
    push, grasp = steps(recorded_run)
    assert push.heightmaps is not None
    assert push.q_maps is not None
    maps, q_maps = decode_heightmaps(push.heightmaps), decode_q_maps(push.q_maps)
    made = exploration_of(maps, q_maps, push.decision)
    assert list(made) == ["clutter prior", "agnostic push", "failure likelihood", "posterior"]
    chosen = push.decision.rotation, push.decision.row, push.decision.column
    assert made["posterior"][chosen] == pytest.approx(push.decision.value, abs=0.01)
    assert exploration_of(maps, q_maps, grasp.decision) == {}


def test_a_report_shows_the_explorers_maps_and_what_was_chosen_from(recorded_run: Path, tmp_path: Path) -> None:
    assert main(["report", str(recorded_run), "--out", str(tmp_path / "report.html")]) == 0
    first, second, _ = re.split(r'id="(?:step-2|end)"', (tmp_path / "report.html").read_text())
    assert re.findall(r'alt="(Clutter prior|Posterior|Failure likelihood)"', first + second) == [
        "Clutter prior",
        "Failure likelihood",
        "Posterior",
    ]
    for part, name in ((first, "Posterior"), (second, "Grasp Q, ")):
        (chosen,) = re.findall(r'<figure class="chosen">\s*<img [^>]* alt="([^"]+)"', part)
        assert chosen.startswith(name)
    assert "Not in this log" not in first + second


@pytest.mark.skipif(BROWSER is None, reason="no browser is installed")
def test_a_browser_shows_the_report(recorded_run: Path, tmp_path: Path) -> None:
    report, picture = tmp_path / "report.html", tmp_path / "report.png"
    assert main(["report", str(recorded_run), "--out", str(report)]) == 0
    subprocess.run(
        [
            str(BROWSER),
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-background-networking",
            f"--user-data-dir={tmp_path / 'browser'}",
            "--window-size=1280,2000",
            f"--screenshot={picture}",
            report.as_uri(),
        ],
        check=True,
        capture_output=True,
        timeout=60,
    )
    shown = cv2.imread(str(picture))
    assert shown is not None
    assert shown.shape[:2] == (2000, 1280)
    # The first step's camera view stands left and its classes right of the middle: the red outline is in one of them.
    blocks = shown[: 2000 // 50 * 50].reshape(40, 50, 1280, 3).std(axis=(1, 2, 3))
    assert np.count_nonzero(blocks > 20) > 20, "most of the page is empty"
