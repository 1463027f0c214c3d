import json
import random
import re
import subprocess
import sys
from pathlib import Path

import cv2
import pytest

from grasping_invisible.data.cli import main
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.recorder import LOST, Recorder, RecordingSettings
from grasping_invisible.data.topics import ROBOT_HEALTH

PER_MESSAGE = RecordingSettings(flush_seconds=0.0)


def test_info_says_what_a_log_is(write_run, capsys) -> None:
    assert main(["info", str(write_run())]) == 0
    said = capsys.readouterr().out
    for word in ("run-1", "grasped", "pile, seed 7", "complete", "gi/runtime/decision"):
        assert word in said


def test_info_as_json(write_run, capsys) -> None:
    path = write_run()
    assert main(["info", "--json", str(path)]) == 0
    info = json.loads(capsys.readouterr().out)
    assert info["path"] == str(path)
    assert info["complete"] is True
    assert info["outcome"] == "grasped"
    assert info["run"]["target"] == "red"
    assert info["end"]["motions"] == 3
    assert info["topics"]["gi/runtime/decision"] == {"type": "grasping_invisible.v1.Decision", "messages": 3}
    assert info["bytes"] == path.stat().st_size
    assert info["ended_ns"] >= info["begun_ns"] > 0


def test_info_of_a_cut_log_counts_what_is_there(write_run, capsys) -> None:
    path = write_run(settings=PER_MESSAGE)
    path.write_bytes(path.read_bytes()[:30_000])
    assert main(["info", "--json", str(path)]) == 0
    info = json.loads(capsys.readouterr().out)
    assert (info["complete"], info["outcome"], info["end"]) == (False, "unfinished", None)
    assert info["topics"]["gi/runtime/start"]["messages"] == 1
    assert info["damage"]


@pytest.fixture
def folder(write_run, run_of, tmp_path: Path) -> Path:
    """One grasped red run, one blue run that spent its budget, one file that is no log."""
    write_run("red.mcap")
    blue = run_of()
    for _, message in blue:
        if isinstance(message, gi.RunStart):
            message.target_color, message.bundle_sha256 = "blue", "cd" * 32
        elif isinstance(message, gi.RunSummary):
            message.grasped, message.ended_because = False, "budget"
    write_run("blue.mcap", messages=blue)
    (tmp_path / "junk.mcap").write_bytes(b"junk")
    return tmp_path


@pytest.mark.parametrize(
    ("filters", "names"),
    [
        ([], {"red", "blue"}),
        (["--outcome", "grasped"], {"red"}),
        (["--outcome", "budget"], {"blue"}),
        (["--target", "blue"], {"blue"}),
        (["--bundle", "abab"], {"red"}),
        (["--since", "2020-01-01"], {"red", "blue"}),
        (["--since", "2999-01-01T12:00"], set()),
        (["--until", "2020-01-01"], set()),
        (["--until", "2999-01-01", "--target", "red"], {"red"}),
    ],
)
def test_ls_lists_what_passes_its_filters(folder: Path, capsys, filters: list[str], names: set[str]) -> None:
    assert main(["ls", str(folder), *filters]) == 0
    said = capsys.readouterr().out
    assert {name for name in ("red", "blue") if f"{name}.mcap" in said} == names
    assert f"{len(names)} logs" in said
    assert "junk.mcap is not an MCAP log" in said


def test_ls_shows_the_parts_of_a_log_as_one(write_run, tmp_path: Path, capsys) -> None:
    write_run(steps=12, settings=RecordingSettings(part_bytes=20_000, flush_seconds=0.0))
    assert (tmp_path / "run.001.mcap").exists()
    assert main(["ls", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "1 logs" in said
    assert "run.001" not in said
    assert "grasped" in said


def test_show_tells_the_story_in_order(write_run, capsys) -> None:
    assert main(["show", str(write_run())]) == 0
    said = capsys.readouterr().out
    beats = [
        "find and grasp red in pile",
        "explorer: push",
        "the scene changed",
        "coordinator: grasp",
        "after 3 motions",
    ]
    places = [said.find(beat) for beat in beats]
    assert -1 not in places
    assert places == sorted(places)


def test_show_of_a_cut_log_ends_where_it_ends(write_run, capsys) -> None:
    path = write_run(settings=PER_MESSAGE)
    path.write_bytes(path.read_bytes()[:40_000])
    assert main(["show", str(path)]) == 0
    assert "the log ends before the run does" in capsys.readouterr().out


def test_frames_writes_images_that_open(write_run, tmp_path: Path) -> None:
    out = tmp_path / "images"
    assert main(["frames", str(write_run()), "--out", str(out)]) == 0
    assert len(list(out.glob("*_color.png"))) == 6  # of the camera and of the heightmaps
    depth = cv2.imread(str(next(out.glob("*_depth.png"))), cv2.IMREAD_UNCHANGED)
    assert depth is not None
    assert depth.dtype.name == "uint16"
    assert 500 <= depth.min() <= depth.max() <= 900


def test_frames_of_one_kind(write_run, tmp_path: Path) -> None:
    out = tmp_path / "images"
    assert main(["frames", str(write_run()), "--out", str(out), "--only", "segmentation"]) == 0
    assert len(list(out.iterdir())) == len(list(out.glob("*_segmentation.png"))) == 3


def test_check_ends_with_its_finding(write_run, capsys) -> None:
    path = write_run()
    assert main(["check", str(path)]) == 0
    path.write_bytes(path.read_bytes()[:-20])
    assert main(["check", str(path)]) == 1
    assert "index at the end is damaged or missing" in capsys.readouterr().out


def test_recover_says_what_was_lost(write_run, tmp_path: Path, capsys) -> None:
    path = write_run(settings=PER_MESSAGE)
    path.write_bytes(path.read_bytes()[:40_000])
    assert main(["recover", str(path), "--out", str(tmp_path / "good.mcap")]) == 0
    said = capsys.readouterr().out
    assert "messages written to" in said
    assert "lost: nothing readable from byte" in said


@pytest.mark.parametrize("command", ["info", "show", "check"])
@pytest.mark.parametrize(
    ("name", "what"), [("no.mcap", "No such file"), ("junk.mcap", "not an MCAP"), (".", "director")]
)
def test_what_cannot_be_read_is_one_line_and_code_2(folder: Path, capsys, command: str, name: str, what: str) -> None:
    assert main([command, str(folder / name)]) == 2
    said = capsys.readouterr().err
    assert said.startswith("gi-log: ")
    assert what in said
    assert said.count("\n") == 1


def test_an_output_that_cannot_be_written_is_code_2(write_run, tmp_path: Path, capsys) -> None:
    (tmp_path / "file").touch()
    assert main(["frames", str(write_run()), "--out", str(tmp_path / "file")]) == 2
    assert main(["recover", str(write_run("b.mcap")), "--out", str(tmp_path / "file")]) == 2
    assert main(["ls", str(tmp_path / "none")]) == 2
    assert capsys.readouterr().err.count("\n") == 3


@pytest.mark.parametrize("arguments", [[], ["nothing"], ["ls", ".", "--since", "soon"], ["recover", "a.mcap"]])
def test_bad_usage_is_code_2(arguments: list[str], capsys) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    assert "usage: gi-log" in capsys.readouterr().err


def test_a_reader_that_leaves_is_no_error(write_run) -> None:
    command = f"'{sys.executable}' -m grasping_invisible.data.cli show '{write_run(steps=60)}' | head -1"
    done = subprocess.run(
        ["bash", "-o", "pipefail", "-c", command], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.stderr == ""
    assert done.stdout.count("\n") == 1


def test_no_damage_makes_a_command_fail_otherwise(write_run, tmp_path: Path) -> None:
    data = write_run(settings=PER_MESSAGE).read_bytes()
    rng = random.Random(11)
    damaged, out = tmp_path / "damaged.mcap", tmp_path / "out.mcap"
    for _ in range(25):
        content = bytearray(data)
        for _ in range(rng.randrange(1, 30)):
            content[rng.randrange(len(content))] = rng.randrange(256)
        damaged.write_bytes(content[: rng.randrange(len(content))] if rng.random() < 0.5 else content)
        for command in ("info", "show", "check"):
            assert main([command, str(damaged)]) in (0, 1, 2)
        assert main(["frames", str(damaged), "--out", str(tmp_path / "images")]) in (0, 2)
        assert main(["recover", str(damaged), "--out", str(out)]) in (0, 2)
        out.unlink(missing_ok=True)


def test_an_interrupt_is_code_130(write_run, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(path: Path) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("grasping_invisible.data.log_commands.info.summarise", interrupted)
    assert main(["info", str(write_run())]) == 130


def test_the_document_lists_the_commands_and_exit_codes(capsys) -> None:
    with pytest.raises(SystemExit):
        main(["--help"])
    usage = capsys.readouterr().out
    document = (Path(__file__).parents[2] / "docs" / "logs.md").read_text()
    documented = re.findall(r"^\| `gi-log (\w+)", document, re.MULTILINE)
    assert documented == re.findall(r"^    (\w+) {2,}", usage, re.MULTILINE)
    assert re.findall(r"^\| (\d+) \|", document, re.MULTILINE) == re.findall(r"\d+", usage.partition("exit codes:")[2])


def test_info_tells_what_was_lost_and_how_the_robot_was(write_run, run_of, tmp_path: Path, capsys) -> None:
    trouble = gi.RobotHealth(state=gi.ROBOT_FAULT, detail="a cable came loose")
    with Recorder(tmp_path / "run.mcap") as recorder:
        for topic, message in [*run_of(), (ROBOT_HEALTH, trouble)]:
            recorder.put(topic, message.SerializeToString(), 0)
        recorder.add_metadata(LOST, {"gi/robot/camera/color": "12"})
    assert main(["info", str(recorder.path)]) == 0
    said = capsys.readouterr().out
    (line,) = [line for line in said.splitlines() if "gi/robot/camera/color" in line]
    assert " 12 " in line
    assert "the robot was at fault: a cable came loose" in said
    assert main(["info", "--json", str(recorder.path)]) == 0
    info = json.loads(capsys.readouterr().out)
    assert info["lost"] == {"gi/robot/camera/color": 12}
    assert info["health"][0].endswith("a cable came loose")
    assert main(["check", str(recorder.path)]) == 0
    assert "a cable came loose" in capsys.readouterr().out
