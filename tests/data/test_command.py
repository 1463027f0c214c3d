import signal
import subprocess
import sys

import pytest

from grasping_invisible.data.command import run_command
from grasping_invisible.data.errors import BadLog


def test_an_error_that_quotes_a_log_stays_one_harmless_line(capsys: pytest.CaptureFixture[str]) -> None:
    def body() -> int:
        raise BadLog("run \x1b[31m\n\r\0 of a  b.mcap, für immer")

    assert run_command("gi-log", body) == 2
    assert capsys.readouterr().err == "gi-log: run \\x1b[31m  \\x00 of a  b.mcap, für immer\n"


def test_an_interruption_is_explained(capsys: pytest.CaptureFixture[str]) -> None:
    def body() -> int:
        raise KeyboardInterrupt

    assert run_command("gi-dataset", body, "interrupted; go on") == 130
    assert capsys.readouterr().err == "gi-dataset: interrupted; go on\n"


PROGRAM = """
import signal, sys, time
from grasping_invisible.data.command import run_command

def body():
    print("ready", flush=True)
    for _ in range(600):  # a signal just ahead of one long sleep would be seen at its end
        time.sleep(0.1)

sys.exit(run_command("gi-test", body, "what was done is kept"))
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
