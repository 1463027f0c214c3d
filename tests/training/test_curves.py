from pathlib import Path

from grasping_invisible.training.curves import Curves


def size(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def test_nothing_is_in_the_file_before_it_is_written(tmp_path: Path) -> None:
    """What a kill leaves behind is what was written with the last checkpoint."""
    curves = Curves(tmp_path)
    curves.add(1, {"loss": 1.0})
    assert size(tmp_path) == 0
    curves.write()
    written = size(tmp_path)
    assert written > 0
    curves.add(2, {"loss": 0.5})
    assert size(tmp_path) == written
    curves.close()
    assert size(tmp_path) > written


def test_a_training_without_points_leaves_no_file(tmp_path: Path) -> None:
    Curves(tmp_path / "curves").close()
    assert not (tmp_path / "curves").exists()
