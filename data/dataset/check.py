"""Whether a dataset is what its manifest says."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from grasping_invisible.data.dataset.manifest import content_sha256
from grasping_invisible.data.dataset.placement import SHARDS, VALIDATION, split_of
from grasping_invisible.data.dataset.reader import Dataset
from grasping_invisible.data.dataset.schema import IMAGES, SCHEMA
from grasping_invisible.data.errors import BadMessage, DataError
from grasping_invisible.data.file_hash import file_sha256
from grasping_invisible.data.png import decode_color_image, decode_plane

_PLANES = {"height": np.uint16, "labels": np.uint8}
_MOST_LINES = 20  # for one shard: the rest says the same


def problems_of(dataset: Dataset) -> Iterator[str]:
    """Everything wrong with a dataset, a line each; reads all of it and decodes every picture."""
    manifest = dataset.manifest
    if content_sha256(manifest.shards) != manifest.sha256:
        yield "the manifest's hash is not that of its shards"
    known = {shard.path for shard in manifest.shards}
    for split in SHARDS:
        for path in sorted((dataset.folder / split).glob("*")):
            if path.relative_to(dataset.folder).as_posix() not in known:
                yield f"{split}/{path.name} is not in the manifest"
    yield from _on_both_sides(dataset)
    for shard in manifest.shards:
        path = dataset.folder / shard.path
        if not path.is_file():
            yield f"{shard.path} is missing"
        elif file_sha256(path) != shard.sha256:
            yield f"{shard.path} is not the file that the manifest describes: its hash differs"
        else:
            problems = list(_problems_in(dataset, shard.path))
            yield from problems[:_MOST_LINES]
            if len(problems) > _MOST_LINES:
                yield f"{shard.path}: {len(problems) - _MOST_LINES} more"


def _on_both_sides(dataset: Dataset) -> Iterator[str]:
    places: dict[tuple[str, int], set[str]] = {}
    for shard in dataset.manifest.shards:
        for run in shard.runs:
            places.setdefault((run.run_id, run.started_ns), set()).add(shard.path)
    for (run_id, _), paths in places.items():
        splits = {split_of(path) for path in paths}
        if len(splits) > 1:
            yield f"run {run_id} is in {' and in '.join(sorted(splits, key=lambda split: split == VALIDATION))}"
    for (run_id, _), paths in places.items():
        if len(paths) > 1:
            yield f"run {run_id} is in {len(paths)} shards"


def _problems_in(dataset: Dataset, path: str) -> Iterator[str]:
    shard = next(shard for shard in dataset.manifest.shards if shard.path == path)
    expected = [(run.run_id, run.started_ns) for run in shard.runs for _ in range(run.rows)]
    found: list[tuple[str, int]] = []
    try:
        for table in dataset.tables(shard):
            if not table.schema.equals(SCHEMA):
                yield f"{path}: its columns are not those of this version"
                return
            for row in table.to_pylist():
                found.append((row["run_id"], row["run_started_ns"]))
                yield from (f"{path}, run {row['run_id']}, step {row['step']}: {line}" for line in _row_problems(row))
    except DataError as error:
        yield str(error)
        return
    if found != expected:
        yield f"{path}: its rows are not those of the runs that the manifest lists"


def _row_problems(row: dict[str, Any]) -> Iterator[str]:
    shape = row["cells"], row["cells"]
    for name in IMAGES:
        if row[name] is None:
            if name.startswith("before"):
                yield f"{name} is missing"
            continue
        try:
            if name.endswith("color"):
                decode_color_image(row[name])
            else:
                decode_plane(row[name], _PLANES[name.partition("_")[2]], shape if row["usable"] else None)
        except BadMessage as error:
            yield f"{name}: {error}"
