import threading
from pathlib import Path

import pytest

from grasping_invisible.data.corrections import (
    BadCorrections,
    Correction,
    Corrections,
    StepCorrection,
    append_correction,
    corrections_path,
)
from grasping_invisible.data.errors import BadRequest

KINDS = {("run-1", 0): "push", ("run-1", 1): "grasp"}


def test_what_is_appended_is_read_and_the_last_word_counts(tmp_path: Path) -> None:
    log = tmp_path / "run.mcap"
    for value in ("true", "no"):
        append_correction(
            log, Correction(step=1, field="target_grasped", value=value, by="Ada", note='fell, "twice"\n')
        )
    append_correction(log, Correction(run_id="run-1", step=1, field="grasped_color", value="blue"))
    corrections = Corrections(log)
    assert corrections.of("run-1", 1) == StepCorrection(target_grasped=False, grasped_color="blue")
    assert corrections.of("run-1", 0) == StepCorrection()
    assert corrections.of("run-2", 1) == StepCorrection(target_grasped=False)
    assert corrections.all[0].note == 'fell, "twice"\n'
    assert [path.name for path in tmp_path.iterdir()] == ["run.corrections.csv"]


def test_all_parts_of_a_log_share_one_file(tmp_path: Path) -> None:
    for name in ("run.mcap", "run.001.mcap", "run.002.mcap"):
        (tmp_path / name).touch()
        assert corrections_path(tmp_path / name) == tmp_path / "run.corrections.csv"


def test_numbered_logs_without_a_first_part_have_a_file_each(tmp_path: Path) -> None:
    for number in ("001", "002"):
        (tmp_path / f"trial.{number}.mcap").touch()
        assert corrections_path(tmp_path / f"trial.{number}.mcap") == tmp_path / f"trial.{number}.corrections.csv"


def test_none_is_no_correction(tmp_path: Path) -> None:
    corrections = Corrections(tmp_path / "run.mcap")
    assert (corrections.all, corrections.sha256) == ([], "")


def test_beside_a_log_whose_name_is_too_long_for_it_there_is_none(tmp_path: Path) -> None:
    assert Corrections(tmp_path / f"{'a' * 245}.mcap").all == []


def test_a_file_from_a_spreadsheet_is_read(tmp_path: Path) -> None:
    (tmp_path / "run.corrections.csv").write_bytes(b"\xef\xbb\xbfstep,field,value\r\n1,exclude,yes\r\n")
    assert Corrections(tmp_path / "run.mcap").of("any", 1) == StepCorrection(exclude=True)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("step,field,value\n1,color,red\n", "line 2: unknown field 'color'; there are target_grasped"),
        ("step,field,value\none,exclude,true\n", "line 2: step 'one' is not a whole number"),
        ("step,field,value\n1,exclude,maybe\n", "line 2: exclude cannot be 'maybe'; it is true or false"),
        ("step,field,value\n\n1,grasped_color,pink\n", "line 3: grasped_color cannot be 'pink'; there are red"),
        ("step,field,value\n1,exclude,true,Ada\n", "line 2: more values than columns"),
        ("step,value\n1,true\n", "its columns are step, value, not run_id, step, field"),
        ("step,field,value,who\n", "its columns are"),
        ('step,field,value\n1,"exclude,true\n', "is not CSV"),
        ("step,field,value\n1,exclude\n", "line 2: exclude cannot be ''"),
    ],
)
def test_what_cannot_be_used_is_said_with_its_place(tmp_path: Path, text: str, complaint: str) -> None:
    (tmp_path / "run.corrections.csv").write_text(text)
    with pytest.raises(BadCorrections) as caught:
        Corrections(tmp_path / "run.mcap")
    assert complaint in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("item", "complaint"),
    [
        (Correction(step=7, field="exclude", value="true"), "no step 7; the log holds steps 0 to 1"),
        (Correction(step=0, field="target_grasped", value="true"), "step 0 is a push: target_grasped is of grasps"),
        (Correction(run_id="x", step=0, field="exclude", value="true"), "no run 'x'; the log holds run-1"),
    ],
)
def test_a_correction_must_fit_the_log(tmp_path: Path, item: Correction, complaint: str) -> None:
    append_correction(tmp_path / "run.mcap", item)
    with pytest.raises(BadCorrections, match="csv") as caught:
        Corrections(tmp_path / "run.mcap").check_against(KINDS)
    assert complaint in str(caught.value)


def test_of_several_runs_one_must_be_named(tmp_path: Path) -> None:
    append_correction(tmp_path / "run.mcap", Correction(step=0, field="exclude", value="true"))
    with pytest.raises(BadCorrections, match="of which run"):
        Corrections(tmp_path / "run.mcap").check_against({**KINDS, ("run-2", 0): "push"})


def test_a_note_that_is_no_text_is_refused(tmp_path: Path) -> None:
    log = tmp_path / "run.mcap"
    append_correction(log, Correction(step=1, field="exclude", value="true"))
    with pytest.raises(BadRequest, match="holds what is no text"):
        append_correction(log, Correction(step=1, field="exclude", value="true", note="x\udcff"))
    assert len(Corrections(log).all) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["run.corrections.csv"]


def test_what_many_add_at_once_is_all_kept(tmp_path: Path) -> None:
    log = tmp_path / "run.mcap"
    items = [Correction(step=step, field="exclude", value="true") for step in range(20)]
    threads = [threading.Thread(target=append_correction, args=(log, item)) for item in items]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(item.step for item in Corrections(log).all) == list(range(20))
