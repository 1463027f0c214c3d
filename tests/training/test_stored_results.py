from dataclasses import replace
from pathlib import Path

import pytest

from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.training.evaluation import Trial, TrialResult, trials_of
from grasping_invisible.training.stored_results import Measured, ResultsFile, StoredResult, check_one_task, read_results

OURS = Measured("coordination", "ours", "ours", "b" * 64)


def test_an_interrupted_evaluation_goes_on_from_what_is_there(tmp_path: Path, result_of):
    path = tmp_path / "new" / "results.jsonl"
    trials = trials_of("coordination", 2, 0)
    first = result_of(trials[0].name, trials[0].seed, True, 2)
    with ResultsFile(path, OURS) as file:
        file.add(first)
    with ResultsFile(path, OURS) as file:
        assert file.of(trials) == {(first.scene, first.seed): first}
        assert file.of(trials[1:]) == {}
    (stored,) = read_results(path)
    assert (stored.measured, stored.result) == (OURS, first)
    assert stored.source_commit
    assert stored.project_version


@pytest.mark.parametrize(
    ("other", "named"),
    [
        (Measured("invisible", "ours", "ours", "b" * 64), "on invisible"),
        (Measured("coordination", "rand", "rand", "b" * 64), "rand by"),
        (Measured("coordination", "ours", "depth+mask", "b" * 64), "as depth[+]mask"),
        (Measured("coordination", "ours", "ours", "c" * 64), "bundle cccccccccccc"),
    ],
)
def test_results_of_something_else_are_refused(tmp_path: Path, result_of, other: Measured, named: str):
    path = tmp_path / "results.jsonl"
    with ResultsFile(path, other) as file:
        file.add(result_of("coordination-00", 0, True, 2))
    before = path.read_bytes()
    with pytest.raises(BadInput, match=f"holds results of .*{named}.*, this is ours by bundle b.* on coordination"):
        ResultsFile(path, OURS)
    assert path.read_bytes() == before


def test_half_a_line_that_a_kill_left_is_made_again(tmp_path: Path, result_of):
    path = tmp_path / "results.jsonl"
    with ResultsFile(path, OURS) as file:
        for seed in range(2):
            file.add(result_of("coordination-00", seed, True, 2))
    path.write_bytes(path.read_bytes()[:-20])
    with ResultsFile(path, OURS) as again:
        again.add(result_of("coordination-00", 1, True, 2))
    assert [stored.result.seed for stored in read_results(path)] == [0, 1]


def test_two_evaluations_never_write_one_file(tmp_path: Path, result_of):
    path = tmp_path / "results.jsonl"
    with ResultsFile(path, OURS) as file:
        with pytest.raises(BadInput, match=r"results.jsonl is in use by another evaluation"):
            ResultsFile(path, OURS)
        file.add(result_of("coordination-00", 0, True, 2))  # and the first goes on
    with ResultsFile(path, OURS):
        assert len(read_results(path)) == 1


def test_another_file_is_no_file_of_results(tmp_path: Path):
    (tmp_path / "other.jsonl").write_text('{"grasped": true}\n')
    with pytest.raises(BadInput, match=r"other.jsonl does not hold results of gi-eval run"):
        read_results(tmp_path / "other.jsonl")


@pytest.mark.parametrize(
    "content",
    [
        b"a shopping list",
        b'{"grasped": true}',
        b"\xff\xfe\x00",
        b"notes\nand half a line",
        b'{"measured": 1}\n{"measured"',
        b"\n",
    ],
)
def test_a_file_of_something_else_is_refused_and_stays_as_it_is(tmp_path: Path, content: bytes):
    path = tmp_path / "mine.txt"
    path.write_bytes(content)
    with pytest.raises(BadInput, match=r"mine.txt does not hold results of gi-eval run"):
        ResultsFile(path, OURS)
    assert path.read_bytes() == content


def test_half_a_line_of_other_results_is_left_alone(tmp_path: Path, result_of):
    path = tmp_path / "results.jsonl"
    with ResultsFile(path, OURS) as file:
        file.add(result_of("coordination-00", 0, True, 2))
    path.write_bytes(before := path.read_bytes() * 2 + b'{"meas')
    with pytest.raises(BadInput, match="on coordination, this is"):
        ResultsFile(path, Measured("invisible", "ours", "ours", "b" * 64))
    assert path.read_bytes() == before


def test_a_first_line_that_a_kill_cut_is_made_again(tmp_path: Path, result_of):
    path = tmp_path / "results.jsonl"
    with ResultsFile(path, OURS) as file:
        file.add(result_of("coordination-00", 0, True, 2))
    line = path.read_bytes()
    for length in (1, 12, 40, len(line) - 1):
        path.write_bytes(line[:length])
        with ResultsFile(path, OURS) as file:
            assert path.read_bytes() == b""


CHANGED = "holds results of 'coordination-00' as it was before it changed"
PUBLISHED = sorted((Path(__file__).parents[2] / "docs" / "results").glob("*.jsonl"))


@pytest.mark.parametrize("seed", [0, 1])  # the run that is there, and one that would stand beside it
def test_results_of_a_scene_that_has_changed_are_refused(tmp_path: Path, result_of, seed: int):
    trial = trials_of("coordination", 1, 0)[0]
    with ResultsFile(tmp_path / "results.jsonl", OURS) as file:
        file.add(result_of(trial.name, trial.seed, True, 2), trial.task_sha256)
    with ResultsFile(tmp_path / "results.jsonl", OURS) as file:
        assert len(file.of([trial])) == 1
        with pytest.raises(BadInput, match=CHANGED):
            file.of([replace(trial, seed=seed, task_sha256="c" * 64)])


def test_results_from_before_scenes_were_told_apart_count_unless_their_allowance_differs(tmp_path: Path, result_of):
    trial: Trial = trials_of("coordination", 1, 0)[0]
    with ResultsFile(tmp_path / "results.jsonl", OURS) as file:
        file.add(result_of(trial.name, trial.seed, True, 2))
    with ResultsFile(tmp_path / "results.jsonl", OURS) as file:
        assert len(file.of([trial])) == 1
        with pytest.raises(BadInput, match=CHANGED):
            file.of([replace(trial, max_motions=6)])


def stored(scene: str, max_motions: int, task_sha256: str | None) -> StoredResult:
    result = TrialResult(scene, 0, True, True, True, True, 1, max_motions, ())
    return StoredResult(measured=OURS, source_commit="abc", project_version="1", task_sha256=task_sha256, result=result)


def test_results_of_one_task_are_told_from_those_of_two():
    same = [stored("a", 5, "a" * 64), stored("a", 5, None), stored("b", 6, "b" * 64)]
    check_one_task([], "ours")
    check_one_task(same, "ours")
    for other in (stored("a", 5, "c" * 64), stored("a", 6, None), stored("a", 6, "a" * 64)):
        with pytest.raises(BadInput, match="ours hold runs of 'a' from before and after it changed"):
            check_one_task([*same, other], "ours")


@pytest.mark.parametrize("path", PUBLISHED, ids=lambda path: path.stem)
def test_published_results_are_still_results_of_their_suites(path: Path):
    stored = read_results(path)
    trials = {trial.name: trial for trial in trials_of(stored[0].measured.suite, 1, 0)}
    assert not any(item.is_of_another(trials[item.result.scene]) for item in stored)
