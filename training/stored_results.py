"""Results of evaluated runs in a file, each with all that it is a result of: a JSON object a line."""

import fcntl
import os
from collections import defaultdict
from collections.abc import Iterable
from importlib.metadata import version
from pathlib import Path

import msgspec

from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.training.evaluation import Trial, TrialResult
from grasping_invisible.training.evaluation_methods import METHODS
from grasping_invisible.training.given_files import files_at
from grasping_invisible.training.source import source_commit


class Measured(msgspec.Struct, frozen=True):
    """What is measured on what. `name`: what tables call it; the method's where the bundle is nothing special."""

    suite: str
    method: str
    name: str
    bundle_sha256: str

    def __str__(self) -> str:
        name = "" if self.name == self.method else f" as {self.name}"
        return f"{self.method}{name} by bundle {self.bundle_sha256[:12]} on {self.suite}"


class StoredResult(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One run's result. `source_commit`, `project_version`: of what made the run.

    `task_sha256`: of what was run, as `Trial` has it; None where it was made before that was kept.
    """

    measured: Measured
    source_commit: str
    project_version: str
    task_sha256: str | None = None
    result: TrialResult

    def is_of_another(self, trial: Trial) -> bool:
        """Whether it is of a scene of that name as it was before it changed."""
        return self.result.max_motions != trial.max_motions or self.task_sha256 not in (None, trial.task_sha256)


Key = tuple[str, int]  # scene and seed
_BEGINNING = b'{"measured":'  # of every line


class ResultsFile:
    """The results of one evaluation, kept as they come; an interrupted evaluation goes on from them.

    One process at a time has it open, until `close`. Raises `BadInput` where another has, or where the file holds
    results of anything else, or something else altogether.
    """

    def __init__(self, path: Path, measured: Measured) -> None:
        self._path, self._measured = path, measured
        self._commit, self._version = source_commit(), version("grasping-invisible")
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file = path.open("ab")
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self._file.close()
            raise BadInput(f"{path} is in use by another evaluation; wait for it, or name another file") from None
        try:
            self._results = _results_of(path, measured)
        except BadInput:
            self._file.close()
            raise

    def close(self) -> None:
        """Let others have the file."""
        self._file.close()

    def __enter__(self) -> "ResultsFile":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def of(self, trials: Iterable[Trial]) -> dict[Key, TrialResult]:
        """The results of these runs that are there.

        Raises `BadInput` where any run of their scenes, of whichever seed, was of another content, goal or allowance:
        one file never holds both.
        """
        trials = list(trials)
        of_scene = {trial.name: trial for trial in trials}
        for stored in self._results.values():
            trial = of_scene.get(stored.result.scene)
            if trial is not None and stored.is_of_another(trial):
                raise BadInput(
                    f"{self._path} holds results of {trial.name!r} as it was before it changed; name another file"
                )
        keys = ((trial.name, trial.seed) for trial in trials)
        return {key: self._results[key].result for key in keys if key in self._results}

    def add(self, result: TrialResult, task_sha256: str | None = None) -> None:
        """Keep one more result. `task_sha256`: that of its trial."""
        stored = StoredResult(
            measured=self._measured,
            source_commit=self._commit,
            project_version=self._version,
            task_sha256=task_sha256,
            result=result,
        )
        self._file.write(msgspec.json.encode(stored) + b"\n")
        self._file.flush()


def read_results(path: Path) -> list[StoredResult]:
    """All results in a file. Raises `BadInput`, or `OSError` where it cannot be read."""
    return _decoded(path.read_bytes(), path)


def read_all_results(paths: Iterable[Path]) -> list[StoredResult]:
    """All results in files and in the `*.jsonl` files of folders. Raises as `read_results`, or where one has none."""
    return [item for file in files_at(paths, "results", "*.jsonl") for item in read_results(file)]


def check_counted_once(stored: Iterable[StoredResult], what: str) -> None:
    """Raises `BadInput` where a scene and seed come twice in the results of `what`."""
    keys = [(item.result.scene, item.result.seed) for item in stored]
    if len(set(keys)) < len(keys):
        raise BadInput(f"the results hold a run of {what} twice; give each file once")


def check_one_method(stored: Iterable[StoredResult], what: str) -> None:
    """Raises `BadInput` where the results of `what` are of methods that differ by more than their names."""
    methods = {item.measured.method for item in stored}
    if len({METHODS.get(method, method) for method in methods}) > 1:
        known = ", ".join(sorted(methods))
        raise BadInput(f"{what} was measured by several methods ({known}); tell them apart with run --name")


def check_one_task(stored: Iterable[StoredResult], whose: str) -> None:
    """Raises `BadInput` where the results of `whose` hold runs of a scene from before and after it changed.

    Results that do not know what they are of count as the same where the motions allowed are.
    """
    of_scene: dict[str, list[StoredResult]] = defaultdict(list)
    for item in stored:
        of_scene[item.result.scene].append(item)
    for scene, runs in of_scene.items():
        allowances = {item.result.max_motions for item in runs}
        tasks = {item.task_sha256 for item in runs} - {None}
        if len(allowances) > 1 or len(tasks) > 1:
            raise BadInput(
                f"{whose} hold runs of {scene!r} from before and after it changed, which are not the same task"
            )


def _results_of(path: Path, measured: Measured) -> dict[Key, StoredResult]:
    """The results in a file, without half a line that a kill left at its end. A file that is refused stays as it is."""
    data = path.read_bytes()
    whole = data[: data.rfind(b"\n") + 1]
    cut = data[len(whole) :]
    stored = _decoded(whole, path)
    for item in stored:
        if item.measured != measured:
            raise BadInput(f"{path} holds results of {item.measured}, this is {measured}; name another file")
    if cut and not stored and not cut.startswith(_BEGINNING[: len(cut)]):
        raise BadInput(f"{path} does not hold results of gi-eval run; name another file")
    if cut:
        os.truncate(path, len(whole))
    return {(item.result.scene, item.result.seed): item for item in stored}


def _decoded(lines: bytes, path: Path) -> list[StoredResult]:
    try:
        return [msgspec.json.decode(line, type=StoredResult) for line in lines.splitlines()]
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise BadInput(f"{path} does not hold results of gi-eval run: {error}") from None
