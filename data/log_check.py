"""Whether a log is complete and makes sense."""

from collections import Counter
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from google.protobuf.message import Message

from grasping_invisible.data import topics
from grasping_invisible.data.clock import to_ns
from grasping_invisible.data.health_events import HealthWatch
from grasping_invisible.data.log_file import is_being_written
from grasping_invisible.data.log_reader import LoggedMessage, counts_by_topic, readers_of
from grasping_invisible.data.log_recovery import RECOVERED
from grasping_invisible.data.log_storage import parts_of
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.recorder import DROPPED, PART

_TOLD_EVERY = 64  # messages


@dataclass(frozen=True)
class Checkup:
    """What a check found, a line each.

    `problems`: damage, what is missing, and what contradicts itself. `losses`: of a recovered log, what its recovery
    could not save and what is therefore missing; its own bytes are sound, and it says itself that it is not whole.
    `events`: what the log is right to hold and a person may want to know: health, camera frames that came in part.
    """

    problems: list[str]
    losses: list[str] = field(default_factory=list)
    events: list[str] = field(default_factory=list)


def check_log(path: Path, told: Callable[[int, int], None] | None = None) -> Checkup:
    """Look for everything that can be wrong with the log that begins at `path`; reads all of it.

    `told`: is told how many bytes of how many are read. Raises `BadLog`.
    """
    story = _Story()
    health = HealthWatch()
    read = 0
    problems: list[str] = []
    parts = parts_of(path)
    size = sum(part.stat().st_size for part in parts if part.exists())
    metadata: dict[str, dict[str, str]] = {}
    for reader in readers_of(path):
        for number, logged in enumerate(reader.messages()):
            story.take(logged)
            health.take(logged)
            if told is not None and number % _TOLD_EVERY == 0:
                told(read + reader.position, size)
        for topic, sequences in reader.undecodable.items():
            story.count(topic, sequences)  # said to be damage; they are not missing as well
        read += reader.path.stat().st_size
        metadata |= reader.metadata
        problems += reader.named_damage
    if is_being_written(parts[-1]):
        problems.append(f"{parts[-1].name}: still being written")
    found = list(story.contradictions())
    if PART in metadata:  # only our recorder promises sequence numbers without gaps
        written = metadata.get(DROPPED, {})
        dropped = counts_by_topic(written)
        unknown = [f"how many messages of {topic} were dropped is damaged" for topic in written.keys() - dropped.keys()]
        found = [*sorted(unknown), *story.missing(dropped), *found]
    events = [*health.events(), *story.incomplete_frames()]
    recovered = metadata.get(RECOVERED)
    if recovered is None:
        return Checkup(problems + found, [], events)
    lost = [f"{name}: {line}" for name, line in recovered.items()]
    return Checkup(problems, lost + found, events)


@dataclass
class _Story:
    """What the messages of a run say, in the order they were kept."""

    counts: Counter[str] = field(default_factory=Counter)
    last_sequence: dict[str, int] = field(default_factory=dict)
    frames: dict[str, set[int]] = field(default_factory=dict)
    starts: int = 0
    summaries: int = 0
    decisions: list[gi.Decision] = field(default_factory=list)
    accepted: dict[int, bool] = field(default_factory=dict)  # command id: false once refused
    outcomes: set[int] = field(default_factory=set)
    results: set[int] = field(default_factory=set)

    def take(self, logged: LoggedMessage) -> None:
        self.count(logged.topic, [logged.sequence])
        self._take_message(logged.topic, logged.message)

    def count(self, topic: str, sequences: Collection[int]) -> None:
        """Messages that are there, whatever they say."""
        self.counts[topic] += len(sequences)
        self.last_sequence[topic] = max(self.last_sequence.get(topic, -1), *sequences)

    def missing(self, dropped: dict[str, int]) -> Iterator[str]:
        for topic in sorted({*self.counts, *dropped}):
            known = dropped.get(topic, 0)
            gaps = self.last_sequence.get(topic, -1) + 1 - self.counts[topic]
            if known:
                yield f"{topic}: {known} messages were dropped while recording"
            if gaps > known:
                yield f"{topic}: {gaps - known} messages are missing"

    def incomplete_frames(self) -> Iterator[str]:
        """Of images whose other half never came: the link drops what it cannot carry, each topic by itself."""
        color, depth = (self.frames.get(topic.key, set()) for topic in (topics.COLOR_IMAGE, topics.DEPTH_IMAGE))
        if color and depth and (halves := len(color ^ depth)):
            yield f"{halves} of {len(color | depth)} camera frames came without their colour or their depth"

    def contradictions(self) -> Iterator[str]:
        if self.starts != 1:
            yield f"{self.starts} messages say how the run started, expected 1"
        if self.summaries != 1:
            yield f"{self.summaries} messages say how the run ended, expected 1"
        steps = [decision.step for decision in self.decisions]
        if steps != list(range(len(steps))):
            yield f"decisions are not numbered 0, 1, 2, ...: {steps[:20]}"
        for decision in self.decisions:
            yield from self._unseen(decision)
        yield from self._unfinished()

    def _take_message(self, topic: str, message: Message) -> None:
        if topic in (topics.COLOR_IMAGE.key, topics.DEPTH_IMAGE.key):
            stamp = to_ns(message.timestamp)  # pyright: ignore[reportAttributeAccessIssue]
            self.frames.setdefault(topic, set()).add(stamp)
        elif isinstance(message, gi.RunStart):
            self.starts += 1
        elif isinstance(message, gi.RunSummary):
            self.summaries += 1
        elif isinstance(message, gi.Decision):
            self.decisions.append(message)
        elif isinstance(message, gi.MotionCommand):
            self.accepted.setdefault(message.id, True)
        elif isinstance(message, gi.CommandReply):
            self.accepted[message.command_id] = message.accepted
        elif isinstance(message, gi.MotionOutcome):
            self.outcomes.add(message.command_id)
        elif isinstance(message, gi.StepResult):
            self.results.add(message.step)

    def _unseen(self, decision: gi.Decision) -> Iterator[str]:
        stamp = to_ns(decision.frame_stamp)
        for topic in (topics.COLOR_IMAGE.key, topics.DEPTH_IMAGE.key):
            if stamp not in self.frames.get(topic, set()):
                yield f"decision {decision.step}: the image of {topic} it was made from is missing"

    def _unfinished(self) -> Iterator[str]:
        # A run that was stopped may leave its last motion open, and only that.
        for command in sorted(number for number, accepted in self.accepted.items() if accepted)[:-1]:
            if command not in self.outcomes:
                yield f"command {command} has no outcome"
        for decision in self.decisions[:-1]:
            if decision.step not in self.results:
                yield f"decision {decision.step} has no result"
