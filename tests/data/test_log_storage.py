import os
from pathlib import Path

from grasping_invisible.data.log_file import LogFile
from grasping_invisible.data.log_storage import keep_within, part_path, parts_of


def put_log(folder: Path, name: str, size: int, age: int) -> Path:
    path = folder / name
    path.write_bytes(bytes(size))
    os.utime(path, (1_000_000 - age, 1_000_000 - age))
    return path


def test_the_oldest_go_first_and_only_as_many_as_needed(tmp_path: Path) -> None:
    oldest, older, newest = (
        put_log(tmp_path, name, 100, age) for name, age in (("c.mcap", 3), ("a.mcap", 2), ("b.mcap", 1))
    )
    assert keep_within(tmp_path, 200) == [oldest]
    assert older.exists()
    assert newest.exists()


def test_a_log_being_written_stays(tmp_path: Path) -> None:
    in_use = LogFile(tmp_path / "now.mcap")
    os.utime(in_use.path, (1, 1))
    closed = put_log(tmp_path, "closed.mcap", 100, 1)
    assert keep_within(tmp_path, 0) == [closed]
    assert in_use.path.exists()
    in_use.finish()


def test_a_log_of_which_a_part_is_being_written_stays_whole(tmp_path: Path) -> None:
    early = [put_log(tmp_path, name, 100, 9) for name in ("run.mcap", "run.001.mcap")]
    in_use = LogFile(tmp_path / "run.002.mcap")
    other = put_log(tmp_path, "run-2.mcap", 100, 1)
    assert keep_within(tmp_path, 0) == [other]
    assert all(part.exists() for part in early)
    in_use.finish()


def test_a_log_goes_with_all_its_parts(tmp_path: Path) -> None:
    parts = [put_log(tmp_path, name, 100, age) for name, age in (("old.001.mcap", 5), ("old.mcap", 9))]
    between = put_log(tmp_path, "single.mcap", 100, 7)  # older than the old log's last part
    newest = put_log(tmp_path, "new.mcap", 100, 1)
    assert keep_within(tmp_path, 250) == [between, *parts]
    assert newest.exists()


def test_other_files_are_left_alone(tmp_path: Path) -> None:
    other = tmp_path / "notes.txt"
    other.write_bytes(bytes(1000))
    assert keep_within(tmp_path, 0) == []
    assert other.exists()


def test_a_log_with_the_longest_name_has_one_part(tmp_path: Path) -> None:
    first = tmp_path / f"{'a' * 250}.mcap"
    first.touch()
    assert parts_of(first) == [first]


def test_parts_follow_the_first(tmp_path: Path) -> None:
    first = tmp_path / "run.mcap"
    for part in (0, 1, 2, 4):
        part_path(first, part).touch()
    assert [path.name for path in parts_of(first)] == ["run.mcap", "run.001.mcap", "run.002.mcap"]
