import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from grasping_invisible.data.cli import main
from grasping_invisible.data.dataset.cli import main as gi_dataset
from grasping_invisible.data.dataset.manifest import read_manifest
from grasping_invisible.data.label_file import labels_path
from grasping_invisible.data.shown_name import shown


@pytest.fixture
def odd(write_practice) -> Path:
    """A log whose name is no UTF-8, between two others."""
    log = write_practice("c", 3)
    path = write_practice("b", 2).rename(log.with_name(os.fsdecode(b"b\xff.mcap")))
    write_practice("a", 1)
    return path


def test_a_name_is_shown_as_it_is_and_other_bytes_by_their_numbers() -> None:
    assert shown("Ärger.mcap") == "Ärger.mcap"
    assert shown(os.fsdecode(b"b\xff.mcap")) == r"b\xff.mcap"


def test_a_name_that_is_no_text_stops_no_folder(odd: Path, tmp_path: Path, capsys) -> None:
    assert main(["relabel", str(tmp_path)]) == 0
    assert "3 logs, 9 steps" in capsys.readouterr().out
    assert json.loads(labels_path(odd).read_text().splitlines()[0])["log"] == r"b\xff.mcap"
    junk = odd.with_name(os.fsdecode(b"junk\xfe.mcap"))
    junk.write_bytes(b"junk")
    command = ["rebuild", str(tmp_path), "--out", str(tmp_path / "ds"), "--workers", "1"]
    for again in ("3 of 4 logs read", "3 known from before"):
        assert gi_dataset(command) == 0
        assert again in capsys.readouterr().out
    manifest = read_manifest(tmp_path / "ds")
    assert [log.name for log in manifest.logs] == ["a.mcap", r"b\xff.mcap", "c.mcap"]
    assert [log.name for log in manifest.left_out] == [r"junk\xfe.mcap"]


def test_every_command_takes_a_log_whose_name_is_no_text(odd: Path, tmp_path: Path, capsys) -> None:
    out = tmp_path / "out"
    for arguments in (["info"], ["info", "--json"], ["show"], ["check"], ["report", "--out", f"{out}.html"]):
        assert main([arguments[0], str(odd), *arguments[1:]]) in (0, 1)
    assert main(["recover", str(odd), "--out", f"{out}.mcap"]) == 0
    assert main(["check", f"{out}.mcap"]) == 0
    assert r"from: b\xff.mcap" in capsys.readouterr().out


def test_such_a_name_is_printed(odd: Path) -> None:
    command = [sys.executable, "-m", "grasping_invisible.data.cli", "ls", odd.parent]
    strict = {**os.environ, "PYTHONIOENCODING": "utf-8:strict"}
    done = subprocess.run(command, capture_output=True, text=True, env=strict, timeout=60, check=True)
    assert "3 logs" in done.stdout
    assert r"b\xff.mcap" in done.stdout
