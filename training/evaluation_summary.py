"""Success rates with Wilson intervals and numbers of motions, overall and for each scene."""

import math
from collections import defaultdict
from collections.abc import Sequence
from statistics import fmean, pstdev

import msgspec

from grasping_invisible.training.evaluation import TrialResult

Z_95 = 1.959964  # of the normal distribution, for a two-sided 95 % interval


class Rates(msgspec.Struct, frozen=True, kw_only=True):
    """Of a group of runs. `success_interval`: 95 %, Wilson. Motions are those of all runs, also of failed ones.

    `found_truth_rate`: how often ground truth shows the target at the end.
    """

    runs: int
    success_rate: float
    success_interval: tuple[float, float]
    motions_mean: float
    motions_std: float
    found_truth_rate: float


class Summary(msgspec.Struct, frozen=True, kw_only=True):
    """What `gi-eval run --json` prints; `runs` is that of each scene."""

    suite: str
    method: str
    runs: int
    seed: int
    success_rate: float
    success_interval: tuple[float, float]
    motions_mean: float
    motions_std: float
    bundle_sha256: str
    failures: dict[str, int]
    scenes: dict[str, Rates]


def summarise(
    results: Sequence[TrialResult], suite: str, method: str, runs: int, seed: int, bundle_sha256: str
) -> Summary:
    """The summary of an evaluation's results, at least one."""
    by_scene: dict[str, list[TrialResult]] = defaultdict(list)
    failures: dict[str, int] = defaultdict(int)
    for result in sorted(results, key=lambda item: (item.scene, item.seed)):
        by_scene[result.scene].append(result)
        if result.failure is not None:
            failures[result.failure] += 1
    overall = rates_of(results)
    return Summary(
        suite=suite,
        method=method,
        runs=runs,
        seed=seed,
        success_rate=overall.success_rate,
        success_interval=overall.success_interval,
        motions_mean=overall.motions_mean,
        motions_std=overall.motions_std,
        bundle_sha256=bundle_sha256,
        failures=dict(failures),
        scenes={scene: rates_of(of_scene) for scene, of_scene in by_scene.items()},
    )


def rates_of(results: Sequence[TrialResult]) -> Rates:
    """Rates of at least one result."""
    successes = sum(result.success for result in results)
    motions = [float(result.motions) for result in results]
    return Rates(
        runs=len(results),
        success_rate=successes / len(results),
        success_interval=wilson(successes, len(results)),
        motions_mean=fmean(motions),
        motions_std=pstdev(motions),
        found_truth_rate=sum(result.found_truth for result in results) / len(results),
    )


def wilson(successes: int, runs: int) -> tuple[float, float]:
    """The 95 % Wilson score interval of a success rate."""
    share, z2 = successes / runs, Z_95 * Z_95
    middle = (share + z2 / (2 * runs)) / (1 + z2 / runs)
    half = Z_95 / (1 + z2 / runs) * math.sqrt(share * (1 - share) / runs + z2 / (4 * runs * runs))
    return max(0.0, middle - half), min(1.0, middle + half)
