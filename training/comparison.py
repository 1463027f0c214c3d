"""Two evaluations of the same runs side by side: is one better, or is it noise?"""

from collections.abc import Sequence

import msgspec

from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.training.evaluation import TrialResult
from grasping_invisible.training.evaluation_summary import Rates, rates_of
from grasping_invisible.training.intervals import mean_interval, paired_difference

# So many pairs that differ in motions all point one way by chance in 1 of 32 cases, and five do in 1 of 16.
LEAST_DIFFERING = 6


class Pairs(msgspec.Struct, frozen=True, kw_only=True):
    """Pairs of runs of the same scene and seed, with 95 % intervals; differences are second less first.

    `success_interval`: Newcombe's for paired rates; `motions_interval`: bootstrap over pairs. `first_only` and
    `second_only` count the pairs in which one alone succeeded, `motions_differ` those that took unlike many motions.
    """

    pairs: int
    first: Rates
    second: Rates
    first_only: int
    second_only: int
    success_difference: float
    success_interval: tuple[float, float]
    motions_differ: int
    motions_difference: float
    motions_interval: tuple[float, float]


class Comparison(msgspec.Struct, frozen=True, kw_only=True):
    """What `gi-eval compare --json` prints. `unpaired`: runs that only one of the two has, which count nothing."""

    suite: str
    first: str
    second: str
    verdict: str
    overall: Pairs
    scenes: dict[str, Pairs]
    unpaired: int


def compare(
    suite: str, names: tuple[str, str], first: Sequence[TrialResult], second: Sequence[TrialResult]
) -> Comparison:
    """Compare results by scene and seed. Raises `BadInput` where no run is in both."""
    ones, others = ({(item.scene, item.seed): item for item in results} for results in (first, second))
    keys = sorted(ones.keys() & others.keys())
    if not keys:
        raise BadInput("the two hold no run of the same scene and seed")
    scenes = sorted({scene for scene, _ in keys})
    overall = _pairs([(ones[key], others[key]) for key in keys])
    return Comparison(
        suite=suite,
        first=names[0],
        second=names[1],
        verdict=_verdict(overall),
        overall=overall,
        scenes={name: _pairs([(ones[key], others[key]) for key in keys if key[0] == name]) for name in scenes},
        unpaired=len(ones.keys() ^ others.keys()),
    )


def _pairs(pairs: list[tuple[TrialResult, TrialResult]]) -> Pairs:
    both = sum(one.success and other.success for one, other in pairs)
    first_only = sum(one.success and not other.success for one, other in pairs)
    second_only = sum(other.success and not one.success for one, other in pairs)
    motions = [float(other.motions_counted - one.motions_counted) for one, other in pairs]
    return Pairs(
        pairs=len(pairs),
        first=rates_of([one for one, _ in pairs]),
        second=rates_of([other for _, other in pairs]),
        first_only=first_only,
        second_only=second_only,
        success_difference=(second_only - first_only) / len(pairs),
        success_interval=paired_difference(both, first_only, second_only, len(pairs) - both - first_only - second_only),
        motions_differ=sum(difference != 0 for difference in motions),
        motions_difference=sum(motions) / len(motions),
        motions_interval=mean_interval(motions),
    )


def _verdict(pairs: Pairs) -> str:
    """Whether the differences are more than noise, in words.

    The bootstrap knows no more than the pairs that it draws from: of a few it makes too narrow an interval.
    """
    words = []
    low, high = pairs.success_interval
    if low > 0 or high < 0:
        words.append(f"succeeds {'more' if low > 0 else 'less'} often")
    low, high = pairs.motions_interval
    if (low > 0 or high < 0) and pairs.motions_differ >= LEAST_DIFFERING:
        words.append(f"takes {'more' if low > 0 else 'fewer'} motions")
    return f"the second {' and '.join(words)}" if words else "no difference beyond noise"
