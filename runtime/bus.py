"""Everything that is said goes through one bus: out on the link, and to whoever keeps or shows it."""

import time
from collections.abc import Callable
from contextlib import suppress

import zenoh
from google.protobuf.message import Message

from grasping_invisible.data.topics import OUTCOME, STOP, Topic

# (topic, payload as it travelled, wall clock in ns when it was said or received); must not block.
Sink = Callable[[Topic, bytes, int], None]

# These wait for a slow reader; everything else is dropped rather than holding up the speaker.
_MUST_ARRIVE = (OUTCOME, STOP)


class Bus:
    """Says messages on the link, if there is one, and hands each message said or heard to every sink.

    Sinks are called in the thread that says or hears it.
    """

    def __init__(self, session: zenoh.Session | None = None, sinks: tuple[Sink, ...] = ()) -> None:
        self._session = session
        self._sinks = sinks

    def connect(self, session: zenoh.Session) -> None:
        """Say everything on `session` from now on."""
        self._session = session

    def disconnect(self) -> None:
        """Go on without a link; sinks still hear what is said."""
        self._session = None

    def publish(self, topic: Topic, message: Message) -> bytes:
        """Say `message` under `topic`; its bytes. A link that has gone is no error here: health watches it."""
        payload = message.SerializeToString(deterministic=True)
        if self._session is not None:
            put(self._session, topic, payload)
        self.deliver(topic, payload)
        return payload

    def deliver(self, topic: Topic, payload: bytes) -> None:
        """Hand bytes heard elsewhere to the sinks, as they came."""
        now = time.time_ns()
        for sink in self._sinks:
            sink(topic, payload, now)


def put(session: zenoh.Session, topic: Topic, payload: bytes) -> None:
    """Publish bytes on a session. Never raises: a session that is closing says nothing."""
    congestion = zenoh.CongestionControl.BLOCK if topic in _MUST_ARRIVE else zenoh.CongestionControl.DROP
    encoding = zenoh.Encoding.APPLICATION_PROTOBUF.with_schema(topic.message.DESCRIPTOR.full_name)
    with suppress(zenoh.ZError):
        session.put(topic.key, payload, encoding=encoding, congestion_control=congestion)
