"""Rows out of a dataset, a few at a time."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from grasping_invisible.data.dataset.manifest import BadDataset, ShardEntry, read_manifest
from grasping_invisible.data.dataset.placement import split_of


class Dataset:
    """A dataset in a folder, as its manifest describes it."""

    def __init__(self, folder: Path) -> None:
        """Raises `BadDataset` where there is none."""
        self.folder = folder
        self.manifest = read_manifest(folder)

    def shards(self, split: str | None = None) -> list[ShardEntry]:
        """The shards of one split, or of all, in the order of their paths."""
        return [shard for shard in self.manifest.shards if split in (None, split_of(shard.path))]

    def tables(self, shard: ShardEntry, columns: Sequence[str] | None = None) -> Iterator[pa.Table]:
        """The rows of a shard, a row group at a time. Raises `BadDataset` where it cannot be read."""
        path = self.folder / shard.path
        try:
            with pq.ParquetFile(path) as file:
                for group in range(file.num_row_groups):
                    yield file.read_row_group(group, columns)
        except (OSError, pa.ArrowException) as error:
            reason = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise BadDataset(f"{path} cannot be read: {reason}") from None

    def rows(self, split: str | None = None, columns: Sequence[str] | None = None) -> Iterator[dict[str, Any]]:
        """The rows of one split, or of all, in order."""
        for shard in self.shards(split):
            for table in self.tables(shard, columns):
                yield from table.to_pylist()
