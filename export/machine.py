"""What a figure was measured on, without which it says nothing."""

import os
import platform
from importlib.metadata import version
from pathlib import Path

import msgspec

from grasping_invisible.training.source import source_commit

_LIBRARIES = (
    "grasping-invisible",
    "onnxruntime",
    "numpy",
    "opencv-python-headless",
    "mcap",
    "zstandard",
    "eclipse-zenoh",
    "pyarrow",
)


class Machine(msgspec.Struct, frozen=True):
    """A computer and the software that was measured. `cores`: that this process may use; `load`: at the start."""

    cpu: str
    cores: int
    memory_gb: float
    load: float
    system: str
    python: str
    libraries: dict[str, str]
    commit: str


def machine() -> Machine:
    """This computer, now."""
    return Machine(
        cpu=_cpu_name(),
        cores=len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1,
        memory_gb=round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9, 1),
        load=round(os.getloadavg()[0], 2),
        system=f"{platform.system()} {platform.release()}",
        python=platform.python_version(),
        libraries={name: version(name) for name in _LIBRARIES},
        commit=source_commit(),
    )


def _cpu_name() -> str:
    """The processor's name where the system tells it, else its architecture."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()
