import base64
import json
import os
import re
import select
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

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
    assert re.findall(r'alt="step 1: (Clutter prior|Posterior|Failure likelihood)', first + second)[:3] == [
        "Clutter prior",
        "Failure likelihood",
        "Posterior",
    ]
    for part, name in ((first, "Posterior"), (second, "Grasp Q, ")):
        (chosen,) = re.findall(r'<figure class="chosen">\s*<img [^>]* alt="step \d: ([^"]+); chosen from"', part)
        assert chosen.startswith(name)
    assert "Not in this log" not in first + second


class Browser:
    """A headless Chromium that is spoken to by its DevTools protocol, over a pipe: one JSON object after the other."""

    def __init__(self, folder: Path) -> None:
        to_it, self._write = os.pipe()
        self._read, from_it = os.pipe()
        self._process = subprocess.Popen(
            [
                "bash",  # the browser reads from descriptor 3 and writes to 4
                "-c",
                f'exec "$@" 3<&{to_it} 4>&{from_it}',
                "bash",
                str(BROWSER),
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--disable-background-networking",
                "--remote-debugging-pipe",
                f"--user-data-dir={folder}",
            ],
            pass_fds=(to_it, from_it),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(to_it)
        os.close(from_it)
        self._received = b""
        self._count = 0
        self._session: dict[str, str] = {}
        self.events: list[dict[str, Any]] = []
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        self._session = {"sessionId": self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]}
        for domain in ("Page", "Network", "Log", "Runtime"):
            self.ask(f"{domain}.enable")

    def ask(self, method: str, **parameters: object) -> dict[str, Any]:
        """The result of a command; events that come before it are kept."""
        self._count += 1
        message = {"id": self._count, "method": method, "params": parameters, **self._session}
        os.write(self._write, json.dumps(message).encode() + b"\0")
        while True:
            said = self._next()
            if said.get("id") == self._count:
                return said["result"]
            self.events.append(said)

    def open(self, page: str) -> None:
        """Open a page and wait until all of it is loaded."""
        self.ask("Page.navigate", url=page)
        while not self.of("Page.loadEventFired"):
            self.events.append(self._next())

    def of(self, method: str) -> list[dict[str, Any]]:
        """The events of a kind so far."""
        return [event["params"] for event in self.events if event.get("method") == method]

    def value(self, expression: str) -> Any:
        """What a JavaScript expression is worth in the page."""
        return self.ask("Runtime.evaluate", expression=expression, returnByValue=True)["result"]["value"]

    def close(self) -> None:
        self._process.kill()
        self._process.wait()
        os.close(self._write)
        os.close(self._read)

    def _next(self) -> dict[str, Any]:
        while b"\0" not in self._received:
            assert select.select([self._read], [], [], 60)[0], "the browser does not answer"
            received = os.read(self._read, 1 << 20)
            assert received, "the browser has gone"
            self._received += received
        message, _, self._received = self._received.partition(b"\0")
        return json.loads(message)


@pytest.fixture
def browser(tmp_path: Path) -> Iterator[Browser]:
    browser = Browser(tmp_path / "browser")
    yield browser
    browser.close()


@pytest.mark.skipif(BROWSER is None, reason="no Chromium or Chrome is installed")
def test_a_browser_shows_the_report(recorded_run: Path, tmp_path: Path, browser: Browser) -> None:
    report = tmp_path / "report.html"
    assert main(["report", str(recorded_run), "--out", str(report)]) == 0
    browser.open(report.as_uri())
    assert browser.value("document.images.length") > 50
    assert browser.value("[...document.images].filter(i => !i.complete || i.naturalWidth < 48).map(i => i.alt)") == []
    asked = {sent["request"]["url"].partition(":")[0] for sent in browser.of("Network.requestWillBeSent")}
    assert asked <= {"file", "data"}
    assert browser.of("Log.entryAdded") + browser.of("Runtime.exceptionThrown") == []
    for width in (1400, 500, 360):
        browser.ask(
            "Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=width < 800
        )
        assert browser.value("document.documentElement.scrollWidth") <= width
    shots = set()
    for scheme in ("light", "dark"):
        browser.ask("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
        picture = base64.b64decode(browser.ask("Page.captureScreenshot", format="png")["data"])
        shown = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_GRAYSCALE)
        assert shown is not None
        shots.add(int(np.median(shown)) // 128)
        assert shown.std() > 20, "most of the page is empty"
    assert shots == {0, 1}  # dark on light, and light on dark
