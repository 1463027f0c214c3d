"""The columns of a dataset, and how its files are written so that the same rows give the same bytes."""

from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from grasping_invisible.data.labels import RULES

FORMAT = 4  # counts up when the columns, their meaning, the order of rows or the division into shards changes
GROUP_ROWS = 64  # rows of a row group: some 8 MB
IMAGES = tuple(f"{when}_{what}" for when in ("before", "after") for what in ("color", "height", "labels"))

_GOAL = pa.struct(
    [
        ("goal", pa.string()),
        ("hindsight", pa.bool_()),
        ("aimed", pa.bool_()),
        ("success", pa.bool_()),
        ("reward", pa.float64()),
        ("border_ratio", pa.float64()),
        ("border_norm", pa.float64()),
    ]
)

SCHEMA = pa.schema(
    [
        # Where it is from.
        ("run_id", pa.string()),
        ("run_started_ns", pa.int64()),
        ("step", pa.int64()),
        ("log_sha256", pa.string()),
        ("corrections_sha256", pa.string()),
        ("project_version", pa.string()),
        ("bundle_sha256", pa.string()),
        ("robot", pa.string()),
        ("scene", pa.string()),
        ("seed", pa.uint64()),
        ("max_motions", pa.int64()),
        # What was decided.
        ("target", pa.string()),
        ("policy", pa.string()),
        ("method", pa.string()),
        ("kind", pa.string()),
        ("rotation", pa.int64()),
        ("row", pa.int64()),
        ("column", pa.int64()),
        ("push_level", pa.int64()),
        ("x", pa.float64()),
        ("y", pa.float64()),
        ("z", pa.float64()),
        ("yaw", pa.float64()),
        ("opening", pa.float64()),
        ("value", pa.float64()),
        ("q_push", pa.float64()),
        ("q_grasp", pa.float64()),
        ("border_ratio", pa.float64()),
        ("border_norm", pa.float64()),
        ("consecutive_grasp_failures", pa.int64()),
        ("grasp_probability", pa.float64()),
        ("target_pixels", pa.int64()),
        # What came of it.
        ("status", pa.string()),
        ("holding", pa.bool_()),
        ("path_fraction", pa.float64()),
        ("scene_changed", pa.bool_()),
        ("target_visible", pa.bool_()),
        ("runtime_target_grasped", pa.bool_()),
        # What it teaches.
        ("usable", pa.bool_()),
        ("why_not", pa.string()),
        ("label_source", pa.string()),
        ("object_grasped", pa.bool_()),
        ("target_grasped", pa.bool_()),
        ("grasped_color", pa.string()),
        ("reward", pa.float64()),
        ("success", pa.bool_()),
        ("grasp_label", pa.bool_()),
        ("revealed", pa.bool_()),
        ("goals", pa.list_(_GOAL)),
        ("rules", pa.struct([(name, pa.int64()) for name in RULES])),
        # What was seen.
        ("frame_stamp_ns", pa.int64()),
        ("after_stamp_ns", pa.int64()),
        ("cells", pa.int64()),
        ("resolution", pa.float64()),
        ("center_x", pa.float64()),
        ("center_y", pa.float64()),
        ("center_z", pa.float64()),
        *((name, pa.binary()) for name in IMAGES),
    ]
)

# The system's allocator gives back what is freed; pyarrow's own would keep some 80 MB.
pa.set_memory_pool(pa.system_memory_pool())

_TEXTS = [field.name for field in SCHEMA if pa.types.is_string(field.type)]
_NUMBERS = [field.name for field in SCHEMA if pa.types.is_primitive(field.type)]
_WRITING: dict[str, Any] = {
    "version": "2.6",
    "data_page_version": "1.0",
    "compression": "NONE",
    # An image too: from one state a branched collection tries dozens of motions, each a row with the image of it.
    "use_dictionary": [*_TEXTS, *IMAGES],
    "dictionary_pagesize_limit": 1 << 28,
    "write_statistics": [*_TEXTS, *_NUMBERS],
    "store_schema": True,
}
# Rows written by another version, or in another way, are the same rows but not the same bytes.
WRITER = f"pyarrow {pa.__version__}, images once"


def open_writer(path: Path) -> pq.ParquetWriter:
    """A writer of rows of `SCHEMA`. Nothing in the file depends on when, where or by whom it is written.

    Nothing is compressed: nearly all of it is PNG. An image that comes again in a column of a row group is stored once.
    """
    return pq.ParquetWriter(path, SCHEMA, **_WRITING)


def table_of(rows: list[dict[str, Any]]) -> pa.Table:
    """Rows as `rows.row_of` makes them, as a table of `SCHEMA`."""
    return pa.Table.from_pylist(rows, schema=SCHEMA)
