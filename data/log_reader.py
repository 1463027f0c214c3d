"""Messages out of a log, whether it is complete, cut off, damaged or still being written."""

from collections import Counter
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import msgspec
from google.protobuf.message import DecodeError, Message
from mcap.records import Channel, Metadata, Schema
from mcap.records import Message as RawMessage
from mcap_protobuf.decoder import DecoderFactory

from grasping_invisible.data.errors import BadLog
from grasping_invisible.data.log_storage import parts_of
from grasping_invisible.data.mcap_scan import McapScan
from grasping_invisible.data.regular_file import open_regular
from grasping_invisible.data.topics import BY_KEY

_DAMAGE_LINES = 100  # a ruined log says the same over and over


@dataclass(frozen=True)
class LoggedMessage:
    """One decoded message. Times are nanoseconds since the epoch; sequence numbers count from 0 by topic."""

    topic: str
    message: Message
    log_time_ns: int
    publish_time_ns: int
    sequence: int


def counts_by_topic(written: dict[str, str]) -> dict[str, int]:
    """Metadata that counts messages by topic, without what damage has made of them that is no number."""
    return {topic: int(count) for topic, count in written.items() if count.isdecimal()}


class TopicContent(msgspec.Struct, frozen=True):
    """The message type of a topic and how many of them a log holds."""

    type: str
    messages: int


class LogContents(msgspec.Struct, frozen=True):
    """What a log holds by topic, and when; nanoseconds since the epoch, 0 without any message."""

    topics: dict[str, TopicContent]
    begins_ns: int
    ends_ns: int


class LogReader:
    """Reads one log file in the order it was written, holding one chunk at a time.

    After a pass to its end, `complete` says whether the log was closed and is whole, `damage` what is
    wrong in lines for a person, `metadata` holds the last metadata of each name, and `undecodable` the sequence numbers
    of the messages of our topics that are there but cannot be decoded. During one, `position` is how far it is, in
    bytes.
    """

    def __init__(self, path: Path) -> None:
        """Raises `BadLog` when the file cannot be read or is not an MCAP file."""
        self.path = path
        self.complete = False
        self.damage: list[str] = []
        self.metadata: dict[str, dict[str, str]] = {}
        self.undecodable: dict[str, list[int]] = {}
        self.position = 0
        self._check()

    @property
    def named_damage(self) -> list[str]:
        """`damage`, each line after the file's name."""
        return [f"{self.path.name}: {line}" for line in self.damage]

    def contents(self) -> LogContents:
        """What the log holds: told by its index, or by reading all of it where there is none."""
        with self._open() as file:
            index = McapScan(file).index
        found: dict[str, TopicContent] = {}
        if index is not None:
            for number, channel in index.channels.items():
                _count(found, index.schemas.get(channel.schema_id), channel, index.counts.get(number, 0))
            return LogContents(found, index.begins_ns, index.ends_ns)
        begins, ends = 0, 0
        for schema, channel, raw in self.raw_messages():
            _count(found, schema, channel, 1)
            begins, ends = min(begins or raw.log_time, raw.log_time), max(ends, raw.log_time)
        return LogContents(found, begins, ends)

    def raw_messages(
        self, topics: Collection[str] | None = None
    ) -> Iterator[tuple[Schema | None, Channel, RawMessage]]:
        """Messages as bytes, with their channel and schema, for copying and counting."""
        with self._open() as file:
            scan = McapScan(file)
            schemas = dict(scan.index.schemas) if scan.index else {}
            channels = dict(scan.index.channels) if scan.index else {}
            self.complete, self.damage, self.metadata = False, [], {}
            lost: Counter[int] = Counter()
            for record in scan.records(topics):
                self.position = scan.position
                if isinstance(record, Schema):
                    schemas[record.id] = record
                elif isinstance(record, Channel):
                    channels[record.id] = record
                elif isinstance(record, Metadata):
                    self.metadata[record.name] = record.metadata
                elif isinstance(record, RawMessage):
                    channel = channels.get(record.channel_id)
                    if channel is None:
                        lost[record.channel_id] += 1
                    elif topics is None or channel.topic in topics:
                        yield schemas.get(channel.schema_id), channel, record
            self._note(scan.damage)
            self._note(
                f"{count} messages of channel {number}, whose description is lost"
                for number, count in sorted(lost.items())
            )
            self.complete = scan.complete and not self.damage

    def messages(self, topics: Collection[str] | None = None) -> Iterator[LoggedMessage]:
        """Decoded messages of the given topics, or of all.

        Those that cannot be decoded are damage; those of other programs' topics are then passed over.
        """
        for _, channel, raw, message in self.sound_messages(topics):
            if message is not None:
                yield LoggedMessage(channel.topic, message, raw.log_time, raw.publish_time, raw.sequence)

    def sound_messages(
        self, topics: Collection[str] | None = None
    ) -> Iterator[tuple[Schema | None, Channel, RawMessage, Message | None]]:
        """Like `raw_messages`, and decoded, without what is damage; None where another program's cannot be decoded."""
        decoders: dict[int, _Decoder] = {}
        failures: Counter[str] = Counter()
        self.undecodable = {}
        for schema, channel, raw in self.raw_messages(topics):
            decoder = decoders.get(channel.id)
            if decoder is None or not decoder.is_for(schema, channel):  # damage can describe a channel anew
                decoder = decoders[channel.id] = _Decoder(schema, channel)
            try:
                message = decoder.decode(raw.data)
            except _Undecodable as reason:
                failures[str(reason)] += 1
                self.undecodable.setdefault(channel.topic, []).append(raw.sequence)
                continue
            yield schema, channel, raw, message
        self._note(f"{count} messages: {reason}" for reason, count in failures.items())
        self.complete = self.complete and not failures

    def _note(self, lines: Collection[str] | Iterator[str]) -> None:
        for line in lines:
            if len(self.damage) < _DAMAGE_LINES:
                self.damage.append(line)

    def _check(self) -> None:
        with self._open() as file:
            if not McapScan(file).is_log():
                what = "is empty" if self.path.stat().st_size == 0 else "is not an MCAP log"
                raise BadLog(f"{self.path} {what}")

    def _open(self) -> BinaryIO:
        try:
            return open_regular(self.path)
        except OSError as error:
            raise BadLog(f"cannot read log {self.path}: {error.strerror}") from None


class _NoLog(LogReader):
    """Stands for a file that cannot be read as a log: nothing but damage."""

    def __init__(self, path: Path, why: str) -> None:
        super().__init__(path)
        self.damage = [why]

    def _check(self) -> None:
        """It is known to be none."""

    def contents(self) -> LogContents:
        return LogContents({}, 0, 0)

    def raw_messages(
        self, topics: Collection[str] | None = None
    ) -> Iterator[tuple[Schema | None, Channel, RawMessage]]:
        return iter(())


def readers_of(first: Path) -> Iterator[LogReader]:
    """A reader of each part of the log that begins at `first`, in order. Raises `BadLog` where that is no log.

    A later part that is no log, as a power cut may leave one, is damage: what comes before it can be read all the same.
    """
    yield LogReader(first)
    for part in parts_of(first)[1:]:
        try:
            yield LogReader(part)
        except BadLog as error:
            yield _NoLog(part, str(error).removeprefix(f"{part} "))


def read_messages(first: Path, topics: Collection[str] | None = None) -> Iterator[LoggedMessage]:
    """What can be read of the log that begins at `first`, over all its parts, in order. Raises `BadLog`."""
    for reader in readers_of(first):
        yield from reader.messages(topics)


def _count(found: dict[str, TopicContent], schema: Schema | None, channel: Channel, messages: int) -> None:
    before = found.get(channel.topic, TopicContent(schema.name if schema else "", 0))
    found[channel.topic] = TopicContent(before.type, before.messages + messages)


class _Undecodable(Exception):
    """Why a message of one of our topics cannot be decoded."""


class _Decoder:
    """Decodes the messages of one channel."""

    def __init__(self, schema: Schema | None, channel: Channel) -> None:
        self._schema = schema
        self._channel = channel
        self._ours = channel.topic in BY_KEY
        self._failure = _mismatch(schema, channel) if self._ours else ""
        self._decode = BY_KEY[channel.topic].message.FromString if self._ours else _foreign(schema, channel)

    def is_for(self, schema: Schema | None, channel: Channel) -> bool:
        """Whether this decodes messages of that very description."""
        return schema is self._schema and channel is self._channel

    def decode(self, data: bytes) -> Message | None:
        """The message; None for another program's that cannot be decoded. Raises `_Undecodable`."""
        if self._failure:
            raise _Undecodable(self._failure)
        try:
            return self._decode(data) if self._decode is not None else None
        except DecodeError:
            if not self._ours:
                return None
            raise _Undecodable(f"{self._channel.topic} cannot be decoded") from None


def _mismatch(schema: Schema | None, channel: Channel) -> str:
    """Why the messages of a channel are not what its topic promises; empty where they are.

    A schema that the channel names and that is lost says nothing against it: the topic's own is known.
    """
    has_schema = channel.schema_id != 0 if schema is None else schema.encoding == "protobuf"
    if not has_schema or channel.message_encoding != "protobuf":
        return f"{channel.topic} is not protobuf with a schema"
    expected = BY_KEY[channel.topic].message.DESCRIPTOR.full_name
    if schema is not None and schema.name != expected:
        return f"{channel.topic} holds {schema.name}, expected {expected}"
    return ""


def _foreign(schema: Schema | None, channel: Channel) -> Callable[[bytes], Message] | None:
    """A decoder by the schema that the log holds, which can be anything."""
    try:
        return DecoderFactory().decoder_for(channel.message_encoding, schema)
    except Exception:
        return None
