import os
import pty
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from grasping_invisible.data.log_commands.output import progress


def shown(log: Path, monkeypatch: pytest.MonkeyPatch, *, terminal: bool) -> bytes:
    """What progress through a log writes to stderr."""
    ours, theirs = pty.openpty() if terminal else os.pipe()
    with os.fdopen(theirs, "w") as stream:
        monkeypatch.setattr(sys, "stderr", stream)
        monkeypatch.setenv("COLUMNS", "120")
        with progress("reading", [log]) as told:
            told(1, 4)
            told(3, 4)
        stream.flush()
        os.set_blocking(ours, False)
        try:
            return b"".join(pieces(ours))
        finally:
            monkeypatch.undo()
            os.close(ours)


def pieces(descriptor: int) -> Iterator[bytes]:
    """Everything that waits there; a terminal hands over a line at a time."""
    with suppress(BlockingIOError):
        while piece := os.read(descriptor, 10_000):
            yield piece


@pytest.fixture
def long_log(tmp_path: Path) -> Path:
    path = tmp_path / "long.mcap"
    with path.open("wb") as file:
        file.truncate(1_000_000_000)  # a hole: it takes no room
    return path


def test_long_work_shows_how_far_it_is_on_a_terminal(long_log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    said = shown(long_log, monkeypatch, terminal=True)
    assert b"reading" in said
    assert b"75%" in said


def test_short_work_and_pipes_show_nothing(long_log: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    assert shown(long_log, monkeypatch, terminal=False) == b""
    short = tmp_path / "short.mcap"
    short.write_bytes(b"short")
    assert shown(short, monkeypatch, terminal=True) == b""
