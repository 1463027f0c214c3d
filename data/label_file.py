"""Labels beside a log, `run.labels.jsonl`: a line about the rules, then a line for each step."""

import os
from pathlib import Path
from typing import Any

import msgspec

from grasping_invisible.data.corrections import Corrections
from grasping_invisible.data.labelled_steps import LabelledStep, labelled_steps
from grasping_invisible.data.labels import RULES, StepLabel
from grasping_invisible.data.log_storage import first_part
from grasping_invisible.data.regular_file import open_regular
from grasping_invisible.data.shown_name import shown

FORMAT = 1


class LabelsHead(msgspec.Struct, frozen=True):
    """The first line: which rules, by version, and which corrections (their file's SHA-256) the labels come from."""

    log: str
    rules: dict[str, int]
    corrections_sha256: str
    format: int = FORMAT


class LabelLine(msgspec.Struct, frozen=True):
    """A line for a step."""

    run_id: str
    label: StepLabel


class Relabelling(msgspec.Struct, frozen=True):
    """What a relabelling made of one log.

    `changed`: steps whose labels are others than in the file before, by what differs; None where there was no file.
    `judged_otherwise`: steps of which the runtime said otherwise whether the target was grasped.
    """

    path: Path
    steps: int
    usable: int
    corrected: int
    judged_otherwise: list[str]
    changed: dict[str, int] | None
    damage: list[str]


def labels_path(log: Path) -> Path:
    """Where the labels of a log lie, for all its parts."""
    return first_part(log).with_suffix(".labels.jsonl")


def relabel(log: Path) -> Relabelling:
    """Label the log anew and replace the file beside it; the log itself is only read.

    Raises `BadLog`, `BadCorrections`, `OSError`; then the file is as it was.
    """
    path = labels_path(log)
    before = _read(path)
    changed: dict[str, int] | None = None if before is None else {}
    damage: list[str] = []
    otherwise: list[str] = []
    steps = usable = corrected = 0
    unfinished = path.with_name(f".{path.name}.unfinished")
    try:
        with unfinished.open("wb") as file:
            file.write(_line(LabelsHead(shown(log.name), RULES, Corrections(log).sha256)))
            for labelled in labelled_steps(log, damage):
                line = _line(LabelLine(labelled.run_id, labelled.label))
                file.write(line)
                steps += 1
                usable += not labelled.label.why_not
                corrected += labelled.label.source == "human"
                otherwise += _judged_otherwise(labelled)
                if before is not None and changed is not None:
                    known = before.pop((labelled.run_id, labelled.label.step), None)
                    for what in _differences(known, msgspec.json.decode(line)["label"]):
                        changed[what] = changed.get(what, 0) + 1
        if before and changed is not None:
            changed["no longer in the log"] = len(before)
        os.replace(unfinished, path)
    finally:
        unfinished.unlink(missing_ok=True)
    return Relabelling(path, steps, usable, corrected, otherwise, changed, damage)


def _line(content: msgspec.Struct) -> bytes:
    return msgspec.json.encode(content, order="sorted") + b"\n"


def _read(path: Path) -> dict[tuple[str, int], dict[str, Any]] | None:
    """The labels by run and step; None where there is no file that can be compared with."""
    try:
        with open_regular(path) as file:
            lines = [msgspec.json.decode(line) for line in file.read().splitlines()[1:]]
        return {(line["run_id"], line["label"]["step"]): line["label"] for line in lines}
    except (FileNotFoundError, msgspec.DecodeError, KeyError, TypeError):
        return None


def _differences(before: dict[str, Any] | None, now: dict[str, Any]) -> list[str]:
    if before is None:
        return ["new"]
    return [name for name in sorted({*before, *now}) if before.get(name) != now.get(name)]


def _judged_otherwise(labelled: LabelledStep) -> list[str]:
    result, label = labelled.step.result, labelled.label
    if result is None or label.why_not or result.target_grasped == label.grasp.target_grasped:
        return []
    said, now = ("grasped" if it else "not grasped" for it in (result.target_grasped, label.grasp.target_grasped))
    return [f"step {label.step}: the runtime judged the target {said}, a {label.grasp.source} says {now}"]
