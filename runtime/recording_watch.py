"""Tells a person as soon as a run is no longer recorded."""

from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.recorder import Recorder
from grasping_invisible.runtime.console import RunConsole
from grasping_invisible.runtime.decision import Deliberation
from grasping_invisible.runtime.frame import RgbdFrame
from grasping_invisible.runtime.judge import Judgement
from grasping_invisible.runtime.perception import Perception


class RecordingWatch:
    """A watcher of the loop that says once why recording stopped; the run itself goes on."""

    def __init__(self, recorder: Recorder, console: RunConsole) -> None:
        self._recorder = recorder
        self._console = console
        self._told = False

    def perceived(self, frame: RgbdFrame, perception: Perception, step: int) -> None:
        """See `Watcher`."""
        self._look()

    def decided(self, frame: RgbdFrame, deliberation: Deliberation) -> None:
        """See `Watcher`."""
        self._look()

    def judged(self, deliberation: Deliberation, outcome: gi.MotionOutcome, judgement: Judgement) -> None:
        """See `Watcher`."""
        self._look()

    def _look(self) -> None:
        if self._recorder.failure is not None and not self._told:
            self._told = True
            self._console.say(f"{self._recorder.failure}; the run goes on")
