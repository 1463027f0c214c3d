"""Success rates and numbers of motions with their intervals, overall and for each scene."""

from collections import defaultdict
from collections.abc import Sequence
from statistics import fmean, pstdev

import msgspec

from grasping_invisible.training.evaluation import TrialResult
from grasping_invisible.training.intervals import mean_interval, wilson
from grasping_invisible.training.stored_results import Measured


class Averages(msgspec.Struct, frozen=True, kw_only=True):
    """Over a group of runs, with 95 % intervals. Motions are those of all runs, also of failed ones.

    `success_interval`: Wilson. `confirmed_rate`: the share of runs that succeed and in which ground truth agrees; for
    grasps the same as `success_rate`, as those count for nothing otherwise.
    """

    success_rate: float
    success_interval: tuple[float, float]
    motions_mean: float
    motions_std: float
    motions_interval: tuple[float, float]
    confirmed_rate: float


class Rates(Averages, frozen=True, kw_only=True):
    """`Averages`, and of how many runs they are."""

    runs: int


class Summary(Averages, frozen=True, kw_only=True):
    """What `gi-eval run --json` prints, where the runs of each scene are called `runs`: others read it by that name.

    The averages are of all scenes. `failures`: why runs were cut short, and how many.
    """

    runs_per_scene: int = msgspec.field(name="runs")
    suite: str
    method: str
    name: str
    seed: int
    bundle_sha256: str
    failures: dict[str, int]
    scenes: dict[str, Rates]


def summarise(results: Sequence[TrialResult], measured: Measured, runs: int, seed: int) -> Summary:
    """The summary of an evaluation's results, at least one; `runs`: of each scene."""
    failures: dict[str, int] = defaultdict(int)
    for result in results:
        if result.failure is not None:
            failures[result.failure] += 1
    return Summary(
        **msgspec.structs.asdict(_averages(results)),
        runs_per_scene=runs,
        suite=measured.suite,
        method=measured.method,
        name=measured.name,
        seed=seed,
        bundle_sha256=measured.bundle_sha256,
        failures=dict(failures),
        scenes=rates_by_scene(results),
    )


def rates_by_scene(results: Sequence[TrialResult]) -> dict[str, Rates]:
    """Rates of each scene, by its name, sorted."""
    by_scene: dict[str, list[TrialResult]] = defaultdict(list)
    for result in results:
        by_scene[result.scene].append(result)
    return {scene: rates_of(by_scene[scene]) for scene in sorted(by_scene)}


def rates_of(results: Sequence[TrialResult]) -> Rates:
    """Rates of at least one result."""
    return Rates(runs=len(results), **msgspec.structs.asdict(_averages(results)))


def _averages(results: Sequence[TrialResult]) -> Averages:
    successes = sum(result.success for result in results)
    motions = [float(result.motions_counted) for result in results]
    return Averages(
        success_rate=successes / len(results),
        success_interval=wilson(successes, len(results)),
        motions_mean=fmean(motions),
        motions_std=pstdev(motions),
        motions_interval=mean_interval(motions),
        confirmed_rate=sum(result.success and result.found_truth for result in results) / len(results),
    )
