"""A truncated or damaged log, written anew as a complete one."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from mcap.records import Channel, Schema
from mcap.writer import Writer
from mcap_protobuf.schema import register_schema

from grasping_invisible.data.errors import BadLog, BadRequest
from grasping_invisible.data.log_reader import LogReader
from grasping_invisible.data.log_storage import parts_of
from grasping_invisible.data.shown_name import shown
from grasping_invisible.data.topics import BY_KEY

_TOLD_EVERY = 64  # messages
RECOVERED = "recovered"  # metadata: which log this was made from, and what was lost


@dataclass(frozen=True)
class Recovery:
    """How many messages were saved, and what was lost, a line each; nothing for a complete log. `parts`: of the log."""

    messages: int
    lost: list[str]
    parts: int


def recover(damaged: Path, out: Path, told: Callable[[int, int], None] | None = None) -> Recovery:
    """Copy every message that can be read to a new log, byte for byte, with its times and sequence number.

    A log in parts becomes one file. `told`: is told how many bytes of how many are read.
    Messages of our topics that cannot be decoded are left out; those of other programs need not be decodable.
    Raises `BadLog` when there is none, `BadRequest` when `out` exists. `out` appears only when it is complete.
    """
    if out.exists():
        raise BadRequest(f"{out} exists already; choose another name for the recovered log")
    parts = parts_of(damaged)
    unfinished = out.with_name(out.name + ".unfinished")
    out.parent.mkdir(parents=True, exist_ok=True)
    try:
        with unfinished.open("wb") as file:
            copy = _Copy(Writer(file), told, sum(part.stat().st_size for part in parts if part.exists()))
            for part in parts:
                copy.add(part, name=part.name if len(parts) > 1 else "")
            copy.finish(damaged.name)
        if copy.messages == 0:
            raise BadLog(copy.unreadable or f"{damaged} holds no message that can be read")
        unfinished.rename(out)
    finally:
        unfinished.unlink(missing_ok=True)
    return Recovery(copy.messages, copy.lost, len(parts))


class _Copy:
    """The new log while it is written."""

    def __init__(self, writer: Writer, told: Callable[[int, int], None] | None, size: int) -> None:
        self.messages = 0
        self.lost: list[str] = []
        self.unreadable = ""  # why the first part that could not be read at all could not
        self._writer = writer
        self._told = told
        self._size = size
        self._read = 0
        self._metadata: dict[str, dict[str, str]] = {}
        self._schemas: dict[tuple[str, bytes] | str, int] = {}
        self._channels: dict[tuple[str, str, int], int] = {}
        writer.start(library="grasping-invisible")

    def add(self, part: Path, name: str) -> None:
        """Copy what can be read of a part. `name`: said with what is lost of it."""
        try:
            reader = LogReader(part)
        except BadLog as error:
            self.unreadable = self.unreadable or str(error)
            self.lost.append(str(error))
            return
        for schema, channel, message, _ in reader.sound_messages():
            target = self._channel(schema, channel)
            self._writer.add_message(target, message.log_time, message.data, message.publish_time, message.sequence)
            if self._told is not None and self.messages % _TOLD_EVERY == 0:
                self._told(self._read + reader.position, self._size)
            self.messages += 1
        self._read += part.stat().st_size
        self._metadata |= reader.metadata
        self.lost += [f"{name}: {line}" if name else line for line in reader.damage]

    def finish(self, origin: str) -> None:
        """Add metadata and the index."""
        for name, data in self._metadata.items():
            self._writer.add_metadata(name, data)
        lost = {str(number): shown(line) for number, line in enumerate(self.lost, 1)}
        self._writer.add_metadata(RECOVERED, {"from": shown(origin), **lost})
        self._writer.finish()

    def _channel(self, schema: Schema | None, channel: Channel) -> int:
        """The new file's number of a channel, described there when it is first met."""
        schema_id = self._schema(schema, channel.topic)
        key = (channel.topic, channel.message_encoding, schema_id)
        if key not in self._channels:
            self._channels[key] = self._writer.register_channel(*key, metadata=channel.metadata)
        return self._channels[key]

    def _schema(self, schema: Schema | None, topic: str) -> int:
        """The new file's number of a schema; of our topics' own where it was lost, 0 where there is none."""
        if schema is None and topic not in BY_KEY:
            return 0
        key = (schema.name, schema.data) if schema is not None else topic
        if key not in self._schemas:
            if schema is not None:
                self._schemas[key] = self._writer.register_schema(schema.name, schema.encoding, schema.data)
            else:
                self._schemas[key] = register_schema(self._writer, BY_KEY[topic].message)
        return self._schemas[key]
