"""Worker processes that simulate, and what they keep from one piece of work to the next."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path

from grasping_invisible.data.errors import WorkerDied
from grasping_invisible.data.worker import RunAll, worker_pool
from grasping_invisible.runtime.bundle import ModelBundle, load_bundle
from grasping_invisible.runtime.errors import RobotError


@contextmanager
def simulating(workers: int) -> Iterator[RunAll]:
    """A map as of `worker_pool`. Raises `RobotError` where a process is killed or crashes."""
    try:
        with worker_pool(workers) as run_all:
            yield run_all
    except WorkerDied:
        raise RobotError(
            "a worker process was killed or crashed, likely out of memory or in the simulator; "
            "the same command goes on from what is kept"
        ) from None


@lru_cache(maxsize=1)
def loaded_bundle(models: Path | None) -> ModelBundle:
    """The bundle in a folder, or the shipped one, on one thread; checked and opened once in a process."""
    return load_bundle(models, threads=1)
