import json
import re
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest

from grasping_invisible.data.dataset.cli import main

PROJECT = Path(__file__).parents[3]


def refusal(capsys, *arguments: object) -> str:
    assert main([str(argument) for argument in arguments]) == 2
    said = capsys.readouterr().err
    assert said.startswith("gi-dataset: ")
    assert said.count("\n") == 1
    return said


def test_rebuild_says_what_it_did(write_practice, tmp_path: Path, capsys) -> None:
    write_practice("a", 1)
    write_practice("b", 2).write_bytes(b"junk")
    command = ["rebuild", str(tmp_path), "--out", str(tmp_path / "ds"), "--workers", "1"]
    assert main(command) == 0
    said = capsys.readouterr().out
    assert "left out: b.mcap: " in said
    assert "1 of 2 logs read" in said
    assert "1 logs left out" in said
    assert "3 rows in" in said
    assert main([*command, "--strict"]) == 1


def test_the_counts_of_a_rebuild_add_up_to_the_logs_given(write_practice, tmp_path: Path, capsys) -> None:
    log = write_practice("a", 1)
    command = ["rebuild", str(tmp_path), "--out", str(tmp_path / "ds"), "--workers", "1"]
    assert main(command) == 0
    other = write_practice("b", 2)
    for name in ("c", "d"):
        shutil.copy(other, tmp_path / f"{name}.mcap")
    log.with_name("junk.mcap").write_bytes(b"junk")
    capsys.readouterr()
    assert main(command) == 0
    said = capsys.readouterr().out
    assert "3 of 5 logs read" in said
    assert "1 known from before; 1 logs left out" in said


def test_info(dataset: Path, capsys) -> None:
    assert main(["info", str(dataset), "--json"]) == 0
    info = json.loads(capsys.readouterr().out)
    assert (info["rows"], info["runs"], info["logs"], info["copies"]) == (36, 12, 12, 0)
    train, validation = info["splits"]["train"], info["splits"]["validation"]
    assert train["rows"] + validation["rows"] == 36
    assert train["outcomes"]["grasp"]["target grasped"] == train["runs"] > validation["runs"] > 0
    pushes = train["runs"] * 2
    assert train["outcomes"]["push"] == {"completed": pushes, "motions": pushes, "reward 0.25": pushes}
    assert main(["info", str(dataset)]) == 0
    said = capsys.readouterr().out
    assert info["sha256"] in said
    assert "grasp: target grasped" in said


def test_check_ends_with_its_finding(dataset: Path, capsys) -> None:
    assert main(["check", str(dataset)]) == 0
    next(dataset.rglob("*.parquet")).unlink()
    assert main(["check", str(dataset)]) == 1
    assert "is missing" in capsys.readouterr().out


def test_sample_draws_rows_that_fit(dataset: Path, tmp_path: Path, capsys) -> None:
    out = tmp_path / "sample.png"
    where = ["--where", "kind=grasp", "--where", "success=true", "--split", "train"]
    assert main(["sample", str(dataset), "--out", str(out), "--count", "2", *where]) == 0
    assert "2 rows in" in capsys.readouterr().out
    picture = cv2.imread(str(out))
    assert picture is not None
    first = picture.copy()
    red = (picture == (30, 36, 222)).all(axis=2)  # the target, in the order blue, green, red
    assert np.count_nonzero(red) > 1000
    assert main(["sample", str(dataset), "--out", str(out), "--count", "2", *where]) == 0
    again = cv2.imread(str(out))
    assert again is not None
    np.testing.assert_array_equal(first, again)


def test_bad_requests_are_one_line(dataset: Path, tmp_path: Path, capsys) -> None:
    out = ("--out", tmp_path / "x.png")
    assert "it holds no manifest.json" in refusal(capsys, "info", tmp_path)
    assert "there is no such folder" in refusal(capsys, "check", tmp_path / "none")
    assert "not COLUMN=VALUE with one of" in refusal(capsys, "sample", dataset, *out, "--where", "color=red")
    assert "no row of" in refusal(capsys, "sample", dataset, *out, "--where", "kind=home")
    assert "--count must be" in refusal(capsys, "sample", dataset, *out, "--count", "0")
    assert "--seed must be 0 or more, not -1" in refusal(capsys, "sample", dataset, *out, "--seed", "-1")
    assert "must be a .png file" in refusal(capsys, "sample", dataset, "--out", "x.txt")
    assert "no .mcap logs in" in refusal(capsys, "rebuild", dataset, "--out", tmp_path / "other")
    assert "does not exist" in refusal(capsys, "rebuild", tmp_path / "none", "--out", tmp_path / "other")
    (tmp_path / "a.mcap").touch()
    assert r"ds\xff is no text" in refusal(capsys, "rebuild", tmp_path, "--out", tmp_path / "ds\udcff")
    assert "--workers must be" in refusal(capsys, "rebuild", tmp_path, "--out", tmp_path / "other", "--workers", "0")
    (dataset / "manifest.json").write_text("{")
    assert "manifest.json is not valid" in refusal(capsys, "info", dataset)
    (dataset / "manifest.json").write_text('{"format": 99}')
    assert "manifest.json is not valid" in refusal(capsys, "info", dataset)


def test_the_document_lists_commands_columns_and_exit_codes(capsys) -> None:
    from grasping_invisible.data.dataset.schema import SCHEMA

    with pytest.raises(SystemExit):
        main(["--help"])
    usage = capsys.readouterr().out
    document = (PROJECT / "docs" / "datasets.md").read_text()
    documented = re.findall(r"^\| `gi-dataset (\w+)", document, re.MULTILINE)
    assert documented == re.findall(r"^    (\w+) {2,}", usage, re.MULTILINE)
    codes = usage.partition("exit codes:")[2]
    assert re.findall(r"^\| (\d+) \|", document, re.MULTILINE) == re.findall(r"\b\d+\b", codes)
    columns = re.findall(r"^\| ((?:`\w+`(?:, )?)+) \|", document, re.MULTILINE)
    assert {name for cell in columns for name in re.findall(r"\w+", cell)} == set(SCHEMA.names)
