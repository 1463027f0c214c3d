"""A small dataset, made of real logs."""

import shutil
from pathlib import Path

import pytest
from rich.console import Console

from grasping_invisible.data.dataset.rebuild import rebuild


@pytest.fixture(scope="session")
def made_once(tmp_path_factory: pytest.TempPathFactory, record, practice) -> Path:
    """Twelve logs, `logs/run-00.mcap` and so on, of three motions each, and `ds`, their dataset."""
    folder = tmp_path_factory.mktemp("dataset")
    for seed in range(12):
        name = f"run-{seed:02d}"
        record(folder / "logs" / f"{name}.mcap", practice(name, seed))
    rebuild([folder / "logs"], folder / "ds", 1, Console(quiet=True))
    return folder


@pytest.fixture
def logs(made_once: Path, tmp_path: Path) -> list[Path]:
    """The twelve logs of different scenes, for a test to change."""
    shutil.copytree(made_once / "logs", tmp_path / "logs")
    return sorted((tmp_path / "logs").iterdir())


@pytest.fixture
def dataset(made_once: Path, tmp_path: Path) -> Path:
    """Their dataset, with runs in train and in validation, for a test to change."""
    shutil.copytree(made_once / "ds", tmp_path / "ds")
    return tmp_path / "ds"
