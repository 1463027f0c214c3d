"""Figures about times."""

from collections.abc import Sequence

import numpy as np


def percentile(values: Sequence[float], percent: float) -> float:
    """The percentile of values, interpolated; 0 of none."""
    return float(np.percentile(values, percent)) if values else 0.0
