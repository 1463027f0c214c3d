"""What people say came of a motion, in a CSV beside the log. It overrides what rules say."""

import csv
import errno
import fcntl
import hashlib
import io
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec

from grasping_invisible.data.classes import GREY, TARGET_COLORS
from grasping_invisible.data.errors import BadRequest, DataError
from grasping_invisible.data.log_storage import first_part
from grasping_invisible.data.regular_file import open_regular

NOTHING = "nothing"
COLUMNS = ("run_id", "step", "field", "value", "by", "note")
_REQUIRED = {"step", "field", "value"}
_TRUTHS = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}


class BadCorrections(DataError):
    """A correction that cannot be used: one line that says where it stands and what is known."""


class Correction(msgspec.Struct, frozen=True, kw_only=True):
    """One value of one step. An empty `run_id` means the log's only run. `by`, `note`: for people."""

    run_id: str = ""
    step: int
    field: str
    value: str
    by: str = ""
    note: str = ""


class StepCorrection(msgspec.Struct, frozen=True):
    """All that people say of one step; None where they say nothing.

    `grasped_color`: a target's colour, grey for anything else, or "nothing".
    """

    target_grasped: bool | None = None
    object_grasped: bool | None = None
    grasped_color: str | None = None
    exclude: bool | None = None


def corrections_path(log: Path) -> Path:
    """Where corrections of a log lie: `run.corrections.csv` beside `run.mcap`, for all its parts."""
    return first_part(log).with_suffix(".corrections.csv")


class Corrections:
    """The corrections of one log, of which a later one of the same field and step overrides an earlier one."""

    def __init__(self, log: Path) -> None:
        """Read those beside `log`; there may be none. Raises `BadCorrections`, `OSError`."""
        self.path = corrections_path(log)
        try:
            with open_regular(self.path) as file:
                data = file.read()
        except OSError as error:
            if error.errno not in (errno.ENOENT, errno.ENAMETOOLONG):  # beside so long a name there can be none
                raise
            data = b""
        self.sha256 = hashlib.sha256(data).hexdigest() if data.strip() else ""
        self.all = list(_parsed(self.path, data))

    def of(self, run_id: str, step: int) -> StepCorrection:
        """What is said of one step."""
        said = [item for item in self.all if item.step == step and item.run_id in ("", run_id)]
        return msgspec.convert({item.field: value_of(item.field, item.value) for item in said}, StepCorrection)

    def check_against(self, kinds: dict[tuple[str, int], str]) -> None:
        """Raises `BadCorrections` for one of a step that the log does not hold or that was no grasp.

        `kinds`: run id and number of every step, and what motion it was.
        """
        for item in self.all:
            try:
                check_step(item, kinds)
            except BadCorrections as error:
                raise BadCorrections(f"{self.path}: {error}") from None


def value_of(field: str, text: str) -> bool | str:
    """The value in a text; raises `BadCorrections` for a field or a value that is unknown."""
    if field not in FIELDS:
        raise BadCorrections(f"unknown field {field!r}; there are {', '.join(FIELDS)}")
    return FIELDS[field](field, text)


def check_step(item: Correction, kinds: dict[tuple[str, int], str]) -> None:
    """Raises `BadCorrections` where the log has no such step, more than one, or none that could be corrected so."""
    runs = list(dict.fromkeys(run for run, _ in kinds))
    if item.run_id and item.run_id not in runs:
        raise BadCorrections(f"no run {item.run_id!r}; the log holds {', '.join(runs) or 'none'}")
    if not item.run_id and len(runs) > 1:
        raise BadCorrections(f"step {item.step} of which run? The log holds {', '.join(runs)}")
    run = item.run_id or (runs[0] if runs else "")
    kind = kinds.get((run, item.step))
    if kind is None:
        steps = [step for of, step in kinds if of == run]
        known = f"steps {min(steps)} to {max(steps)}" if steps else "no step"
        raise BadCorrections(f"no step {item.step}; the log holds {known}")
    if item.field != "exclude" and kind != "grasp":
        raise BadCorrections(f"step {item.step} is a {kind}: {item.field} is of grasps; exclude is of all motions")


def append_correction(log: Path, item: Correction) -> Path:
    """Add one to those beside the log, and return their file, which holds all of them at any moment.

    Raises `BadCorrections`, `BadRequest`, `OSError`.
    """
    path = corrections_path(log)
    with _locked(path.parent):
        known = Corrections(log).all
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows([getattr(one, column) for column in COLUMNS] for one in (*known, item))
        try:
            content = text.getvalue().encode()
        except UnicodeEncodeError:
            raise BadRequest("a correction is kept as UTF-8, and this one holds what is no text") from None
        unfinished = path.with_name(f".{path.name}.unfinished")
        try:
            unfinished.write_bytes(content)
            os.replace(unfinished, path)
        finally:
            unfinished.unlink(missing_ok=True)
    return path


def _truth(field: str, text: str) -> bool:
    value = _TRUTHS.get(text.strip().lower())
    if value is None:
        raise BadCorrections(f"{field} cannot be {text!r}; it is true or false")
    return value


def _color(field: str, text: str) -> str:
    known = (*TARGET_COLORS, GREY, NOTHING)
    if text.strip() not in known:
        raise BadCorrections(f"{field} cannot be {text!r}; there are {', '.join(known)}")
    return text.strip()


FIELDS: dict[str, Callable[[str, str], bool | str]] = {
    "target_grasped": _truth,
    "object_grasped": _truth,
    "grasped_color": _color,
    "exclude": _truth,
}


def _parsed(path: Path, data: bytes) -> Iterator[Correction]:
    try:
        rows = csv.DictReader(io.StringIO(data.decode("utf-8-sig"), newline=""), strict=True)
        names = set(rows.fieldnames or COLUMNS)
        if not names <= set(COLUMNS) or not names >= _REQUIRED:
            raise BadCorrections(f"{path}: its columns are {', '.join(sorted(names))}, not {', '.join(COLUMNS)}")
        for row in rows:
            yield _correction(row, f"{path}, line {rows.line_num}")
    except (UnicodeDecodeError, csv.Error) as error:
        raise BadCorrections(f"{path} is not CSV: {error}") from None


def _correction(row: dict[str, str | None], where: str) -> Correction:
    if None in row:
        raise BadCorrections(f"{where}: more values than columns")
    texts = {name: text or "" for name, text in row.items()}
    try:
        step = int(texts.pop("step"))
        value_of(texts["field"], texts["value"])
    except ValueError:
        raise BadCorrections(f"{where}: step {row['step']!r} is not a whole number") from None
    except BadCorrections as error:
        raise BadCorrections(f"{where}: {error}") from None
    return Correction(step=step, **texts)


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Two commands that add to one file at a time would lose one of the two."""
    if not folder.is_dir():
        raise BadRequest(f"{folder} is not a folder")
    handle = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)
