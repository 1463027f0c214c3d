"""A small dataset, made of real logs."""

from pathlib import Path

import pytest
from rich.console import Console

from grasping_invisible.data.dataset.rebuild import rebuild


@pytest.fixture
def dataset(write_practice, tmp_path: Path) -> Path:
    """Three motions of each of twelve runs, in train and in validation."""
    logs = [write_practice(f"run-{seed:02d}", seed) for seed in range(12)]
    rebuild(logs, tmp_path / "ds", 1, Console(quiet=True))
    return tmp_path / "ds"
