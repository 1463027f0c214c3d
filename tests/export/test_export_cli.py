from pathlib import Path

import pytest

from grasping_invisible.export import bundle
from grasping_invisible.export.bundle import export_checkpoints
from grasping_invisible.export.cli import main
from grasping_invisible.export.onnx_file import ParityError
from grasping_invisible.runtime.bundle import load_bundle
from grasping_invisible.training.checkpoint import SHIPPED, checkpoint_folder


def test_missing_checkpoints_are_one_line_and_exit_code_2(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--checkpoints", str(tmp_path), "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert error.startswith("gi-export: no segmenter checkpoint")
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_the_shipped_checkpoints_make_the_shipped_models(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    manifest = export_checkpoints([checkpoint_folder(SHIPPED)], tmp_path)
    shipped = load_bundle(None, threads=1).manifest
    assert {kind: model.sha256 for kind, model in manifest.models.items()} == {
        kind: model.sha256 for kind, model in shipped.models.items()
    }
    # What is not proven replaces nothing.
    monkeypatch.setattr(bundle, "PROBABILITY_TOLERANCE", -1.0)
    with pytest.raises(ParityError, match="classifier"):
        export_checkpoints([checkpoint_folder(SHIPPED)], tmp_path)
    assert load_bundle(tmp_path, threads=1).manifest == manifest
    assert {path.suffix for path in tmp_path.iterdir()} == {".onnx", ".json"}


def test_a_folder_that_gives_nothing_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    (tmp_path / "empty").mkdir()
    for folders, said in (
        ([tmp_path / "mistyped", SHIPPED], "mistyped gives no model: there is no such folder"),
        (
            [tmp_path / "empty", SHIPPED],
            "empty gives no model: it holds none of segmenter.pt, critic.pt",
        ),
        ([SHIPPED, checkpoint_folder(SHIPPED) / ".." / "checkpoints"], "the folders before it hold all that it has"),
    ):
        assert main(["--checkpoints", *map(str, folders), "--out", str(out)]) == 2
        assert said in capsys.readouterr().err
        assert not out.exists()


def test_the_first_folder_that_holds_a_model_gives_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "critic.pt").write_bytes(b"no checkpoint")
    assert main(["--checkpoints", str(tmp_path), SHIPPED, "--out", str(tmp_path / "out")]) == 2
    assert str(tmp_path / "critic.pt") in capsys.readouterr().err
