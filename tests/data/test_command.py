import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from grasping_invisible.data.command import run_command
from grasping_invisible.data.errors import BadLog, DataError


def test_an_error_that_quotes_a_log_stays_one_harmless_line(capsys: pytest.CaptureFixture[str]) -> None:
    def body() -> int:
        raise BadLog("run \x1b[31m\n\r\0 of a  b.mcap, für immer")

    assert run_command("gi-log", body, (DataError,)) == 2
    assert capsys.readouterr().err == "gi-log: run \\x1b[31m  \\x00 of a  b.mcap, für immer\n"


def test_an_interruption_is_explained(capsys: pytest.CaptureFixture[str]) -> None:
    def body() -> int:
        raise KeyboardInterrupt

    assert run_command("gi-dataset", body, (DataError,), "interrupted; go on") == 130
    assert capsys.readouterr().err == "gi-dataset: interrupted; go on\n"


def test_an_error_ends_a_command_with_its_own_code(capsys: pytest.CaptureFixture[str]) -> None:
    class Refused(Exception):
        exit_code = 3

    def body() -> int:
        raise Refused("the robot is away")

    assert run_command("gi-test", body, (DataError, Refused)) == 3
    assert capsys.readouterr().err == "gi-test: the robot is away\n"


def test_a_file_that_cannot_be_used_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def body() -> int:
        (tmp_path / "nowhere").read_bytes()
        return 0

    assert run_command("gi-test", body, (OSError,)) == 2
    assert capsys.readouterr().err == f"gi-test: {tmp_path / 'nowhere'}: No such file or directory\n"


def test_what_nobody_foresaw_is_a_traceback_and_70(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command("gi-test", lambda: [][3], (DataError, OSError)) == 70
    said = capsys.readouterr().err
    assert "Traceback" in said
    assert said.splitlines()[-1].startswith("gi-test: a fault of this program: IndexError(")


READERLESS = """
import sys
from rich.console import Console
from grasping_invisible.data.command import run_command

def body():
    for stream in (sys.stdout, sys.stderr):
        Console(file=None, stderr=stream is sys.stderr).print("begun")
        print("half done", file=stream, flush=True)
    open(sys.argv[1], "w").write("done")
    print("done")
    return 1

sys.exit(run_command("gi-test", body, (OSError,)))
"""


@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_a_reader_that_leaves_ends_no_work(tmp_path: Path, unbuffered: str) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "w") as nobody:
        done = subprocess.run(
            [sys.executable, "-c", READERLESS, str(tmp_path / "work")],
            stdout=nobody,
            stderr=nobody,
            env={**os.environ, "PYTHONUNBUFFERED": unbuffered},
            check=False,
        )
    assert (tmp_path / "work").read_text() == "done"
    assert done.returncode == 1


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
def test_output_that_cannot_be_kept_is_an_error() -> None:
    program = READERLESS.replace("(sys.stdout, sys.stderr)", "()")
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-c", program, os.devnull], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert (done.returncode, done.stderr) == (2, "gi-test: files: No space left on device\n")


PROGRAM = """
import signal, sys, time
from grasping_invisible.data.command import run_command

def body():
    print("ready", flush=True)
    for _ in range(600):  # a signal just ahead of one long sleep would be seen at its end
        time.sleep(0.1)

sys.exit(run_command("gi-test", body, (), "what was done is kept"))
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("before", [signal.SIG_DFL, signal.SIG_IGN], ids=["foreground", "background"])
def test_a_signal_ends_a_command_also_where_a_shell_had_it_ignored(
    number: signal.Signals, before: signal.Handlers
) -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", PROGRAM],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, before),
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    process.send_signal(number)
    _, said = process.communicate(timeout=20)
    assert process.returncode == 130
    assert said == "gi-test: what was done is kept\n"
