from pathlib import Path

import pytest

from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.training.given_files import files_at


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "below").mkdir()
    for name in ("b.log", "a.log", "other", "below/c.log"):
        (tmp_path / name).touch()
    return tmp_path


def test_a_folder_stands_for_its_files_by_name_and_a_file_for_itself(folder: Path):
    given = [folder / "other", folder]
    assert files_at(given, "logs", "*.log") == [folder / "other", folder / "a.log", folder / "b.log"]


def test_files_below_count_where_the_pattern_says_so(folder: Path):
    assert files_at([folder], "logs", "**/*.log") == [folder / name for name in ("a.log", "b.log", "below/c.log")]


def test_a_folder_without_any_is_named(folder: Path):
    with pytest.raises(BadInput, match=r"below holds no results \(\*\.jsonl\)"):
        files_at([folder / "below"], "results", "**/*.jsonl")
