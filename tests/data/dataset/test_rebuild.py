import hashlib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from rich.console import Console

from grasping_invisible.data.cli import main as gi_log
from grasping_invisible.data.dataset import rebuild as rebuilding
from grasping_invisible.data.dataset.check import problems_of
from grasping_invisible.data.dataset.info import info_of
from grasping_invisible.data.dataset.manifest import BadDataset, read_manifest
from grasping_invisible.data.dataset.placement import split_of
from grasping_invisible.data.dataset.reader import Dataset
from grasping_invisible.data.dataset.rebuild import Rebuild, rebuild
from grasping_invisible.data.errors import BadRequest
from grasping_invisible.data.log_file import LogFile
from grasping_invisible.data.recorder import RecordingSettings

QUIET = Console(quiet=True)


def make(out: Path, *paths: Path, workers: int = 1) -> Rebuild:
    return rebuild(paths, out, workers, QUIET)


def shards(dataset: Path) -> dict[str, str]:
    """The hashes of a dataset's Parquet files by their paths."""
    return {
        path.relative_to(dataset).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in dataset.rglob("*.parquet")
    }


def correct(log: Path, step: int, value: str) -> None:
    assert gi_log(["correct", str(log), "--step", str(step), "--field", "target_grasped", "--value", value]) == 0


def test_every_motion_is_a_row_that_is_complete_in_itself(write_practice, tmp_path: Path) -> None:
    log = write_practice("a", 1)
    done = make(tmp_path / "ds", log)
    rows = list(Dataset(tmp_path / "ds").rows())
    assert [row["step"] for row in rows] == [0, 1, 2]
    last = rows[2]
    assert last["log_sha256"] == hashlib.sha256(log.read_bytes()).hexdigest()
    assert (last["run_id"], last["target"], last["kind"], last["status"]) == ("a", "red", "grasp", "completed")
    assert (last["row"], last["column"], last["q_push"], last["q_grasp"]) == (56, 40, 0.25, 0.75)
    assert (last["reward"], last["success"], last["grasp_label"], last["usable"]) == (1.0, True, True, True)
    assert last["grasp_probability"] is None
    assert [goal["goal"] for goal in last["goals"]] == ["red"]
    assert last["rules"] == done.manifest.rules
    for name in ("color", "height", "labels"):
        assert rows[0][f"after_{name}"] == rows[1][f"before_{name}"]
        assert last[f"after_{name}"].startswith(b"\x89PNG")
    assert list(problems_of(Dataset(tmp_path / "ds"))) == []


def test_neither_order_nor_workers_nor_places_show_in_the_bytes(logs: list[Path], tmp_path: Path) -> None:
    folder = logs[0].parent
    one = make(tmp_path / "one", folder)
    elsewhere = tmp_path / "elsewhere"
    shutil.copytree(folder, elsewhere)
    for log in elsewhere.iterdir():
        log.rename(log.with_name(f"other-{log.name}"))
    shuffled = sorted(elsewhere.iterdir(), key=lambda log: random.Random(log.name).random())
    two = make(tmp_path / "two", *shuffled, workers=2)
    assert shards(tmp_path / "one") == shards(tmp_path / "two") != {}
    assert one.manifest.sha256 == two.manifest.sha256
    assert one.manifest.rows == 36


def test_one_more_log_changes_one_shard_and_nothing_else_is_read(logs: list[Path], tmp_path: Path) -> None:
    *known, new = logs
    make(tmp_path / "ds", *known)
    before = shards(tmp_path / "ds")
    done = make(tmp_path / "ds", *logs)
    after = shards(tmp_path / "ds")
    assert (done.read, done.written) == (1, 1)
    assert len({path for path in after if after[path] != before.get(path)}) == 1
    make(tmp_path / "anew", *logs)
    assert after == shards(tmp_path / "anew")
    assert new.name in [log.name for log in done.manifest.logs]


def test_a_log_that_is_no_longer_given_is_no_longer_in_it(logs: list[Path], tmp_path: Path) -> None:
    make(tmp_path / "ds", *logs)
    done = make(tmp_path / "ds", *logs[3:])
    assert (done.gone, done.read) == (3, 0)
    make(tmp_path / "anew", *logs[3:])
    assert shards(tmp_path / "ds") == shards(tmp_path / "anew")


def test_nothing_new_writes_nothing(logs: list[Path], tmp_path: Path) -> None:
    make(tmp_path / "ds", *logs)
    times = {path: path.stat().st_mtime_ns for path in (tmp_path / "ds").rglob("*.parquet")}
    for log in logs:
        os.utime(log)  # touched, but the same
    done = make(tmp_path / "ds", *logs)
    assert (done.read, done.written) == (0, 0)
    assert times == {path: path.stat().st_mtime_ns for path in (tmp_path / "ds").rglob("*.parquet")}


def test_long_runs_are_cut_into_row_groups_alike_wherever_they_are_from(write_practice, tmp_path: Path) -> None:
    # One scene and seed: all in one shard.
    first, second, third = (write_practice(name, 1, 50) for name in "abc")
    make(tmp_path / "ds", first, third)
    make(tmp_path / "ds", first, second, third)
    make(tmp_path / "anew", third, second, first)
    assert shards(tmp_path / "ds") == shards(tmp_path / "anew")
    (path,) = (tmp_path / "ds").rglob("*.parquet")
    with pq.ParquetFile(path) as file:
        assert [file.metadata.row_group(group).num_rows for group in range(file.num_row_groups)] == [64, 64, 22]
        assert file.read(["run_id"])["run_id"].to_pylist() == ["a"] * 50 + ["b"] * 50 + ["c"] * 50


def test_a_correction_changes_its_rows(logs: list[Path], tmp_path: Path) -> None:
    make(tmp_path / "ds", *logs)
    before = shards(tmp_path / "ds")
    correct(logs[4], 2, "false")
    done = make(tmp_path / "ds", *logs)
    assert (done.read, done.written) == (1, 1)
    assert len(set(before.items()) - set(shards(tmp_path / "ds").items())) == 1
    (row,) = (row for row in Dataset(tmp_path / "ds").rows() if row["run_id"] == "run-04" and row["step"] == 2)
    assert (row["label_source"], row["reward"], row["success"], row["grasp_label"]) == ("human", 0.5, False, False)
    assert row["runtime_target_grasped"]
    assert row["corrections_sha256"]


def test_other_rules_label_everything_anew(logs: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    make(tmp_path / "ds", *logs)
    monkeypatch.setattr(rebuilding, "RULES", {**rebuilding.RULES, "reward": 99})
    assert make(tmp_path / "ds", *logs).read == len(logs)


def test_copies_count_once(logs: list[Path], tmp_path: Path, capsys) -> None:
    make(tmp_path / "ds", *logs)
    copy, recovered = tmp_path / "copy.mcap", tmp_path / "recovered.mcap"
    shutil.copy(logs[0], copy)
    assert gi_log(["recover", str(logs[1]), "--out", str(recovered)]) == 0
    assert recovered.read_bytes() != logs[1].read_bytes()
    done = make(tmp_path / "with", *logs, copy, recovered, logs[2], logs[2].parent)
    assert done.manifest.copies == 2
    assert done.manifest.rows == 36
    keys = [(row["run_id"], row["step"]) for row in Dataset(tmp_path / "with").rows()]
    assert len(keys) == len(set(keys))


def test_of_copies_the_corrected_one_counts(logs: list[Path], tmp_path: Path) -> None:
    copy = tmp_path / "copy.mcap"
    shutil.copy(logs[0], copy)
    correct(copy, 2, "false")
    for name, order in (("one", (logs[0], copy)), ("two", (copy, logs[0]))):
        make(tmp_path / name, *order)
        assert [row["reward"] for row in Dataset(tmp_path / name).rows()] == [0.25, 0.25, 0.5]
    assert shards(tmp_path / "one") == shards(tmp_path / "two")


def test_the_rest_of_a_copy_takes_over_when_the_log_is_gone(logs: list[Path], tmp_path: Path) -> None:
    """The copy was known but had no rows in the dataset: it is read again."""
    recovered = tmp_path / "recovered.mcap"
    assert gi_log(["recover", str(logs[0]), "--out", str(recovered)]) == 0
    make(tmp_path / "ds", *logs, recovered)
    for kept in (logs[0], recovered):
        make(tmp_path / "ds", kept, *logs[1:])
        make(tmp_path / "anew", kept, *logs[1:])
        assert shards(tmp_path / "ds") == shards(tmp_path / "anew")


def test_runs_of_the_same_name_at_other_times_are_other_runs(write_practice, tmp_path: Path) -> None:
    (tmp_path / "again").mkdir()
    first, again = write_practice("a", 1), write_practice("again/a", 1, started_ns=1_800_000_000_000_000_000)
    assert make(tmp_path / "ds", first, again).manifest.rows == 6


def test_no_run_is_on_both_sides_and_no_scene_either(write_run, practice, tmp_path: Path) -> None:
    logs = []
    for seed in range(30):  # two runs in one log, one after the other in the same scene
        messages = practice(f"{seed}-red", seed) + practice(f"{seed}-again", seed, started_ns=1_800_000_000_000_000_000)
        logs.append(write_run(f"{seed}.mcap", messages=messages))
    manifest = make(tmp_path / "ds", *logs).manifest
    sides: dict[str, set[str]] = {}
    for shard in manifest.shards:
        for run in shard.runs:
            sides.setdefault(run.run_id.partition("-")[0], set()).add(split_of(shard.path))
    assert len(sides) == 30
    assert all(len(splits) == 1 for splits in sides.values())
    assert {split for splits in sides.values() for split in splits} == {"train", "validation"}


def test_the_parts_of_a_log_are_one(write_run, practice, tmp_path: Path) -> None:
    settings = RecordingSettings(part_bytes=20_000, flush_seconds=0.0)
    log = write_run(messages=practice("long", 1, 40), settings=settings)
    assert log.with_name("run.001.mcap").exists()
    assert make(tmp_path / "ds", log.parent).manifest.rows == 40
    part = make(tmp_path / "by-part", log.with_name("run.001.mcap"))
    assert (len(part.manifest.logs), part.manifest.rows) == (1, 40)


def test_damaged_logs_are_left_out_with_their_reason(logs: list[Path], tmp_path: Path) -> None:
    cut, junk, empty, flipped, odd = logs[:5]
    cut.write_bytes(cut.read_bytes()[:-100])
    junk.write_bytes(b"junk" * 100)
    empty.write_bytes(b"")
    data = bytearray(flipped.read_bytes())
    data[len(data) // 3] ^= 0xFF
    flipped.write_bytes(data)
    (odd.parent / "run-04.corrections.csv").write_text("step,field,value\n99,exclude,true\n")
    os.mkfifo(tmp_path / "logs" / "pipe.mcap")
    with_lock = LogFile(tmp_path / "logs" / "now.mcap")
    done = make(tmp_path / "ds", logs[0].parent)
    with_lock.abandon()
    reasons = {log.name: log.reason for log in done.manifest.left_out}
    assert set(reasons) == {f"run-{seed:02d}.mcap" for seed in range(5)} | {"now.mcap", "pipe.mcap"}
    assert "gi-log recover" in reasons["run-00.mcap"]
    assert "not an MCAP log" in reasons["run-01.mcap"]
    assert "is empty" in reasons["run-02.mcap"]
    assert "no step 99" in reasons["run-04.mcap"]
    assert reasons["pipe.mcap"] == "it cannot be read: it is no regular file"
    assert reasons["now.mcap"] == "it is being written"
    assert done.manifest.rows == 21
    assert list(problems_of(Dataset(tmp_path / "ds"))) == []


def test_logs_of_one_name_are_left_out_each(logs: list[Path], tmp_path: Path) -> None:
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "junk.mcap").write_bytes(folder.encode())
    make(tmp_path / "ds", *logs, tmp_path / "a", tmp_path / "b")
    assert [log.name for log in info_of(Dataset(tmp_path / "ds")).left_out] == ["junk.mcap", "junk.mcap"]


def test_a_log_with_the_longest_name_is_taken(logs: list[Path], tmp_path: Path) -> None:
    long = logs[0].rename(logs[0].with_name(f"{'a' * 250}.mcap"))
    assert make(tmp_path / "ds", long).manifest.left_out == ()


def test_corrections_that_cannot_be_read_leave_a_known_log_out(logs: list[Path], tmp_path: Path) -> None:
    make(tmp_path / "ds", *logs)
    (logs[0].parent / "run-00.corrections.csv").mkdir()
    (left_out,) = make(tmp_path / "ds", *logs).manifest.left_out
    assert (left_out.name, left_out.reason) == ("run-00.mcap", "it cannot be read: Is a directory")


def test_without_a_usable_log_there_is_no_dataset(tmp_path: Path) -> None:
    (tmp_path / "junk.mcap").write_bytes(b"junk")
    with pytest.raises(BadRequest, match=r"no log can be used; junk\.mcap: .*not an MCAP log"):
        make(tmp_path / "ds", tmp_path)
    with pytest.raises(BadDataset):
        read_manifest(tmp_path / "ds")


def test_a_folder_with_something_else_in_it_is_left_alone(logs: list[Path], tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").touch()
    with pytest.raises(BadRequest, match=r"thesis\.txt"):
        make(tmp_path / "mine", *logs)
    assert [path.name for path in (tmp_path / "mine").iterdir()] == ["thesis.txt"]


def test_a_shard_that_was_damaged_is_made_again(logs: list[Path], tmp_path: Path) -> None:
    make(tmp_path / "ds", *logs)
    good = shards(tmp_path / "ds")
    name, other = list(good)[:2]
    (tmp_path / "ds" / name).unlink()
    (tmp_path / "ds" / other).write_bytes(b"PAR1")
    make(tmp_path / "ds", *logs)
    assert shards(tmp_path / "ds") == good


def test_a_rebuild_cut_short_anywhere_ends_as_one_that_was_not(
    logs: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make(tmp_path / "whole", *logs)
    make(tmp_path / "ds", *logs[:6])

    def cut_short(*_: object) -> None:
        raise KeyboardInterrupt

    for name in ("_write_shards", "write_manifest", "read_logs"):
        with monkeypatch.context() as patch:
            patch.setattr(rebuilding, name, cut_short)
            with pytest.raises(KeyboardInterrupt):
                make(tmp_path / "ds", *logs)
    make(tmp_path / "ds", *logs)
    assert shards(tmp_path / "ds") == shards(tmp_path / "whole")
    assert list(problems_of(Dataset(tmp_path / "ds"))) == []


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGKILL, -9)])
def test_a_signal_ends_it_and_the_same_command_goes_on(
    logs: list[Path], tmp_path: Path, number: signal.Signals, code: int
) -> None:
    out = tmp_path / "ds"
    command = [sys.executable, "-m", "grasping_invisible.data.dataset.cli", "rebuild", "--out", out, "--workers", "2"]
    process = subprocess.Popen([*command, *logs], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    while process.poll() is None and not list(out.glob(".rebuild/rows/*.json")):
        time.sleep(0.002)
    process.send_signal(number)
    _, said = process.communicate(timeout=60)
    # It may have been done by then: then there is a dataset.
    assert process.returncode == code or (out / "manifest.json").exists()
    if process.returncode == 130:
        assert said == "gi-dataset: interrupted; the same command goes on from here\n"
    make(out, *logs)
    make(tmp_path / "whole", *logs)
    assert shards(out) == shards(tmp_path / "whole")


def test_two_at_once_are_refused(logs: list[Path], tmp_path: Path) -> None:
    make(tmp_path / "ds", *logs)
    with rebuilding._work_folder(tmp_path / "ds"), pytest.raises(BadRequest, match="another gi-dataset rebuild"):
        make(tmp_path / "ds", *logs)


def test_the_manifest_tells_where_every_row_is_from(logs: list[Path], tmp_path: Path) -> None:
    make(tmp_path / "ds", *logs)
    manifest = json.loads((tmp_path / "ds" / "manifest.json").read_text())
    by_hash = {hashlib.sha256(log.read_bytes()).hexdigest(): log.name for log in logs}
    assert {log["sha256"]: log["name"] for log in manifest["logs"]} == by_hash
    for shard in manifest["shards"]:
        assert shard["sha256"] == shards(tmp_path / "ds")[shard["path"]]
        table = pq.ParquetFile(tmp_path / "ds" / shard["path"]).read(["log_sha256"])
        expected = [run["log_sha256"] for run in shard["runs"] for _ in range(run["rows"])]
        assert table["log_sha256"].to_pylist() == expected
