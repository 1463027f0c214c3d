from pathlib import Path

import numpy as np
import pytest

from grasping_invisible.training.cli import main
from grasping_invisible.training.renders import HELD_OUT_SEEDS, load_pile, pile_path


def refusal(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    """The one line that a refused command ends with."""
    assert main([str(argument) for argument in arguments]) == 2
    error = capsys.readouterr().err
    assert error.startswith("gi-train: ")
    assert error.count("\n") == 1
    return error


def test_bad_input_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    empty = tmp_path / "dataset"
    empty.mkdir()
    out = ("--out", tmp_path / "checkpoints")
    assert "it holds no manifest.json" in refusal(capsys, "critic", "--dataset", empty, *out)
    assert "there is no such folder" in refusal(capsys, "critic", "--dataset", tmp_path / "nowhere", *out)
    (empty / "manifest.json").write_bytes(b"garbage" * 100)
    assert "manifest.json is not valid" in refusal(capsys, "classifier", "--dataset", empty, *out)
    assert "--steps must be at least 1" in refusal(capsys, "critic", "--dataset", empty, *out, "--steps", "0")
    assert "--seed must be 0 to 4294967295" in refusal(capsys, "critic", "--dataset", empty, *out, "--seed", "-1")
    assert "--threads must be at least 1" in refusal(capsys, "critic", "--dataset", empty, *out, "--threads", "0")
    renders = ("--renders", tmp_path / "renders", *out, "--piles", "1000", "--seed", "1000")
    assert "would train on those held out, which begin with number 1000000" in refusal(capsys, "segmenter", *renders)


@pytest.mark.parametrize("arguments", [[], ["painter"], ["critic"], ["segmenter", "--renders", "x", "--out"]])
def test_bad_usage_is_exit_code_2(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert caught.value.code == 2
    assert "Traceback" not in capsys.readouterr().err


def test_a_small_segmenter_is_trained_from_nothing_and_resumes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["segmenter", "--renders", str(tmp_path / "renders"), "--out", str(tmp_path / "out")]
    command += ["--piles", "1", "--held-out", "1", "--steps", "2", "--batch", "2", "--threads", "1"]
    assert main(command) == 0
    assert "miou" in capsys.readouterr().out
    held_out = load_pile(tmp_path / "renders", HELD_OUT_SEEDS)
    assert held_out.color.shape == (len(held_out.labels), 480, 640, 3)
    weights = (tmp_path / "out" / "segmenter.pt").read_bytes()
    assert main(command) == 0  # finished: nothing is rendered or trained again
    assert (tmp_path / "out" / "segmenter.pt").read_bytes() == weights

    assert "give --out another folder" in refusal(capsys, *command, "--piles", "2")
    assert not pile_path(tmp_path / "renders", 1).exists()

    damaged = pile_path(tmp_path / "renders", HELD_OUT_SEEDS)
    for content in (b"not one at all", damaged.read_bytes()[:5_000], b""):
        damaged.write_bytes(content)
        assert main(command) == 2
        assert "delete it" in capsys.readouterr().err


def test_renders_depend_on_their_seed_alone(tmp_path: Path) -> None:
    from grasping_invisible.sim_robot.kinematics import Kinematics
    from grasping_invisible.training.renders import render_pile

    kinematics = Kinematics()
    first, again = render_pile(5, kinematics), render_pile(5, kinematics)
    kinematics.close()
    np.testing.assert_array_equal(first.color, again.color)
    np.testing.assert_array_equal(first.labels, again.labels)
    seen = np.isfinite(first.visible)
    assert seen.any()
    assert ((first.visible[seen] >= 0) & (first.visible[seen] <= 1.1)).all()
