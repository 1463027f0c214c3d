"""A log as the steps of its run: what was seen, what was decided, and what came of it."""

from collections import OrderedDict
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from grasping_invisible.data import topics
from grasping_invisible.data.clock import to_ns
from grasping_invisible.data.log_reader import LoggedMessage, readers_of
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi

_TOPICS = (
    topics.RUN_START.key,
    topics.HEIGHTMAPS.key,
    topics.Q_MAPS.key,
    topics.DECISION.key,
    topics.COMMAND.key,
    topics.OUTCOME.key,
    topics.STEP_RESULT.key,
    topics.RUN_SUMMARY.key,
    topics.TRUTH.key,
)
# Without what is large, or for people and simulators only.
LABELLED_FROM = tuple(key for key in _TOPICS if key not in (topics.Q_MAPS.key, topics.TRUTH.key))
_TRUTHS_KEPT = 64


@dataclass(frozen=True)
class LoggedStep:
    """One decision and all that belongs to it; what the log does not hold is None.

    `next_heightmaps` and `next_truth` are those of the following step: the scene after the motion.
    Truth comes from a simulator only and is never for decisions.
    """

    decision: gi.Decision
    start: gi.RunStart | None = None
    heightmaps: gi.Heightmaps | None = None
    q_maps: gi.QMaps | None = None
    command: gi.MotionCommand | None = None
    outcome: gi.MotionOutcome | None = None
    result: gi.StepResult | None = None
    truth: gi.TruthState | None = None
    next_heightmaps: gi.Heightmaps | None = None
    next_truth: gi.TruthState | None = None


def steps(path: Path, wanted: Collection[str] = _TOPICS, damage: list[str] | None = None) -> Iterator[LoggedStep]:
    """The steps of the runs whose log begins at `path`, over all its parts, in order.

    Holds two steps at a time. `wanted`: topics to read. `damage`, if given, takes a line for everything wrong. What
    follows the end of a run, or begins its steps anew, is of one whose start the log has lost. Raises `BadLog` when
    nothing can be read.
    """
    run = _Run()
    for reader in readers_of(path):
        for logged in reader.messages(wanted):
            if isinstance(logged.message, gi.RunStart):
                yield from run.finish()
                run = _Run(start=logged.message)
                continue
            if run.has_ended(logged.message):
                yield from run.finish()
                run = _Run()
            yield from run.take(logged)
        if damage is not None:
            damage += reader.named_damage
    yield from run.finish()


@dataclass
class _Parts:
    """What has been read of one step so far."""

    decision: gi.Decision | None = None
    heightmaps: gi.Heightmaps | None = None
    q_maps: gi.QMaps | None = None
    command: gi.MotionCommand | None = None
    outcome: gi.MotionOutcome | None = None
    result: gi.StepResult | None = None


@dataclass
class _Run:
    """Sorts messages into steps; a step is done when the next one is decided."""

    start: gi.RunStart | None = None
    parts: OrderedDict[int, _Parts] = field(default_factory=OrderedDict)
    truths: OrderedDict[int, gi.TruthState] = field(default_factory=OrderedDict)
    deciding: int | None = None  # the step that commands and outcomes belong to
    summed_up: bool = False

    def has_ended(self, message: object) -> bool:
        """Whether a message is of another run."""
        if not isinstance(message, gi.Heightmaps | gi.Decision):
            return False
        return self.summed_up or (self.deciding is not None and message.step <= self.deciding)

    def take(self, logged: LoggedMessage) -> Iterator[LoggedStep]:
        message = logged.message
        if isinstance(message, gi.RunSummary):
            self.summed_up = True
        elif isinstance(message, gi.TruthState):
            self.truths[to_ns(message.stamp)] = message
            if len(self.truths) > _TRUTHS_KEPT:
                self.truths.popitem(last=False)
        elif isinstance(message, gi.Heightmaps):
            self._step(message.step).heightmaps = message
        elif isinstance(message, gi.QMaps):
            self._step(message.step).q_maps = message
        elif isinstance(message, gi.Decision):
            self._step(message.step).decision = message
            self.deciding = message.step
            yield from self._finish_before(message.step)
        elif isinstance(message, gi.StepResult):
            self._step(message.step).result = message
        elif self.deciding is not None:
            self._take_motion(self._step(self.deciding), message)

    def finish(self) -> Iterator[LoggedStep]:
        yield from self._finish_before(None)

    def _step(self, step: int) -> _Parts:
        return self.parts.setdefault(step, _Parts())

    def _take_motion(self, parts: _Parts, message: object) -> None:
        # A run also commands motions nobody decided on, such as HOME: they belong to no step.
        decided, command = parts.decision, parts.command
        if isinstance(message, gi.MotionCommand):
            if command is None and decided is not None and message.kind == decided.kind:
                parts.command = message
        elif command is not None and isinstance(message, gi.MotionOutcome) and message.command_id == command.id:
            parts.outcome = message

    def _finish_before(self, step: int | None) -> Iterator[LoggedStep]:
        while self.parts and (step is None or next(iter(self.parts)) < step):
            number, done = self.parts.popitem(last=False)
            following = self.parts.get(number + 1, _Parts())  # another one does not show what came of this
            if done.decision is not None:
                yield LoggedStep(
                    decision=done.decision,
                    start=self.start,
                    heightmaps=done.heightmaps,
                    q_maps=done.q_maps,
                    command=done.command,
                    outcome=done.outcome,
                    result=done.result,
                    truth=self._truth_of(done),
                    next_heightmaps=following.heightmaps,
                    next_truth=self._truth_of(following),
                )

    def _truth_of(self, parts: _Parts) -> gi.TruthState | None:
        if parts.decision is not None:
            return self.truths.get(to_ns(parts.decision.frame_stamp))
        if parts.heightmaps is not None:
            return self.truths.get(to_ns(parts.heightmaps.stamp))
        return None
