"""How commands of a robot end, each in a process of its own."""

import signal
import subprocess
import sys
import time

import pytest

PROGRAM = """
import sys, time
from grasping_invisible.data.command import run_command
from grasping_invisible.runtime.errors import GraspingError
from grasping_invisible.runtime.interruption import bounded

def body():
    print("ready", flush=True)
    {body}

sys.exit(run_command("gi-test", body, (GraspingError,), signals=bounded))
"""


def started(body: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", PROGRAM.format(body=body)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


HANGS = """
    try:
        print("in it", flush=True)
        time.sleep(30)
    finally: time.sleep(30)
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interruption_is_bounded_from_the_signal_on(number: signal.Signals) -> None:
    process = started(HANGS)
    assert process.stdout is not None
    assert [process.stdout.readline() for _ in range(2)] == ["ready\n", "in it\n"]
    at = time.monotonic()
    process.send_signal(number)
    time.sleep(0.1)
    process.send_signal(number)  # the second one must not cut the cleaning up short
    assert process.wait(5) == 130
    assert 1.5 < time.monotonic() - at < 2.5
    process.communicate()


HELD = """
    from grasping_invisible.runtime.interruption import interruptions_held
    with interruptions_held():
        print("in it", flush=True)
        time.sleep(0.5)
        print("all done", flush=True)
    print("never said")
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_held_interruption_comes_once_the_block_is_done(number: signal.Signals) -> None:
    process = started(HELD)
    assert process.stdout is not None
    assert [process.stdout.readline() for _ in range(2)] == ["ready\n", "in it\n"]
    process.send_signal(number)
    out, err = process.communicate(timeout=5)
    assert out == "all done\n"
    assert process.returncode == 130, err


def test_nobody_left_to_read_the_complaint_changes_no_exit_code() -> None:
    process = started("time.sleep(0.5); from grasping_invisible.runtime.errors import BadInput; raise BadInput('x')")
    assert process.stderr is not None
    process.stderr.close()
    assert process.wait(20) == 2
    assert process.stdout is not None
    process.stdout.close()
