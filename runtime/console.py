"""What a person sees while the robot works: the motion, where, why, the values, the time each stage took."""

import math
import time
from typing import TextIO

from foxglove_schemas_protobuf.Log_pb2 import Log
from rich.console import Console
from rich.text import Text

from grasping_invisible.data.clock import to_timestamp
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.stream import let_go
from grasping_invisible.data.topics import CONSOLE
from grasping_invisible.runtime.bus import Bus
from grasping_invisible.runtime.decision import Deliberation
from grasping_invisible.runtime.frame import RgbdFrame
from grasping_invisible.runtime.judge import Judgement
from grasping_invisible.runtime.perception import Perception

_INDENT = "      "
_KIND_STYLE = {gi.PUSH: "bold yellow", gi.GRASP: "bold green"}


class _Output(Console):
    def on_broken_pipe(self) -> None:
        """A watcher who leaves must not stop a robot; rich would end the process."""
        self.give_up()

    def give_up(self) -> None:
        """Print no more, nor what is still to be flushed when the process ends."""
        self.quiet = True
        let_go(self.file)


class RunConsole:
    """A watcher of the loop that prints, and says on the bus what it printed."""

    def __init__(self, stream: TextIO, bus: Bus) -> None:
        self._console = _Output(file=stream, highlight=False, soft_wrap=True)
        self._bus = bus

    def say(self, text: str | Text) -> None:
        """Print a line. A terminal that has gone, or a full disk behind it, is no reason to lose the run or its log."""
        line = text if isinstance(text, Text) else Text(text)
        try:
            self._console.print(line)
        except OSError:
            self._console.give_up()
        message = Log(timestamp=to_timestamp(time.time_ns()), level=Log.INFO, message=line.plain, name="gi-runtime")
        self._bus.publish(CONSOLE, message)

    def perceived(self, frame: RgbdFrame, perception: Perception, step: int) -> None:
        """See `Watcher`; what is seen is told with the decision."""

    def decided(self, frame: RgbdFrame, deliberation: Deliberation) -> None:
        """See `Watcher`."""
        decision = deliberation.decision
        x, y, z = decision.position
        self.say(
            Text.assemble(
                (f"{decision.step + 1:4}  ", "bold"),
                (f"{gi.MotionKind.Name(decision.kind).lower():6}", _KIND_STYLE.get(decision.kind, "bold")),
                f"at x {x:.3f}  y {y:+.3f}  z {z:.3f} m, yaw {math.degrees(decision.yaw):.0f}°",
                (f"   {decision.policy}", "cyan"),
            )
        )
        self.say(f"{_INDENT}{decision.why}")
        self.say(Text(_INDENT + _values(deliberation), "dim"))
        self.say(Text(_INDENT + _times(deliberation), "dim"))

    def judged(self, deliberation: Deliberation, outcome: gi.MotionOutcome, judgement: Judgement) -> None:
        """See `Watcher`."""
        status = gi.MotionStatus.Name(outcome.status).lower()
        style = "green" if judgement.target_grasped else "" if outcome.status == gi.COMPLETED else "yellow"
        self.say(Text(f"{_INDENT}{status}: {judgement.detail}", style))


def _values(deliberation: Deliberation) -> str:
    decision = deliberation.decision
    probability = decision.grasp_probability
    return "  ".join(
        (
            f"value {decision.value:.3f}",
            f"q_p {decision.q_push:.3f}",
            f"q_g {decision.q_grasp:.3f}",
            f"r_b {decision.border_ratio:.2f}",
            f"n_b {decision.border_norm:.2f}",
            f"c_g {decision.memory.consecutive_grasp_failures}",
            f"p_grasp {'-' if probability is None else format(probability, '.2f')}",
        )
    )


def _times(deliberation: Deliberation) -> str:
    stages = deliberation.stage_ms
    return "  ".join(f"{name} {ms:.1f}" for name, ms in stages.items()) + f"  = {sum(stages.values()):.1f} ms"
