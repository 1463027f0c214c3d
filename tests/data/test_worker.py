import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from multiprocessing import active_children
from pathlib import Path

import pytest

from grasping_invisible.data.errors import WorkerDied
from grasping_invisible.data.worker import worker_pool

DIED = "a worker process was killed or crashed, likely out of memory; the same command goes on from here"


def test_every_result_comes_once() -> None:
    with worker_pool(2) as run_all:
        assert sorted(run_all(abs, range(-20, 0))) == list(range(1, 21))
        assert list(run_all(abs, [])) == []
        assert list(run_all(abs, [-3])) == [3]


def test_work_is_handed_out_as_results_are_taken() -> None:
    handed_out: list[int] = []

    def numbers() -> Iterator[int]:
        for number in range(1000):
            handed_out.append(number)
            yield number

    with worker_pool(2) as run_all:
        assert next(run_all(abs, numbers())) in handed_out
    assert len(handed_out) < 10


@pytest.mark.parametrize("death", [os._exit, signal.raise_signal])
def test_a_worker_that_dies_ends_the_work_with_an_error(death: Callable[[int], object]) -> None:
    with worker_pool(2) as run_all, pytest.raises(WorkerDied, match=DIED):
        list(run_all(death, [9] * 3))
    assert active_children() == []


def test_what_fails_in_a_worker_fails_here() -> None:
    with worker_pool(2) as run_all, pytest.raises(ValueError, match="math domain error"):
        list(run_all(math.sqrt, [4.0, -1.0, 9.0]))


def test_leaving_waits_for_nothing() -> None:
    begun = time.monotonic()
    with worker_pool(2) as run_all:
        assert next(run_all(time.sleep, [0, *[60] * 20])) is None
    assert active_children() == []
    assert time.monotonic() - begun < 30


PROGRAM = """
import os, time
from grasping_invisible.data.worker import worker_pool

def work(seconds):
    os.write(1, b"begun\\n")
    time.sleep(seconds)

if __name__ == "__main__":
    with worker_pool(2) as run_all:
        list(run_all(work, [120, 120]))
"""


def test_workers_end_with_a_parent_that_was_killed(tmp_path: Path) -> None:
    (tmp_path / "program.py").write_text(PROGRAM)
    process = subprocess.Popen([sys.executable, tmp_path / "program.py"], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert [process.stdout.readline() for _ in range(2)] == ["begun\n"] * 2
    process.kill()
    process.communicate(timeout=30)  # their end of the pipe closes when they end
