import json
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from grasping_invisible.data.dataset.check import problems_of
from grasping_invisible.data.dataset.manifest import FILE_NAME, content_sha256, read_manifest
from grasping_invisible.data.dataset.reader import Dataset
from grasping_invisible.data.dataset.schema import SCHEMA, open_writer
from grasping_invisible.data.file_hash import file_sha256


def problems(dataset: Path) -> str:
    return "\n".join(problems_of(Dataset(dataset)))


def first_shard(dataset: Path) -> Path:
    return dataset / read_manifest(dataset).shards[0].path


def replace_shard(dataset: Path, table, writer=None) -> None:
    """Put other rows into the first shard, and into the manifest that they are meant to be there."""
    path = first_shard(dataset)
    if writer is None:
        with open_writer(path) as writer:
            writer.write_table(table)
    else:
        writer(table, path)
    manifest = json.loads((dataset / FILE_NAME).read_text())
    manifest["shards"][0]["sha256"] = file_sha256(path)
    (dataset / FILE_NAME).write_text(json.dumps(manifest))
    manifest["sha256"] = content_sha256(read_manifest(dataset).shards)
    (dataset / FILE_NAME).write_text(json.dumps(manifest))


def test_a_whole_dataset_has_no_problems(dataset: Path) -> None:
    assert problems(dataset) == ""


def test_a_flipped_bit_is_found(dataset: Path) -> None:
    path = first_shard(dataset)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    assert "its hash differs" in problems(dataset)


def test_missing_and_foreign_shards_are_found(dataset: Path) -> None:
    path = first_shard(dataset)
    path.rename(path.with_name("99.parquet"))
    said = problems(dataset)
    assert f"{path.parent.name}/{path.name} is missing" in said
    assert "99.parquet is not in the manifest" in said


def test_a_manifest_that_was_edited_is_found(dataset: Path) -> None:
    manifest = json.loads((dataset / FILE_NAME).read_text())
    manifest["shards"][0]["sha256"] = "0" * 64
    (dataset / FILE_NAME).write_text(json.dumps(manifest))
    assert "the manifest's hash is not that of its shards" in problems(dataset)


def test_a_run_on_both_sides_is_found(dataset: Path) -> None:
    manifest = json.loads((dataset / FILE_NAME).read_text())
    train, validation = manifest["shards"][0], manifest["shards"][-1]
    assert (train["path"][:5], validation["path"][:5]) == ("train", "valid")
    validation["runs"].append(train["runs"][0])
    (dataset / FILE_NAME).write_text(json.dumps(manifest))
    assert f"run {train['runs'][0]['run_id']} is in train and in validation" in problems(dataset)


def test_two_runs_may_have_one_name(dataset: Path) -> None:
    """Collections of two stages name their runs alike, and tell them apart by when they began."""
    manifest = json.loads((dataset / FILE_NAME).read_text())
    train, validation = manifest["shards"][0], manifest["shards"][-1]
    validation["runs"][0]["run_id"] = train["runs"][0]["run_id"]
    validation["runs"][0]["started_ns"] = train["runs"][0]["started_ns"] + 1
    (dataset / FILE_NAME).write_text(json.dumps(manifest))
    assert not any("is in train and in validation" in line for line in problems(dataset))


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda row: row | {"before_color": b"\x89PNG cut"}, "step 0: before_color: 8 bytes"),
        (lambda row: row | {"after_height": row["after_labels"]}, "after_height: expected one plane of uint16"),
        (lambda row: row | {"before_labels": None}, "before_labels is missing"),
        (lambda row: row | {"cells": 112}, "before_height: expected an image of shape (112, 112)"),
        (lambda row: row | {"run_id": "other"}, "its rows are not those of the runs that the manifest lists"),
    ],
)
def test_rows_that_are_wrong_are_found(dataset: Path, change, complaint: str) -> None:
    rows = pq.ParquetFile(first_shard(dataset)).read().to_pylist()
    replace_shard(dataset, SCHEMA.empty_table().from_pylist([change(rows[0]), *rows[1:]], SCHEMA))
    assert complaint in problems(dataset)


def test_other_columns_are_found(dataset: Path) -> None:
    table = pq.ParquetFile(first_shard(dataset)).read()
    replace_shard(dataset, table.drop_columns(["reward"]), pq.write_table)
    assert "its columns are not those of this version" in problems(dataset)
