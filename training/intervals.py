"""95 % intervals of what is counted over runs."""

import math
from collections.abc import Sequence

import numpy as np

Z_95 = 1.959964  # of the normal distribution, for a two-sided 95 % interval
RESAMPLES = 10_000

Interval = tuple[float, float]


def wilson(successes: int, runs: int) -> Interval:
    """The Wilson score interval of a success rate."""
    share, z2 = successes / runs, Z_95 * Z_95
    middle = (share + z2 / (2 * runs)) / (1 + z2 / runs)
    half = Z_95 / (1 + z2 / runs) * math.sqrt(share * (1 - share) / runs + z2 / (4 * runs * runs))
    return max(0.0, middle - half), min(1.0, middle + half)


def paired_difference(both: int, first: int, second: int, neither: int) -> Interval:
    """The interval of the difference in success rate, second less first, of runs that were made in pairs.

    Newcombe's method 10 (Statistics in Medicine 17, 1998): the Wilson intervals of the two rates, put together with
    their correlation. The arguments count pairs: both succeed, the first alone, the second alone, neither.
    """
    pairs = both + first + second + neither
    rate_1, rate_2 = (both + first) / pairs, (both + second) / pairs
    (low_1, high_1), (low_2, high_2) = wilson(both + first, pairs), wilson(both + second, pairs)
    correlation = _correlation(both, first, second, neither, pairs)

    def half(d_1: float, d_2: float) -> float:
        return math.sqrt(max(0.0, d_1 * d_1 - 2 * correlation * d_1 * d_2 + d_2 * d_2))

    difference = rate_2 - rate_1
    low = difference - half(high_1 - rate_1, rate_2 - low_2)
    high = difference + half(rate_1 - low_1, high_2 - rate_2)
    return max(-1.0, low), min(1.0, high)


def mean_interval(values: Sequence[float]) -> Interval:
    """The interval of a mean, by the percentiles of the means of resampled values (bootstrap, always seeded alike)."""
    data = np.asarray(values, np.float64)
    means = data[np.random.default_rng(0).integers(len(data), size=(RESAMPLES, len(data)))].mean(axis=1)
    low, high = np.percentile(means, (2.5, 97.5))
    return float(low), float(high)


def _correlation(both: int, first: int, second: int, neither: int, pairs: int) -> float:
    """Phi of the two outcomes, with Newcombe's correction for continuity; 0 where one never varies."""
    margins = (both + first) * (second + neither) * (both + second) * (first + neither)
    if margins == 0:
        return 0.0
    product = both * neither - first * second
    if product > 0:
        product = max(product - pairs / 2, 0.0)
    return product / math.sqrt(margins)
