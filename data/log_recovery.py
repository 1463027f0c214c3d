"""A truncated or damaged log, written anew as a complete one."""

from dataclasses import dataclass
from pathlib import Path

from mcap.records import Channel, Schema
from mcap.writer import Writer

from grasping_invisible.data.errors import BadLog, BadRequest
from grasping_invisible.data.log_reader import LogReader

RECOVERED = "recovered"  # metadata: which log this was made from, and what was lost


@dataclass(frozen=True)
class Recovery:
    """How many messages were saved, and what was lost, a line each; nothing for a complete log."""

    messages: int
    lost: list[str]


def recover(damaged: Path, out: Path) -> Recovery:
    """Copy every message that can be read to a new log, byte for byte, with its times and sequence number.

    Messages of our topics that cannot be decoded are left out; those of other programs need not be decodable.
    Raises `BadLog` when there is none, `BadRequest` when `out` exists. `out` appears only when it is complete.
    """
    if out.exists():
        raise BadRequest(f"{out} exists already; choose another name for the recovered log")
    reader = LogReader(damaged)
    unfinished = out.with_name(out.name + ".unfinished")
    out.parent.mkdir(parents=True, exist_ok=True)
    try:
        with unfinished.open("wb") as file:
            writer = Writer(file)
            writer.start(library="grasping-invisible")
            count = _copy(reader, writer)
            for name, data in reader.metadata.items():
                writer.add_metadata(name, data)
            lost = {str(number): line for number, line in enumerate(reader.damage, 1)}
            writer.add_metadata(RECOVERED, {"from": damaged.name, **lost})
            writer.finish()
        if count == 0:
            raise BadLog(f"{damaged} holds no message that can be read")
        unfinished.rename(out)
    finally:
        unfinished.unlink(missing_ok=True)
    return Recovery(count, list(reader.damage))


def _copy(reader: LogReader, writer: Writer) -> int:
    schemas: dict[tuple[str, bytes], int] = {}
    channels: dict[tuple[str, str, int], int] = {}
    count = 0
    for schema, channel, message, _ in reader.sound_messages():
        target = _channel(writer, schemas, channels, schema, channel)
        writer.add_message(target, message.log_time, message.data, message.publish_time, message.sequence)
        count += 1
    return count


def _channel(
    writer: Writer,
    schemas: dict[tuple[str, bytes], int],
    channels: dict[tuple[str, str, int], int],
    schema: Schema | None,
    channel: Channel,
) -> int:
    """The new file's number of a channel, described there when it is first met."""
    schema_id = 0
    if schema is not None:
        described = (schema.name, schema.data)
        if described not in schemas:
            schemas[described] = writer.register_schema(schema.name, schema.encoding, schema.data)
        schema_id = schemas[described]
    key = (channel.topic, channel.message_encoding, schema_id)
    if key not in channels:
        channels[key] = writer.register_channel(*key, metadata=channel.metadata)
    return channels[key]
