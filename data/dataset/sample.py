"""Some rows of a dataset, drawn at random among those that fit."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from grasping_invisible.data.dataset.reader import Dataset
from grasping_invisible.data.dataset.schema import IMAGES, SCHEMA
from grasping_invisible.data.errors import BadRequest

_FILTERABLE = [field.name for field in SCHEMA if field.name not in (*IMAGES, "goals", "rules")]


def draw_rows(
    dataset: Dataset, count: int, seed: int, split: str | None, conditions: Sequence[str]
) -> list[dict[str, Any]]:
    """At most `count` rows, in their order in the dataset; raises `BadRequest` where none fits.

    `conditions`: such as `kind=grasp`, `success=false`, `scene=pile`; all must hold.
    """
    wanted = [_condition(text) for text in conditions]
    columns = sorted({name for name, _ in wanted} | {"step"})
    fitting = [
        index for index, row in enumerate(dataset.rows(split, columns)) if all(_said(row[n]) == v for n, v in wanted)
    ]
    if not fitting:
        raise BadRequest(f"no row of {dataset.folder} fits {', '.join(conditions) or split}")
    order = np.random.default_rng(seed).permutation(len(fitting))[:count]
    chosen = {fitting[index] for index in order}
    rows: list[dict[str, Any]] = []
    start = 0
    for shard in dataset.shards(split):
        for table in dataset.tables(shard):
            here = sorted(index - start for index in chosen if start <= index < start + len(table))
            rows += [row for index in here for row in table.slice(index, 1).to_pylist()]
            start += len(table)
    return rows


def _condition(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals or name not in _FILTERABLE:
        raise BadRequest(f"--where {text!r} is not COLUMN=VALUE with one of the columns {', '.join(_FILTERABLE)}")
    return name, value.lower()


def _said(value: Any) -> str:
    """A value as people write it."""
    return f"{value:g}" if isinstance(value, float) else str(value).lower()
