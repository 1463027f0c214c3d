import base64
import re
from html.parser import HTMLParser
from pathlib import Path

import cv2
import numpy as np
import pytest

from grasping_invisible.data.cli import main
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.recorder import RecordingSettings

VOID = {"meta", "img", "br"}


class Page(HTMLParser):
    """An HTML page as its text, images and ids; checks that what is opened is closed."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.open: list[str] = []
        self.words: list[str] = []
        self.images: list[tuple[str, str]] = []
        self.ids: list[str] = []
        self.classes: list[str] = []
        self.feed(path.read_text(encoding="utf-8"))
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = {name: value or "" for name, value in attrs}
        if tag == "img":
            self.images.append((values["alt"], values["src"]))
        if "id" in values:
            self.ids.append(values["id"])
        self.classes += values.get("class", "").split()
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] != "style":
            self.words.append(data.strip())

    @property
    def text(self) -> str:
        return " ".join(filter(None, self.words))


def decoded(src: str) -> np.ndarray:
    kind, data = src.split(",", 1)
    assert kind == "data:image/jpeg;base64"
    image = cv2.imdecode(np.frombuffer(base64.b64decode(data), np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    return image


@pytest.fixture
def page_of(tmp_path: Path):
    def build(log: Path) -> Page:
        assert main(["report", str(log), "--out", str(tmp_path / "report.html")]) == 0
        return Page(tmp_path / "report.html")

    return build


def test_each_step_has_its_pictures_and_words(write_run, page_of) -> None:
    page = page_of(write_run())
    assert page.ids == ["top", "step-1", "step-2", "step-3"]
    for words in (
        "Find and grasp red in pile",
        "explorer: push",
        "coordinator: grasp",
        "a test",
        "grasp would succeed",
    ):
        assert words in page.text
    names = [name for name, _ in page.images]
    for number in (1, 2, 3):
        for name in ("Camera", "Height, up to", "Target mask", "Push Q, best of 16", "Grasp Q, best of 16"):
            assert sum(said.startswith(f"step {number}: {name}") for said in names) == 1, name
        assert sum(said.startswith(f"step {number}: ") and said.endswith("°") for said in names) >= 16
    assert sum("Afterwards" in name for name in names) == 2  # nothing was seen after the last
    assert names.count("step 3: Grasp Q, 90°; chosen from") == 1


def test_the_run_is_summed_up(write_run, page_of) -> None:
    text = page_of(write_run()).text
    assert "The target never came to light. 2 pushes by the explorer, 1 grasp by the coordinator." in text
    assert "How to read the pictures" in text


def test_a_report_appears_only_when_it_is_complete(write_run, tmp_path: Path, monkeypatch) -> None:
    def breaks(*arguments: object) -> None:
        raise KeyboardInterrupt

    log, out = write_run(), tmp_path / "report.html"
    monkeypatch.setattr("grasping_invisible.data.report.step_report", breaks)
    assert main(["report", str(log), "--out", str(out)]) == 130
    assert list(tmp_path.iterdir()) == [log]


def test_all_pictures_open_and_nothing_is_fetched(write_run, page_of, tmp_path: Path) -> None:
    page = page_of(write_run())
    for name, src in page.images:
        assert min(decoded(src).shape[:2]) >= 48, name
    text = (tmp_path / "report.html").read_text()
    assert re.findall(r"https?:|@import|<script|<link|url\(", text) == []
    assert "default-src 'none'" in text


def test_words_from_a_log_are_words(write_run, page_of, run_of) -> None:
    messages = run_of()
    for _, message in messages:
        if isinstance(message, gi.RunStart):
            message.scene = "<script>alert(1)</script>"
    assert "<script>alert(1)</script>" in page_of(write_run(messages=messages)).text


def test_a_cut_log_is_shown_as_far_as_it_goes(write_run, page_of) -> None:
    path = write_run(settings=RecordingSettings(flush_seconds=0.0))
    whole = path.read_bytes()
    steps = set()
    for share in (0.05, 0.3, 0.6):
        path.write_bytes(whole[: int(share * len(whole))])
        page = page_of(path)
        assert "the log ends before the run" in page.text
        assert "damage" in page.classes
        steps.add(len([name for name in page.ids if name.startswith("step")]))
    assert {0, 1, 2} <= steps


def test_numbers_that_make_no_sense_draw_nothing(write_run, page_of, run_of) -> None:
    messages = run_of()
    for _, message in messages:
        if isinstance(message, gi.Decision):
            message.position.x, message.yaw, message.rotation = float("nan"), float("inf"), 99
        elif isinstance(message, gi.Heightmaps):
            message.resolution = 0.0
    page = page_of(write_run(messages=messages))
    assert page.text.count("Not in this log: Q maps") == 3


@pytest.mark.parametrize("place", [float("inf"), float("nan"), 1e300])
def test_a_workspace_beyond_all_measure_draws_no_motion(write_run, page_of, run_of, place: float) -> None:
    messages = run_of()
    for _, message in messages:
        if isinstance(message, gi.Heightmaps):
            message.origin.y = place
    assert page_of(write_run(messages=messages)).text.count("Target mask") == 3


def test_an_output_that_cannot_be_written_is_code_2(write_run, tmp_path: Path, capsys) -> None:
    log = write_run()
    before = log.read_bytes()
    assert main(["report", str(log), "--out", str(log)]) == 2
    assert main(["report", str(log), "--out", str(tmp_path / "none" / "report.html")]) == 2
    assert main(["report", str(tmp_path / "no.mcap"), "--out", str(tmp_path / "report.html")]) == 2
    assert capsys.readouterr().err.count("\n") == 3
    assert log.read_bytes() == before
