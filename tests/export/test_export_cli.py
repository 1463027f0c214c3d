from pathlib import Path

import pytest

from grasping_invisible.export.cli import main


def test_missing_checkpoints_are_one_line_and_exit_code_2(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--checkpoints", str(tmp_path), "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert error.startswith("gi-export: no segmenter checkpoint")
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()
