"""Reads the records of an MCAP file in order, whole or not, with the memory of one chunk.

The library's own readers stop at the first damage. This one trusts nothing that does not fit: every
record must have the form of its kind and every chunk its checksum; where they do not, it looks for the
next chunk that is sound, notes what was lost and goes on.
"""

import os
import struct
import zlib
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from io import BytesIO
from typing import Any, BinaryIO

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, Footer, McapRecord, Message, Metadata, Schema, Statistics
from mcap.stream_reader import StreamReader
from mcap.writer import MCAP0_MAGIC

_HEADER = struct.Struct("<BQ")  # opcode and length of every record
_MESSAGE_HEAD = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time
_CHUNK_HEAD = struct.Struct("<QQQII")  # times, size and checksum of what is inside, length of what follows
_FOOTER_BYTES = _HEADER.size + 20 + len(MCAP0_MAGIC)
# Bytes of a record or an unpacked chunk: none we keep is near this, and a damaged length or a chunk made to fill the
# memory is often beyond.
_LARGEST = 64 << 20
_WINDOW = 1 << 20
_DATA_END = _HEADER.pack(Opcode.DATA_END, 4)  # and a checksum: what the summary follows
_COMPRESSIONS = (b"zstd", b"lz4")
_KEPT: dict[int, Callable[[ReadDataStream], McapRecord]] = {
    Opcode.SCHEMA: Schema.read,
    Opcode.CHANNEL: Channel.read,
    Opcode.METADATA: Metadata.read,
}
_SKIPPED = (Opcode.HEADER, Opcode.ATTACHMENT)
_PARSE_ERRORS = (McapError, zstandard.ZstdError, struct.error, ValueError, RuntimeError, OverflowError)


class _Damaged(Exception):
    """What stands here is not a sound record."""


@dataclass
class Index:
    """The summary at the end of a complete file."""

    schemas: dict[int, Schema]
    channels: dict[int, Channel]
    chunks: dict[int, ChunkIndex]  # by the offset of the chunk
    counts: dict[int, int]  # messages of each channel
    begins_ns: int = 0
    ends_ns: int = 0
    starts_at: int | None = None  # in the file; None: not where the file says


class McapScan:
    """One pass over an MCAP file. `damage` fills while iterating; `complete` is known after the pass."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._size = os.fstat(file.fileno()).st_size
        self._has_magic = self._read(0, len(MCAP0_MAGIC)) == MCAP0_MAGIC
        self.index = self._read_index()
        self.damage: list[str] = []
        self.complete = False
        self.position = 0  # of the record that is read, or of the chunk that it is in

    def is_log(self) -> bool:
        """Whether the file begins like an MCAP file or holds a sound chunk anywhere."""
        return self._has_magic or self._find_chunk(0) is not None

    def records(self, topics: Collection[str] | None = None) -> Iterator[McapRecord]:
        """Schemas, channels, metadata and messages in the order written.

        Chunks that the index says hold none of `topics` are passed over.
        """
        self.damage.clear()
        self.complete = False
        position = len(MCAP0_MAGIC)
        sound_until = position  # nothing before this is looked at again
        in_chunks = False
        if not self._has_magic:
            self.damage.append("the first bytes are not those of an MCAP file")
        while position < self._size:
            self.position = position
            try:
                opcode, start, end = self._frame(position)
                if opcode == Opcode.DATA_END:
                    self._check_end(start, end)
                    self.complete = not self.damage
                    return
                if opcode == Opcode.CHUNK:
                    in_chunks = True
                    if not self._is_unwanted(position, topics):
                        chunk, end = self._chunk(start)
                        yield from chunk
                    sound_until = end
                elif opcode == Opcode.MESSAGE:
                    if in_chunks:
                        raise _Damaged  # a file with chunks has its messages in them
                    yield _message(self._read(start, end))
                    sound_until = end
                elif opcode in _KEPT:
                    yield _parse(_KEPT[opcode], self._read(start, end))
                position = end
            except _Damaged:
                found = self._find_chunk(sound_until)
                if found is None:
                    self.damage.append(f"nothing readable from byte {position} to the end at {self._size}")
                    return
                chunk_at, (chunk, end) = found
                if chunk_at > position:
                    self.damage.append(f"{chunk_at - position} damaged bytes at byte {position}")
                else:
                    self.damage.append(f"damaged record at byte {position}")
                in_chunks = True
                yield from chunk
                position = sound_until = end
        self.damage.append(f"the file ends at byte {self._size} without an index: it was not closed")

    def _read(self, start: int, end: int) -> bytes:
        self._file.seek(start)
        return self._file.read(end - start)

    def _frame(self, position: int) -> tuple[int, int, int]:
        """Opcode, start and end of the content of the record at `position`."""
        header = self._read(position, position + _HEADER.size)
        if len(header) < _HEADER.size:
            raise _Damaged
        opcode, length = _HEADER.unpack(header)
        start = position + _HEADER.size
        if length > _LARGEST or start + length > self._size:
            raise _Damaged
        if opcode == Opcode.MESSAGE_INDEX:
            inner = self._read(start + 2, start + 6)
            if len(inner) < 4 or int.from_bytes(inner, "little") != length - 6:
                raise _Damaged
        elif opcode not in (*_KEPT, *_SKIPPED, Opcode.CHUNK, Opcode.MESSAGE, Opcode.DATA_END):
            raise _Damaged
        return opcode, start, start + length

    def _chunk(self, start: int) -> tuple[list[McapRecord], int]:
        """The records of the chunk whose content starts at `start`, and where it ends."""
        head = self._read(start, start + _CHUNK_HEAD.size)
        if len(head) < _CHUNK_HEAD.size:
            raise _Damaged
        _, _, size, checksum, name_length = _CHUNK_HEAD.unpack(head)
        if name_length > 8 or size > _LARGEST:
            raise _Damaged
        name_at = start + _CHUNK_HEAD.size
        data_at = name_at + name_length + 8
        data_length = int.from_bytes(self._read(data_at - 8, data_at), "little")
        end = data_at + data_length
        if data_length > _LARGEST or end > self._size:
            raise _Damaged
        content = _unpacked(self._read(name_at, name_at + name_length), self._read(data_at, end), size)
        if checksum and zlib.crc32(content) != checksum:
            raise _Damaged
        return list(_records_in(content)), end

    def _find_chunk(self, position: int) -> tuple[int, tuple[list[McapRecord], int]] | None:
        """The first sound compressed chunk whose record starts at or after `position`, and its offset."""
        for name_at in self._compression_names(position + _HEADER.size + _CHUNK_HEAD.size):
            start = name_at - _CHUNK_HEAD.size
            try:
                opcode, length = _HEADER.unpack(self._read(start - _HEADER.size, start))
                # One of the two may be the damage itself; a chance hit has neither.
                if opcode != Opcode.CHUNK and not _CHUNK_HEAD.size < length <= self._size - start:
                    continue
                return start - _HEADER.size, self._chunk(start)
            except _Damaged:
                continue
        return None

    def _compression_names(self, position: int) -> Iterator[int]:
        """Offsets where the name of a compression stands behind its length."""
        marks = [struct.pack("<I", len(name)) + name for name in _COMPRESSIONS]
        overlap = max(map(len, marks)) - 1
        window_at = position - 4  # the length belongs to the fixed part of a chunk's head
        while window_at < self._size:
            window = self._read(window_at, window_at + _WINDOW + overlap)
            hits = {hit for mark in marks for hit in _find_all(window, mark) if hit < _WINDOW}
            yield from (window_at + hit + 4 for hit in sorted(hits))
            window_at += _WINDOW

    def _is_unwanted(self, position: int, topics: Collection[str] | None) -> bool:
        if topics is None or self.index is None or (entry := self.index.chunks.get(position)) is None:
            return False
        channels = self.index.channels
        return bool(entry.message_index_offsets) and all(
            number in channels and channels[number].topic not in topics for number in entry.message_index_offsets
        )

    def _check_end(self, start: int, end: int) -> None:
        if end - start != 4:
            raise _Damaged
        if self.index is None or self.index.starts_at != end:
            if self._find_chunk(start) is not None:
                raise _Damaged  # there is more: this was not the end
            self.damage.append("the index at the end is damaged or missing")

    def _read_index(self) -> Index | None:
        """The summary, if it is there and its checksum holds."""
        footer_at = self._size - _FOOTER_BYTES
        tail = self._read(max(0, footer_at), self._size)
        if footer_at < len(MCAP0_MAGIC) or not tail.endswith(MCAP0_MAGIC) or tail[0] != Opcode.FOOTER:
            return None
        start, _, checksum = struct.unpack_from("<QQI", tail, _HEADER.size)
        if 0 < start <= footer_at and footer_at - start <= _LARGEST:
            index = _index_in(self._read(start, self._size), checksum)
            if index is not None:
                index.starts_at = start
                return index
        return self._find_index(checksum) if checksum else None

    def _find_index(self, checksum: int) -> Index | None:
        """A sound summary that lies elsewhere than the footer says, as bytes before it were lost or added.

        It still describes schemas and channels, but no place in the file.
        """
        tail = self._read(max(0, self._size - _WINDOW), self._size)
        for hit in _find_all(tail, _DATA_END):
            index = _index_in(tail[hit + len(_DATA_END) + 4 :], checksum)
            if index is not None:
                index.chunks.clear()
                return index
        return None


def _index_in(content: bytes, checksum: int) -> Index | None:
    """The summary in the end of a file, if it has the checksum; 0: it has none."""
    if checksum and zlib.crc32(content[: -len(MCAP0_MAGIC) - 4]) != checksum:
        return None
    index = Index({}, {}, {}, {})
    try:
        for record in StreamReader(BytesIO(content), skip_magic=True).records:
            if isinstance(record, Schema):
                index.schemas[record.id] = record
            elif isinstance(record, Channel):
                index.channels[record.id] = record
            elif isinstance(record, ChunkIndex):
                index.chunks[record.chunk_start_offset] = record
            elif isinstance(record, Statistics):
                index.counts.update(record.channel_message_counts)
                index.begins_ns, index.ends_ns = record.message_start_time, record.message_end_time
            elif isinstance(record, Footer):
                return index
    except _PARSE_ERRORS:
        return None
    return None


def _unpacked(compression: bytes, data: bytes, size: int) -> bytes:
    """What a chunk holds, without ever unpacking more than a chunk may hold. `size`: what the chunk says."""
    try:
        if compression == b"zstd" and zstandard.frame_content_size(data) <= _LARGEST:
            return zstandard.ZstdDecompressor().decompress(data, max_output_size=size)
        if compression == b"lz4":
            unpacking = lz4.frame.LZ4FrameDecompressor()
            content = unpacking.decompress(data, max_length=size + 1)
            if unpacking.eof:
                return content
    except _PARSE_ERRORS as error:
        raise _Damaged from error
    if compression == b"":
        return data
    raise _Damaged


def _records_in(content: bytes) -> Iterator[McapRecord]:
    """Schemas, channels and messages of an unpacked chunk."""
    position = 0
    while position < len(content):
        start = position + _HEADER.size
        if start > len(content):
            raise _Damaged
        opcode, length = _HEADER.unpack_from(content, position)
        position = start + length
        if position > len(content):
            raise _Damaged
        if opcode == Opcode.MESSAGE:
            yield _message(content[start:position])
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            yield _parse(_KEPT[opcode], content[start:position])


def _parse(parse: Callable[[ReadDataStream], Any], content: bytes) -> Any:
    stream = ReadDataStream(BytesIO(content))
    try:
        record = parse(stream)
    except _PARSE_ERRORS as error:
        raise _Damaged from error
    if stream.count != len(content):
        raise _Damaged
    return record


def _message(content: bytes) -> Message:
    if len(content) < _MESSAGE_HEAD.size:
        raise _Damaged
    channel, sequence, log_time, publish_time = _MESSAGE_HEAD.unpack_from(content)
    return Message(channel, log_time, content[_MESSAGE_HEAD.size :], publish_time, sequence)


def _find_all(data: bytes, mark: bytes) -> Iterator[int]:
    hit = data.find(mark)
    while hit >= 0:
        yield hit
        hit = data.find(mark, hit + 1)
