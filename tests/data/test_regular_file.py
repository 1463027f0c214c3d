import os
import socket
from pathlib import Path

import pytest

from grasping_invisible.data.cli import main
from grasping_invisible.data.file_hash import file_sha256
from grasping_invisible.data.log_file import is_being_written
from grasping_invisible.data.log_storage import keep_within
from grasping_invisible.data.regular_file import open_regular


@pytest.fixture
def pipe(tmp_path: Path) -> Path:
    path = tmp_path / "pipe.mcap"
    os.mkfifo(path)
    return path


def test_a_file_is_opened(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"abc")
    with open_regular(tmp_path / "a") as file:
        assert file.read() == b"abc"


def test_what_is_no_regular_file_is_refused_at_once(pipe: Path, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)  # a socket's path must be short
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind("socket.mcap")
    for path in (pipe, tmp_path / "socket.mcap", Path("/dev/zero")):
        with pytest.raises(OSError, match="no regular file"):
            open_regular(path)
    with pytest.raises(IsADirectoryError):
        open_regular(tmp_path)
    with pytest.raises(FileNotFoundError):
        open_regular(tmp_path / "none")


def test_nothing_waits_for_a_pipe(pipe: Path) -> None:
    assert not is_being_written(pipe)
    with pytest.raises(OSError, match="no regular file"):
        file_sha256(pipe)
    assert keep_within(pipe.parent, 0) == []
    assert pipe.exists()


@pytest.mark.parametrize("command", ["info", "show", "check", "replay"])
def test_a_pipe_that_is_named_is_one_line_and_code_2(pipe: Path, capsys, command: str) -> None:
    assert main([command, str(pipe)]) == 2
    said = capsys.readouterr().err
    assert "pipe.mcap: it is no regular file" in said
    assert said.count("\n") == 1


@pytest.mark.parametrize(("command", "code"), [("ls", 0), ("relabel", 1)])
def test_a_pipe_in_a_folder_is_left_out(pipe: Path, write_practice, capsys, command: str, code: int) -> None:
    write_practice("a", 1)
    assert main([command, str(pipe.parent)]) == code
    said = capsys.readouterr().out
    assert "1 logs" in said
    assert "pipe.mcap: it is no regular file" in said


@pytest.mark.parametrize("suffix", ["corrections.csv", "labels.jsonl"])
def test_a_pipe_beside_a_log_is_not_waited_for(write_practice, capsys, suffix: str) -> None:
    log = write_practice("a", 1)
    os.mkfifo(log.with_name(f"a.{suffix}"))
    assert main(["relabel", str(log)]) == 1
    assert f"a.{suffix}: it is no regular file" in capsys.readouterr().out
