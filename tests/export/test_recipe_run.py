"""What is done and what is left out, with commands that do nothing but say that they were called."""

import re
from pathlib import Path

import msgspec
import pytest
from rich.console import Console

from grasping_invisible.export import recipe_run
from grasping_invisible.export.recipe import Stage, load_recipe, stages_of
from grasping_invisible.export.recipe_run import RECORD, Record, carry_out, summary
from grasping_invisible.runtime.errors import BadInput

QUIET = Console(quiet=True)
STAGES = [
    Stage("first", "gi-collect", ("--out", Path("logs"), "--scenes", "3"), Path("logs"), parallel=True),
    Stage("second", "gi-train", ("critic", "--out", Path("checkpoints")), Path("checkpoints")),
]


class Program:
    """Stands in for a command: makes what follows `--out`, unless it is to fail."""

    def __init__(self) -> None:
        self.calls: list[list[str]] = []
        self.code = 0

    def __call__(self, arguments: list[str]) -> int:
        self.calls.append(arguments)
        if self.code == 0:
            Path(arguments[arguments.index("--out") + 1]).mkdir(exist_ok=True)
        return self.code


@pytest.fixture
def collect(monkeypatch: pytest.MonkeyPatch) -> Program:
    program = Program()
    monkeypatch.setitem(recipe_run.PROGRAMS, "gi-collect", program)
    return program


@pytest.fixture
def train(monkeypatch: pytest.MonkeyPatch) -> Program:
    program = Program()
    monkeypatch.setitem(recipe_run.PROGRAMS, "gi-train", program)
    return program


def record_in(folder: Path) -> Record:
    return msgspec.json.decode((folder / RECORD).read_bytes(), type=Record)


def test_what_is_done_is_not_done_again(collect: Program, train: Program, tmp_path: Path) -> None:
    assert carry_out(STAGES, tmp_path, 2, QUIET) == 0
    assert carry_out(STAGES, tmp_path, 2, QUIET) == 0
    assert collect.calls == [["--out", str(tmp_path / "logs"), "--scenes", "3", "--workers", "2"]]
    assert train.calls == [["critic", "--out", str(tmp_path / "checkpoints")]]
    assert all(stage.done for stage in record_in(tmp_path).stages)


def test_it_goes_on_with_the_stage_that_was_interrupted(collect: Program, train: Program, tmp_path: Path) -> None:
    train.code = 130
    assert carry_out(STAGES, tmp_path, 2, QUIET) == 130
    before = record_in(tmp_path)
    assert [stage.done for stage in before.stages] == [True, False]
    train.code = 0
    assert carry_out(STAGES, tmp_path, 1, QUIET) == 0
    assert (len(collect.calls), len(train.calls)) == (1, 2)
    after = record_in(tmp_path)
    assert after.stages[0].seconds == before.stages[0].seconds
    assert after.stages[1].seconds > before.stages[1].seconds  # both attempts count
    assert after.seconds == pytest.approx(sum(stage.seconds for stage in after.stages))
    assert [line.split()[0] for line in summary(tmp_path)] == ["first", "second", "in"]


def test_a_stage_that_was_killed_is_known_to_have_begun(
    collect: Program, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    seen: list[Record] = []

    def note(arguments: list[str]) -> int:
        seen.append(record_in(tmp_path))
        return 0

    monkeypatch.setitem(recipe_run.PROGRAMS, "gi-collect", note)
    carry_out(STAGES[:1], tmp_path, 2, QUIET)
    assert [(stage.name, stage.done) for stage in seen[0].stages] == [("first", False)]


def test_a_stage_whose_output_is_gone_is_done_again(collect: Program, train: Program, tmp_path: Path) -> None:
    carry_out(STAGES, tmp_path, 2, QUIET)
    (tmp_path / "logs").rmdir()
    assert carry_out(STAGES, tmp_path, 2, QUIET) == 0
    assert (len(collect.calls), len(train.calls)) == (2, 1)


def test_the_work_of_another_recipe_is_refused_and_stays(collect: Program, train: Program, tmp_path: Path) -> None:
    carry_out(STAGES, tmp_path, 2, QUIET)
    kept = (tmp_path / RECORD).read_bytes()
    other = [Stage("first", "gi-collect", ("--out", Path("logs"), "--scenes", "4"), Path("logs"), parallel=True)]
    with pytest.raises(BadInput, match="first was 'gi-collect --out logs --scenes 3'; give --out another folder"):
        carry_out(other, tmp_path, 2, QUIET)
    with pytest.raises(BadInput, match="longer recipe"):
        carry_out(STAGES[:1], tmp_path, 2, QUIET)
    (tmp_path / RECORD).write_text("{")
    with pytest.raises(BadInput, match="damaged"):
        carry_out(STAGES, tmp_path, 2, QUIET)
    (tmp_path / RECORD).write_bytes(kept)
    assert carry_out(STAGES, tmp_path, 2, QUIET) == 0
    assert len(collect.calls) == 1


def test_a_command_that_fails_by_an_exception_is_not_done(
    monkeypatch: pytest.MonkeyPatch, train: Program, tmp_path: Path
) -> None:
    def broken(arguments: list[str]) -> int:
        raise RuntimeError("a fault")

    monkeypatch.setitem(recipe_run.PROGRAMS, "gi-collect", broken)
    with pytest.raises(RuntimeError):
        carry_out(STAGES, tmp_path, 2, QUIET)
    assert [stage.done for stage in record_in(tmp_path).stages] == [False]
    assert train.calls == []


@pytest.mark.parametrize("scale", ["full", "tiny"])
def test_every_command_knows_what_it_is_given(scale: str, capsys: pytest.CaptureFixture[str]) -> None:
    for stage in stages_of(load_recipe(scale)):
        subcommand = [str(stage.arguments[0])] if not str(stage.arguments[0]).startswith("-") else []
        with pytest.raises(SystemExit):
            recipe_run.PROGRAMS[stage.program]([*subcommand, "--help"])
        known = re.findall(r"--[a-z-]+", capsys.readouterr().out)
        given = [str(item) for item in stage.arguments if str(item).startswith("--")]
        assert {*given, *(["--workers"] if stage.parallel else [])} <= set(known), stage.name
