"""Everything that is said goes through one bus: out on the link, and to whoever keeps or shows it."""

import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress

import zenoh
from google.protobuf.message import Message

from grasping_invisible.data.topics import OUTCOME, STOP, Topic

# (topic, payload as it travelled, wall clock in ns when it was said or received); must not block.
Sink = Callable[[Topic, bytes, int], None]

# These wait for a slow reader; everything else is dropped rather than holding up the speaker.
_MUST_ARRIVE = (OUTCOME, STOP)
_LARGEST_GAP = 1_000_000  # messages at once; a number farther ahead is no count
_NUMBER_BYTES = 8  # of a message's number, its attachment: how many of its topic were said before it


class Bus:
    """Says messages on the link, if there is one, and hands each message said or heard to every sink.

    Sinks are called in the thread that says or hears it.
    """

    def __init__(self, session: zenoh.Session | None = None, sinks: tuple[Sink, ...] = ()) -> None:
        self._session = session
        self._sinks = sinks
        self._said: Counter[str] = Counter()

    def connect(self, session: zenoh.Session) -> None:
        """Say everything on `session` from now on."""
        self._session = session

    def disconnect(self) -> None:
        """Go on without a link; sinks still hear what is said."""
        self._session = None

    def publish(self, topic: Topic, message: Message) -> bytes:
        """Say `message` under `topic`; its bytes. A link that has gone is no error here: health watches it."""
        payload = message.SerializeToString(deterministic=True)
        session = self._session  # another thread may disconnect meanwhile
        if session is not None:
            number = self._said[topic.key]
            self._said[topic.key] += 1
            put(session, topic, payload, number)
        self.deliver(topic, payload)
        return payload

    def deliver(self, topic: Topic, payload: bytes) -> None:
        """Hand bytes heard elsewhere to the sinks, as they came."""
        now = time.time_ns()
        for sink in self._sinks:
            sink(topic, payload, now)


def put(session: zenoh.Session, topic: Topic, payload: bytes, number: int) -> None:
    """Publish bytes on a session, the topic's message of that number. Never raises: a closing session says nothing."""
    congestion = zenoh.CongestionControl.BLOCK if topic in _MUST_ARRIVE else zenoh.CongestionControl.DROP
    encoding = zenoh.Encoding.APPLICATION_PROTOBUF.with_schema(topic.message.DESCRIPTOR.full_name)
    with suppress(zenoh.ZError):
        attachment = number.to_bytes(_NUMBER_BYTES, "little")
        session.put(topic.key, payload, encoding=encoding, congestion_control=congestion, attachment=attachment)


class Gaps:
    """Counts what was said and never heard, by the numbers that messages carry. Not safe across threads."""

    def __init__(self) -> None:
        self.lost: Counter[str] = Counter()
        self._next: dict[str, int] = {}

    def hear(self, topic: Topic, attachment: bytes | None) -> None:
        """Take in a message of a topic, with its attachment; one without a number counts for nothing."""
        if attachment is None or len(attachment) != _NUMBER_BYTES:
            return
        number = int.from_bytes(attachment, "little")
        # What was said before the first that is heard was not for us; a lower number is a speaker who began anew.
        gap = number - self._next.get(topic.key, number)
        if 0 <= gap <= _LARGEST_GAP:
            self.lost[topic.key] += gap
        self._next[topic.key] = number + 1
