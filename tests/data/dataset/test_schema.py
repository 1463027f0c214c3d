from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from grasping_invisible.data.dataset.schema import open_writer, table_of


def test_an_image_that_many_rows_share_is_stored_once(tmp_path: Path) -> None:
    images = [np.random.default_rng(seed).bytes(20_000) for seed in range(2)]
    rows = [{"run_id": f"branch-1/{index}", "before_color": images[index % 2]} for index in range(40)]
    path = tmp_path / "00.parquet"
    with open_writer(path) as writer:
        writer.write_table(table_of(rows))
    assert path.stat().st_size < 3 * 20_000
    assert pq.read_table(path, columns=["before_color"]).column(0).to_pylist() == [row["before_color"] for row in rows]
