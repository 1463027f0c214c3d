"""A dataset is read by what others read Parquet with, without this project's code."""

from pathlib import Path

import cv2
import duckdb
import numpy as np
import pandas as pd
import pyarrow.dataset


def test_pyarrow(dataset: Path) -> None:
    table = pyarrow.dataset.dataset(dataset / "train").to_table(["run_id", "step", "goals", "before_height"])
    assert len(table) > 0
    counts = cv2.imdecode(np.frombuffer(table["before_height"][0].as_py(), np.uint8), cv2.IMREAD_UNCHANGED)
    assert counts is not None
    assert (counts.dtype, counts.shape, counts.max()) == (np.uint16, (224, 224), 500)  # 0.1 mm


def test_pandas(dataset: Path) -> None:
    sides = {split: pd.read_parquet(dataset / split) for split in ("train", "validation")}
    assert sum(map(len, sides.values())) == 36
    assert not set(sides["train"].run_id) & set(sides["validation"].run_id)
    grasps = sides["train"][sides["train"].kind == "grasp"]
    assert (grasps.reward == 1.0).all()
    assert grasps.goals.iloc[0][0]["goal"] == "red"


def test_duckdb(dataset: Path) -> None:
    query = f"""
        select kind, count(*), avg(reward), sum(len(goals)) from '{dataset}/*/*.parquet' group by kind order by kind
    """
    assert duckdb.execute(query).fetchall() == [("grasp", 12, 1.0, 12), ("push", 24, 0.25, 24)]
    goals = f"select unnest(goals) goal from '{dataset}/*/*.parquet'"
    assert duckdb.execute(f"select distinct goal.goal from ({goals})").fetchall() == [("red",)]
