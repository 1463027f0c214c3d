"""An evaluation from beginning to end: which runs are left, the runs, their results."""

from collections import Counter
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.markup import escape

from grasping_invisible.data.progress import bar
from grasping_invisible.runtime.bundle import load_bundle
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.runtime.run_log import in_file_name
from grasping_invisible.runtime.seed import MAX_SEED, check_seed
from grasping_invisible.training.evaluation import (
    SEEDS_APART,
    Trial,
    TrialResult,
    log_path,
    name_log,
    run_trials,
    trials_of,
)
from grasping_invisible.training.evaluation_methods import method_named
from grasping_invisible.training.stored_results import Measured, ResultsFile


@dataclass(frozen=True)
class Evaluation:
    """What to measure. `runs`: of each scene. `models`: a bundle's folder, None the shipped one.

    `name`: what tables call it, None the method's name. `results`: a file to keep results in and to go on from.
    `log_dir`: a folder for the runs' logs. Raises `BadInput` for numbers or names that make no sense.
    """

    suite: str
    method: str
    runs: int
    seed: int = 0
    models: Path | None = None
    name: str | None = None
    results: Path | None = None
    log_dir: Path | None = None

    def __post_init__(self) -> None:
        if self.runs < 1:
            raise BadInput("--runs must be at least 1")
        check_seed(self.seed, most=MAX_SEED // SEEDS_APART - 1)
        method_named(self.method)

    def measured(self) -> Measured:
        """What its results are of. Raises `BundleError`."""
        return Measured(self.suite, self.method, self.name or self.method, load_bundle(self.models).sha256)


def evaluate(evaluation: Evaluation, workers: int, console: Console) -> list[TrialResult]:
    """Make the runs that are missing in `workers` processes; all results, by scene and seed.

    Raises `BadInput` for an unknown suite, a bundle that cannot be used, a file of other results, or logs that are
    there already.
    """
    if workers < 1:
        raise BadInput("--workers must be at least 1")
    measured = evaluation.measured()
    trials = trials_of(evaluation.suite, evaluation.runs, evaluation.seed)
    with nullcontext() if evaluation.results is None else ResultsFile(evaluation.results, measured) as file:
        done = {} if file is None else file.of(trials)
        left = [trial for trial in trials if (trial.name, trial.seed) not in done]
        log_dir = _log_folder(evaluation, left)
        tasks = {trial.name: trial.task_sha256 for trial in left}
        with bar(escape(f"{evaluation.suite}, {measured.name}"), len(trials), console, len(done)) as advance:
            for result in _runs(left, evaluation, workers, log_dir):
                done[result.scene, result.seed] = result
                if file is not None:
                    file.add(result, tasks[result.scene])
                if log_dir is not None:
                    name_log(log_dir, result)
                advance(f"{sum(item.success for item in done.values())} of {len(done)}")
    return [done[key] for key in sorted(done)]


def _runs(trials: list[Trial], evaluation: Evaluation, workers: int, log_dir: Path | None) -> Iterator[TrialResult]:
    if trials:
        method = method_named(evaluation.method)
        yield from run_trials(trials, evaluation.models, method, min(workers, len(trials)), log_dir)


def _log_folder(evaluation: Evaluation, trials: list[Trial]) -> Path | None:
    """A folder for each suite and method, as both share scenes and seeds.

    Raises `BadInput` where these runs would leave their logs in place of others, or of each other.
    """
    if evaluation.log_dir is None:
        return None
    name = in_file_name(f"{Path(evaluation.suite).name}-{evaluation.name or evaluation.method}")
    folder = evaluation.log_dir / name
    logs = [log_path(folder, trial.name, trial.seed) for trial in trials]
    for log, runs in Counter(logs).items():
        if runs > 1:
            raise BadInput(f"two scenes have names that would both make log {log}; rename one")
        if log.exists():
            raise BadInput(f"log {log} exists already; logs are never overwritten, name another --log-dir or --name")
    folder.mkdir(parents=True, exist_ok=True)
    return folder
