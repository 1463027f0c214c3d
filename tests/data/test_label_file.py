import json
from pathlib import Path

import pytest

from grasping_invisible.data.cli import main
from grasping_invisible.data.label_file import labels_path
from grasping_invisible.data.labels import RULES


def relabel(*paths: Path, code: int = 0) -> None:
    assert main(["relabel", *map(str, paths)]) == code


def lines(log: Path) -> list[dict]:
    return [json.loads(line) for line in labels_path(log).read_text().splitlines()]


def test_labels_lie_beside_the_log_and_leave_it_alone(write_practice, capsys) -> None:
    log = write_practice("a", 1)
    before = log.read_bytes()
    relabel(log)
    assert log.read_bytes() == before
    head, *steps = lines(log)
    assert (head["log"], head["rules"], head["corrections_sha256"]) == ("a.mcap", RULES, "")
    assert [line["label"]["step"] for line in steps] == [0, 1, 2]
    assert {line["run_id"] for line in steps} == {"a"}
    assert [line["label"]["goals"][0]["reward"] for line in steps] == [0.25, 0.25, 1.0]
    assert steps[2]["label"]["grasp"] == {
        "color": "red",
        "object_grasped": True,
        "source": "rule",
        "target_grasped": True,
    }
    said = capsys.readouterr().out
    assert "1 logs, 3 steps, 3 of them teach" in said
    assert "reward 1" in said


def test_a_correction_changes_the_labels_and_that_is_told(write_practice, capsys) -> None:
    log = write_practice("a", 1)
    relabel(log)
    correct = ["correct", str(log), "--step", "2", "--field", "target_grasped", "--value", "false", "--by", "Ada"]
    assert main(correct) == 0
    capsys.readouterr()
    relabel(log.parent)
    said = capsys.readouterr().out
    assert "step 2: the runtime judged the target grasped, a human says not grasped" in said
    assert "other labels than before: classifier in 1, goals in 1, grasp in 1" in said
    assert "1 steps by people's corrections" in said
    head, *_, last = lines(log)
    assert head["corrections_sha256"]
    assert (last["label"]["grasp"]["source"], last["label"]["goals"][0]["reward"]) == ("human", 0.5)
    assert last["label"]["classifier"]["grasp"] is False


def test_labelling_again_tells_of_no_change(write_practice, capsys) -> None:
    log = write_practice("a", 1)
    relabel(log)
    before = labels_path(log).read_bytes()
    capsys.readouterr()
    relabel(log)
    assert labels_path(log).read_bytes() == before
    assert "other labels" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--step", "9", "--field", "exclude", "--value", "true"], "no step 9; the log holds steps 0 to 2"),
        (["--step", "0", "--field", "grasped", "--value", "true"], "unknown field 'grasped'; there are"),
        (["--step", "0", "--field", "exclude", "--value", "perhaps"], "exclude cannot be 'perhaps'"),
        (["--step", "0", "--field", "grasped_color", "--value", "red"], "step 0 is a push"),
        (["--step", "0", "--field", "exclude", "--value", "true", "--run", "b"], "no run 'b'; the log holds a"),
    ],
)
def test_a_wrong_correction_is_refused_and_not_kept(write_practice, capsys, arguments, complaint) -> None:
    log = write_practice("a", 1)
    assert main(["correct", str(log), *arguments]) == 2
    said = capsys.readouterr().err
    assert complaint in said
    assert said.count("\n") == 1
    assert [path.name for path in log.parent.iterdir()] == ["a.mcap"]


def test_a_log_that_cannot_be_labelled_does_not_keep_the_others_from_it(write_practice, capsys) -> None:
    good, junk, odd = write_practice("a", 1), write_practice("b", 2), write_practice("c", 3)
    junk.write_bytes(b"junk")
    relabel(odd)
    kept = labels_path(odd).read_bytes()
    (odd.parent / "c.corrections.csv").write_text("step,field,value\n7,exclude,true\n")
    relabel(good.parent, code=1)
    said = capsys.readouterr().out
    assert "b.mcap is not an MCAP log" in said
    assert "no step 7" in said
    assert len(lines(good)) == 4
    assert not labels_path(junk).exists()
    assert labels_path(odd).read_bytes() == kept


def test_files_that_cannot_be_read_or_written_leave_one_log_out(write_practice, capsys) -> None:
    good, taken, odd, long = (write_practice(name, 1) for name in "dbca")
    long = long.rename(long.with_name(f"{'a' * 250}.mcap"))
    labels_path(taken).mkdir()
    (odd.parent / "c.corrections.csv").mkdir()
    relabel(good.parent, code=1)
    said = capsys.readouterr().out
    assert "1 logs, 3 steps" in said
    assert "b.labels.jsonl: Is a directory" in said
    assert "c.corrections.csv: Is a directory" in said
    assert f"{long.stem}.labels.jsonl: File name too long" in said.replace("\n", "")
    assert len(lines(good)) == 4


def test_numbered_logs_without_a_first_part_are_labelled_and_corrected_each_by_itself(write_practice, capsys) -> None:
    first, second = write_practice("trial.001", 1), write_practice("trial.002", 2, 4)
    assert main(["correct", str(second), "--step", "3", "--field", "exclude", "--value", "true"]) == 0
    relabel(first.parent)
    assert "2 logs, 7 steps, 6 of them teach" in capsys.readouterr().out
    assert ([line["run_id"] for line in lines(first)[1:]], len(lines(second))) == (["trial.001"] * 3, 5)


def test_the_parts_of_a_log_share_their_labels(write_practice, capsys) -> None:
    log, part = write_practice("run", 1), write_practice("run.001", 2)
    relabel(part)
    assert labels_path(log) == labels_path(part)
    assert len(lines(log)) == 7


def test_of_a_cut_log_what_is_there_is_labelled(write_practice, capsys) -> None:
    log = write_practice("a", 1, 30)
    data = log.read_bytes()
    log.write_bytes(data[: len(data) // 2])
    relabel(log)
    assert "damaged: a.mcap: " in capsys.readouterr().out


def test_no_logs_are_said_to_be_missing(tmp_path: Path, capsys) -> None:
    relabel(tmp_path, code=2)
    assert "no .mcap logs in" in capsys.readouterr().err
    relabel(tmp_path / "nowhere", code=2)
    assert "nowhere does not exist" in capsys.readouterr().err
