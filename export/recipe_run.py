"""Carrying out a recipe: what is done is not done again, and how long each stage took is kept."""

import os
import time
from collections.abc import Callable, Iterable
from pathlib import Path

import msgspec
from rich.console import Console
from rich.markup import escape

from grasping_invisible.data.dataset import cli as dataset_cli
from grasping_invisible.export import cli as export_cli
from grasping_invisible.export.recipe import Stage
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.training import cli as train_cli
from grasping_invisible.training import collect_cli

RECORD = "recipe.json"
PROGRAMS: dict[str, Callable[[list[str]], int]] = {
    "gi-collect": collect_cli.main,
    "gi-dataset": dataset_cli.main,
    "gi-export": export_cli.main,
    "gi-train": train_cli.main,
}


class StageRecord(msgspec.Struct):
    """What is known of a stage that was begun. `seconds`: of all attempts, interrupted ones too but not killed ones."""

    name: str
    program: str
    arguments: list[str]
    seconds: float = 0.0
    done: bool = False


class Record(msgspec.Struct):
    """`recipe.json`: the stages begun so far, in order. `cores`: of the computer that it was last carried out on."""

    cores: int
    seconds: float = 0.0
    stages: list[StageRecord] = msgspec.field(default_factory=list)


def carry_out(stages: list[Stage], folder: Path, workers: int, console: Console) -> int:
    """Do what is not done yet; the exit code of the first command that failed, else 0.

    Raises `BadInput` before anything is done where the folder holds another recipe's work.
    """
    folder.mkdir(parents=True, exist_ok=True)
    record = _read(folder)
    _check_same(record, stages, folder)
    record.cores = os.cpu_count() or 1
    for index, stage in enumerate(stages):
        title = f"stage {index + 1} of {len(stages)}, {stage.name}"
        if index < len(record.stages) and record.stages[index].done and (folder / stage.output).exists():
            console.print(f"[dim]{title}: done before, in {_minutes(record.stages[index].seconds)}[/]", highlight=False)
            continue
        if index == len(record.stages):
            record.stages.append(StageRecord(stage.name, stage.program, _recorded(stage)))
            _write(folder, record)  # what is killed from here on is known to have begun
        code = _do(stage, record.stages[index], record, folder, workers, title, console)
        if code != 0:
            return code
    return 0


def _do(
    stage: Stage, begun: StageRecord, record: Record, folder: Path, workers: int, title: str, console: Console
) -> int:
    arguments = [str(folder / item) if isinstance(item, Path) else item for item in stage.arguments]
    arguments += ["--workers", str(workers)] if stage.parallel else []
    console.print(f"[bold]{title}[/]\n$ {escape(' '.join([stage.program, *arguments]))}", highlight=False)
    start = time.monotonic()
    code = 1  # should the command end by an exception
    try:
        code = PROGRAMS[stage.program](arguments)
    finally:
        begun.seconds += time.monotonic() - start
        begun.done = code == 0
        record.seconds = sum(known.seconds for known in record.stages)
        _write(folder, record)
    return code


def summary(folder: Path) -> Iterable[str]:
    """A line for each stage done, and one for all."""
    record = _read(folder)
    for stage in record.stages:
        yield f"{stage.name:28} {_minutes(stage.seconds):>10}"
    yield f"{'in all':28} {_minutes(record.seconds):>10} on {record.cores} cores"


def _check_same(record: Record, stages: list[Stage], folder: Path) -> None:
    for begun, stage in zip(record.stages, stages, strict=False):
        ours = (stage.name, stage.program, _recorded(stage))
        if (begun.name, begun.program, begun.arguments) != ours:
            raise BadInput(
                f"{folder} holds the work of another recipe: {begun.name} was "
                f"'{' '.join([begun.program, *begun.arguments])}'; give --out another folder"
            )
    if len(record.stages) > len(stages):
        raise BadInput(f"{folder} holds the work of a longer recipe; give --out another folder")


def _recorded(stage: Stage) -> list[str]:
    return [str(item) for item in stage.arguments]


def _read(folder: Path) -> Record:
    path = folder / RECORD
    try:
        return msgspec.json.decode(path.read_bytes(), type=Record)
    except FileNotFoundError:
        return Record(os.cpu_count() or 1)
    except msgspec.DecodeError as error:
        raise BadInput(f"{path} is damaged: {error}; give --out another folder") from None


def _write(folder: Path, record: Record) -> None:
    partial = folder / f"{RECORD}.partial"
    partial.write_bytes(msgspec.json.format(msgspec.json.encode(record)) + b"\n")
    os.replace(partial, folder / RECORD)


def _minutes(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.0f} min"
