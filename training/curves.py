"""How a training went, step by step, in files that TensorBoard reads."""

from collections.abc import Mapping
from pathlib import Path

from tensorboardX import SummaryWriter

FOLDER = "curves"  # beside the checkpoints; one folder for each kind of network in it


class Curves:
    """Values over steps. They are kept until `write`, which is called when the steps they are of are saved.

    So no step is ever drawn twice: a training that goes on from a checkpoint begins where the last written point ends.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._points: list[tuple[int, str, float]] = []
        self._writer: SummaryWriter | None = None

    def add(self, step: int, values: Mapping[str, float]) -> None:
        """Points of several curves at one step."""
        self._points += [(step, name, value) for name, value in values.items()]

    def write(self) -> None:
        """Append what was added to this session's file."""
        if not self._points:
            return
        if self._writer is None:
            # Files are named by the second; two that begin within one must not be the same.
            self._writer = SummaryWriter(str(self._folder), filename_suffix=f".from-{self._points[0][0]:07d}")
        for step, name, value in self._points:
            self._writer.add_scalar(name, value, step)
        self._points.clear()
        self._writer.flush()

    def close(self) -> None:
        """Write the rest and close the file."""
        self.write()
        if self._writer is not None:
            self._writer.close()
            self._writer = None
