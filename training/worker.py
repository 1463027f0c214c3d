"""What worker processes keep from one piece of work to the next."""

from functools import lru_cache
from pathlib import Path

from grasping_invisible.runtime.bundle import ModelBundle, load_bundle


@lru_cache(maxsize=1)
def loaded_bundle(models: Path | None) -> ModelBundle:
    """The bundle in a folder, or the shipped one, on one thread; checked and opened once in a process."""
    return load_bundle(models, threads=1)
