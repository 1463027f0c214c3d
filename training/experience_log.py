"""Logs of collected experience: a robot's messages, without the pictures that training does not need."""

from pathlib import Path

from grasping_invisible.data import topics
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.recorder import Recorder
from grasping_invisible.data.topics import Topic
from grasping_invisible.runtime.bus import Bus
from grasping_invisible.runtime.frame import RgbdFrame
from grasping_invisible.sim_robot.robot import SimRobot

# What makes a transition; the rest of a robot's log is pictures for people, or can be computed again.
KEPT = frozenset(
    {
        topics.RUN_START,
        topics.HEIGHTMAPS,
        topics.TRUTH,
        topics.DECISION,
        topics.COMMAND,
        topics.OUTCOME,
        topics.STEP_RESULT,
        topics.RUN_SUMMARY,
    }
)


class ExperienceLog:
    """A bus whose messages are kept in one MCAP file, as far as training needs them."""

    def __init__(self, path: Path) -> None:
        self._recorder = Recorder(path)
        self.bus = Bus(sinks=(self._keep,))

    def close(self) -> None:
        """Complete the file. Raises `OSError` where it could not be written."""
        self._recorder.close()
        if self._recorder.failure is not None:
            raise OSError(self._recorder.failure)

    def _keep(self, topic: Topic, payload: bytes, time_ns: int) -> None:
        if topic in KEPT:
            self._recorder.put(topic, payload, time_ns)


class SpokenRobot:
    """A simulated robot in this process that says on a bus what one on the link would say: truth and motions."""

    def __init__(self, robot: SimRobot, bus: Bus) -> None:
        self._robot = robot
        self._bus = bus

    def observe(self) -> RgbdFrame:
        """See `Robot`."""
        frame = self._robot.observe()
        self._bus.publish(topics.TRUTH, self._robot.truth())
        return frame

    def execute(self, command: gi.MotionCommand) -> gi.MotionOutcome:
        """See `Robot`."""
        self._bus.publish(topics.COMMAND, command)
        outcome = self._robot.execute(command)
        self._bus.publish(topics.OUTCOME, outcome)
        return outcome

    def stop(self, reason: str) -> None:
        """See `Robot`."""
        self._robot.stop(reason)

    def close(self) -> None:
        """See `Robot`."""
        self._robot.close()
