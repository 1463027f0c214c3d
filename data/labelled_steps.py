"""The steps of a log with their labels and their heightmaps, each decoded once."""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from grasping_invisible.data.corrections import Corrections
from grasping_invisible.data.errors import BadMessage
from grasping_invisible.data.heightmap_message import HeightmapArrays, decode_heightmaps
from grasping_invisible.data.labels import StepLabel, label_step
from grasping_invisible.data.log_commands import wording
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.steps import LABELLED_FROM, LoggedStep, steps

KNOWN = 3  # decoded heightmaps that are kept: motions one after the other, or many tried from one state, share them
_Known = deque[tuple[gi.Heightmaps, HeightmapArrays]]  # messages as decoded


@dataclass(frozen=True)
class LabelledStep:
    """A step and what it teaches."""

    step: LoggedStep
    label: StepLabel

    @property
    def run_id(self) -> str:
        """Of the step's run; empty where its start is not in the log."""
        return self.step.start.run_id if self.step.start is not None else ""


def labelled_steps(log: Path, damage: list[str] | None = None) -> Iterator[LabelledStep]:
    """Label the steps of the runs whose log begins at `log`, by rules and by the corrections beside it.

    `damage`, if given, takes a line for everything wrong. Raises `BadLog` when nothing can be read, and at the end
    `BadCorrections` where one does not fit the log.
    """
    corrections = Corrections(log)
    kinds: dict[tuple[str, int], str] = {}
    known: _Known = deque(maxlen=KNOWN)
    for step in steps(log, LABELLED_FROM, damage):
        before = _decoded(step.heightmaps, known, damage)
        after = _decoded(step.next_heightmaps, known, damage)
        run_id = step.start.run_id if step.start is not None else ""
        kinds[run_id, step.decision.step] = wording.kind(step.decision.kind)
        yield LabelledStep(step, label_step(step, before, after, corrections.of(run_id, step.decision.step)))
    corrections.check_against(kinds)


def _decoded(message: gi.Heightmaps | None, known: _Known, damage: list[str] | None) -> HeightmapArrays | None:
    """The maps in a message, decoded anew unless an equal one is `known`; None where they are damaged.

    Maps of one frame can differ: the speckle is removed of what was the target.
    """
    if message is None:
        return None
    for equal, maps in known:
        if equal == message:
            return maps
    try:
        maps = decode_heightmaps(message)
        known.append((message, maps))
        return maps
    except BadMessage as error:
        if damage is not None:
            damage.append(f"the heightmaps of step {message.step}: {error}")
        return None
