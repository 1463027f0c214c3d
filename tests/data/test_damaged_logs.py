"""Every command that reads logs, on logs that are damaged in every way we could think of: no traceback, no hang, a
documented exit code, and all that is recoverable recovered.

`FUZZ_SECONDS=3600 python -m pytest -m fuzz tests/data/test_damaged_logs.py` goes on making new ones for so long.
"""

import os
import random
import resource
import shutil
import signal
import struct
import time
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType

import lz4.frame
import pytest
import zstandard

from grasping_invisible.data.cli import main
from grasping_invisible.data.dataset.cli import main as gi_dataset
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.recorder import RecordingSettings

LOGS = 200
LONGEST = 20.0  # seconds for one command; all take a fraction of one
MAGIC = b"\x89MCAP0\r\n"
HEADER = struct.Struct("<BQ")
FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, DATA_END = 2, 3, 4, 5, 6, 7, 15
HUGE = (0xFFFFFFFFFFFFFFFF, 1 << 63, 1 << 40, 0x7FFFFFFF, 1 << 20, 0)


@dataclass(frozen=True)
class Record:
    """A record at the top of a file, or in a chunk."""

    opcode: int
    content: bytes
    start: int = 0  # in the file

    @property
    def bytes(self) -> bytes:
        return HEADER.pack(self.opcode, len(self.content)) + self.content

    @property
    def end(self) -> int:
        return self.start + HEADER.size + len(self.content)


@dataclass(frozen=True)
class Damaged:
    """A damaged log, how many messages of it must be recovered, and what was done to it."""

    data: bytes
    recoverable: int
    how: str


@dataclass(frozen=True)
class Whole:
    """A log that is whole: its bytes, and its records."""

    data: bytes
    records: list[Record] = field(default_factory=list)

    def chunks(self) -> list[Record]:
        return [record for record in self.records if record.opcode == CHUNK]

    def recoverable_from(self, data: bytes) -> int:
        """Messages in the chunks that `data` still holds, as far as it holds a description of their channels too."""
        intact = [inside(chunk) for chunk in self.chunks() if chunk.bytes in data]
        described = {channel_of(record) for records in intact for record in records if record.opcode == CHANNEL}
        end = next(record for record in self.records if record.opcode == DATA_END)
        if data.endswith(self.data[end.end :]) and data.find(end.bytes) == len(data) - len(self.data) + end.start:
            described |= {channel_of(record) for record in self.records if record.opcode == CHANNEL}
        return sum(
            record.opcode == MESSAGE and channel_of(record) in described for records in intact for record in records
        )


def records_in(data: bytes, start: int, end: int) -> Iterator[Record]:
    while start < end:
        opcode, length = HEADER.unpack_from(data, start)
        yield Record(opcode, data[start + HEADER.size : start + HEADER.size + length], start)
        start += HEADER.size + length


def inside(chunk: Record) -> list[Record]:
    name = int.from_bytes(chunk.content[28:32], "little")
    content = zstandard.decompress(chunk.content[40 + name :], int.from_bytes(chunk.content[16:24], "little"))
    return list(records_in(content, 0, len(content)))


def channel_of(record: Record) -> int:
    return int.from_bytes(record.content[:2], "little")


def packed(
    records: list[Record], *, compression: bytes = b"zstd", size: int | None = None, crc: int | None = None
) -> Record:
    """A chunk of records; its `size` and `crc` are true unless given."""
    content = b"".join(record.bytes for record in records)
    return chunk_of(content, compression, size, crc)


def chunk_of(content: bytes, compression: bytes, size: int | None = None, crc: int | None = None) -> Record:
    compress: dict[bytes, Callable[[bytes], bytes]] = {
        b"zstd": zstandard.ZstdCompressor(write_content_size=size is None).compress,
        b"lz4": lz4.frame.compress,
    }
    data = compress.get(compression, bytes)(content)
    head = struct.pack(
        "<QQQI", 1, 2, len(content) if size is None else size, zlib.crc32(content) if crc is None else crc
    )
    return Record(CHUNK, head + struct.pack("<I", len(compression)) + compression + struct.pack("<Q", len(data)) + data)


# ---- kinds of damage ------------------------------------------------------------------------------------


def cut(whole: Whole, rng: random.Random) -> bytes:
    return whole.data[: rng.randrange(len(whole.data))]


def flipped(whole: Whole, rng: random.Random) -> bytes:
    data = bytearray(whole.data)
    for _ in range(rng.choice((1, 3, 30, 300))):
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    return bytes(data)


def overwritten(whole: Whole, rng: random.Random) -> bytes:
    data = bytearray(whole.data)
    start, length = rng.randrange(len(data)), rng.choice((1, 8, 512, 4096, 40_000))
    length = min(length, len(data) - start)
    data[start : start + length] = rng.choice((bytes(length), b"\xff" * length, rng.randbytes(length)))
    return bytes(data)


def cut_out(whole: Whole, rng: random.Random) -> bytes:
    start = rng.randrange(len(whole.data))
    return whole.data[:start] + whole.data[start + rng.choice((1, 9, 4096)) :]


def doubled(whole: Whole, rng: random.Random) -> bytes:
    """A stretch twice, as a copy that was tried again leaves it."""
    first, last = sorted(rng.sample(range(len(whole.data)), 2))
    return whole.data[:last] + whole.data[first:]


def noise_between(whole: Whole, rng: random.Random) -> bytes:
    at = rng.randrange(len(whole.data))
    noise = rng.choice((MAGIC, rng.randbytes(300), struct.pack("<I", 4) + b"zstd" + rng.randbytes(40)))
    return whole.data[:at] + noise + whole.data[at:]


def long_length(whole: Whole, rng: random.Random) -> bytes:
    """A record that says to be longer than anything, or to be empty."""
    data = bytearray(whole.data)
    record = rng.choice(whole.records)
    struct.pack_into("<Q", data, record.start + 1, rng.choice(HUGE))
    return bytes(data)


def long_length_inside(whole: Whole, rng: random.Random) -> bytes:
    """Somewhere in a record's content a count that is far too great; the index's checksum is left out."""
    data = bytearray(whole.data)
    record = rng.choice(whole.records)
    if len(record.content) > 8:
        struct.pack_into("<Q", data, record.start + HEADER.size + rng.randrange(len(record.content) - 8), HUGE[0])
    return without_index_checksum(bytes(data))


def no_log(whole: Whole, rng: random.Random) -> bytes:
    return rng.choice(
        (
            b"",
            MAGIC,
            MAGIC * 2,
            MAGIC[:4],
            b"# notes\n" * 40,
            rng.randbytes(5000),
            MAGIC + rng.randbytes(5000),
            bytes(9000),
        )
    )


def wrong_magic(whole: Whole, rng: random.Random) -> bytes:
    return rng.choice((b"\x89MCAP1\r\n", b"#ROSBAG V2.0\n", bytes(8), b"")) + whole.data[8:]


def wrong_magic_at_the_end(whole: Whole, rng: random.Random) -> bytes:
    return whole.data[:-8] + rng.choice((bytes(8), b"", MAGIC[::-1]))


BY_BYTES = (
    cut,
    cut,
    flipped,
    flipped,
    overwritten,
    cut_out,
    doubled,
    noise_between,
    long_length,
    long_length_inside,
    no_log,
    wrong_magic,
    wrong_magic_at_the_end,
)


def rewritten(whole: Whole, change: Callable[[Record], list[Record]]) -> bytes:
    """The log with every record inside its chunks changed, and without an index."""
    chunks = [packed([new for record in inside(chunk) for new in change(record)]) for chunk in whole.chunks()]
    return MAGIC + b"".join(chunk.bytes for chunk in [whole.records[0], *chunks])


def only(opcode: int, change: Callable[[bytes], bytes], share: float, rng: random.Random):
    """Change the content of some of the records of a kind."""

    def changed(record: Record) -> list[Record]:
        if record.opcode != opcode or rng.random() > share:
            return [record]
        return [Record(opcode, change(record.content))]

    return changed


def strange_payloads(whole: Whole, rng: random.Random) -> bytes:
    """Payloads that are noise, empty, or another's."""
    others = [record.content[22:] for chunk in whole.chunks() for record in inside(chunk) if record.opcode == MESSAGE]

    def strange(content: bytes) -> bytes:
        payload = bytearray(content[22:])
        for _ in range(rng.randrange(1, 6)):
            if payload:
                payload[rng.randrange(len(payload))] = rng.randrange(256)
        return content[:22] + rng.choice((rng.randbytes(50), b"", rng.choice(others), bytes(payload), bytes(payload)))

    return rewritten(whole, only(MESSAGE, strange, rng.choice((0.1, 0.6)), rng))


def strange_values(whole: Whole, rng: random.Random) -> bytes:
    """Fields that hold what their type allows and nobody means."""

    def strange(content: bytes) -> bytes:
        for kind in (gi.Decision, gi.Heightmaps, gi.QMaps, gi.RunStart, gi.RunSummary, gi.MotionCommand):
            message = kind.FromString(content[22:]) if kind.DESCRIPTOR.full_name == names[channel(content)] else None
            if message is None:
                continue
            for described in message.DESCRIPTOR.fields:
                if rng.random() < 0.3 and not described.is_repeated and not described.message_type:
                    setattr(message, described.name, strange_value(described.type, rng))
            for point in (getattr(message, name, None) for name in ("position", "origin")):
                if isinstance(point, gi.Point) and rng.random() < 0.3:
                    point.x, point.y = rng.choice(((float("nan"), 1e300), (float("inf"), -1e9)))
            for stamp in (getattr(message, name, None) for name in ("stamp", "frame_stamp")):
                if stamp is not None and rng.random() < 0.2:
                    stamp.seconds, stamp.nanos = rng.choice(((-(1 << 62), -5), (1 << 62, (1 << 31) - 1)))
            return content[:22] + message.SerializeToString()
        return content

    def channel(content: bytes) -> int:
        return int.from_bytes(content[:2], "little")

    names = schema_names(whole)
    return rewritten(whole, only(MESSAGE, strange, 0.7, rng))


def strange_value(kind: int, rng: random.Random) -> object:
    from google.protobuf.descriptor import FieldDescriptor as F

    if kind in (F.TYPE_DOUBLE, F.TYPE_FLOAT):
        return rng.choice((float("nan"), float("inf"), -float("inf"), 1e38, -1.0, 5e-324))
    if kind == F.TYPE_STRING:
        return rng.choice(("", "\x1b[31m\n\r\0", "[red]" * 9, "é\u202e" * 2000, "<script>alert(1)</script>", "../../x"))
    if kind == F.TYPE_BYTES:
        return rng.choice((b"", b"\x89PNG\r\n\x1a\n", rng.randbytes(90), png_bomb()))
    if kind == F.TYPE_BOOL:
        return rng.random() < 0.5
    if kind == F.TYPE_ENUM:
        return rng.choice((0, 99, 2**31 - 1, -5))
    return rng.choice((0, 1, 2**31 - 1, 255)) if kind != F.TYPE_UINT64 else rng.choice((0, 7, 2**64 - 1, 2**63))


def png_bomb() -> bytes:
    """A PNG of a few kB that says, and holds, 8,000 x 8,000 pixels of one channel."""

    def part(name: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))

    if not _BOMB:
        squeeze = zlib.compressobj(9)
        rows = b"".join(squeeze.compress(bytes(8_001)) for _ in range(8_000)) + squeeze.flush()
        head = struct.pack(">IIBBBBB", 8_000, 8_000, 8, 0, 0, 0, 0)
        _BOMB.append(b"\x89PNG\r\n\x1a\n" + part(b"IHDR", head) + part(b"IDAT", rows) + part(b"IEND", b""))
    return _BOMB[0]


_BOMB: list[bytes] = []


def schema_names(whole: Whole) -> dict[int, str]:
    """The name of each channel's type."""
    found = [record for chunk in whole.chunks() for record in inside(chunk)]
    schemas = {
        channel_of(record): record.content[6 : 6 + int.from_bytes(record.content[2:6], "little")].decode()
        for record in found
        if record.opcode == SCHEMA
    }
    return {
        channel_of(record): schemas[int.from_bytes(record.content[2:4], "little")]
        for record in found
        if record.opcode == CHANNEL
    }


def unknown_channels(whole: Whole, rng: random.Random) -> bytes:
    share = rng.choice((0.2, 1.0))
    return rewritten(whole, only(MESSAGE, lambda content: struct.pack("<H", 900) + content[2:], share, rng))


def swapped_channels(whole: Whole, rng: random.Random) -> bytes:
    """Two channels by one number: the later description holds."""
    number = struct.pack("<H", rng.randrange(1, 6))
    return rewritten(whole, only(CHANNEL, lambda content: number + content[2:], 0.4, rng))


def lost_descriptions(whole: Whole, rng: random.Random) -> bytes:
    lost = rng.choice((SCHEMA, CHANNEL))
    share = rng.choice((0.3, 1.0))
    return rewritten(whole, lambda record: [] if record.opcode == lost and rng.random() < share else [record])


def strange_descriptions(whole: Whole, rng: random.Random) -> bytes:
    """Schemas and channels whose texts are others: another encoding, another type, another topic, no text at all."""

    def strange(content: bytes) -> bytes:
        return rng.choice(
            (
                content.replace(b"protobuf", b"flatbuff"),
                content.replace(b"Decision", b"Decisiom"),
                content.replace(b"gi/", b"\xff\xfe/"),
                content.replace(b"gi/", b"hi/"),
                content[:2] + rng.randbytes(len(content) - 2),
                content[: rng.randrange(2, len(content))],
            )
        )

    return rewritten(whole, only(rng.choice((SCHEMA, CHANNEL)), strange, 0.5, rng))


def strange_times(whole: Whole, rng: random.Random) -> bytes:
    times = struct.pack("<IQQ", *rng.choice(((0, 0, 0), (0xFFFFFFFF, HUGE[0], HUGE[0]), (3, 5, HUGE[1]))))
    return rewritten(whole, only(MESSAGE, lambda content: content[:2] + times + content[22:], 0.5, rng))


def other_compressions(whole: Whole, rng: random.Random) -> bytes:
    """Chunks that are packed otherwise, some by a name that nobody knows."""
    names = (b"lz4", b"", b"zstd", b"brotli!!", b"zst\xff")
    chunks = [packed(inside(chunk), compression=rng.choice(names)) for chunk in whole.chunks()]
    return MAGIC + b"".join(chunk.bytes for chunk in [whole.records[0], *chunks])


def wrong_checksums(whole: Whole, rng: random.Random) -> bytes:
    chunks = [
        packed(inside(chunk), crc=rng.choice((None, 0, 7)), size=rng.choice((None, *HUGE))) for chunk in whole.chunks()
    ]
    return MAGIC + b"".join(chunk.bytes for chunk in [whole.records[0], *chunks])


def bombs(whole: Whole, rng: random.Random) -> bytes:
    """A small chunk that would unpack to a quarter of a gigabyte, among good ones."""
    chunks = list(whole.chunks())
    chunks.insert(rng.randrange(len(chunks)), bomb(rng.choice((b"zstd", b"lz4")), rng.choice((True, False))))
    return MAGIC + b"".join(chunk.bytes for chunk in [whole.records[0], *chunks])


def bomb(compression: bytes, honest: bool) -> Record:
    if (compression, honest) not in _BOMBS:
        size = 1 << 28
        if compression == b"zstd":
            squeeze = zstandard.ZstdCompressor().compressobj(size=size if honest else -1)
            squeezed = [squeeze.compress(bytes(1 << 20)) for _ in range(size >> 20)] + [squeeze.flush()]
        else:
            frame = lz4.frame.LZ4FrameCompressor()
            squeezed = [frame.begin(size if honest else 0)]
            squeezed += [frame.compress(bytes(1 << 20)) for _ in range(size >> 20)] + [frame.flush()]
        data = b"".join(squeezed)
        head = struct.pack("<QQQI", 1, 2, size if honest else 4096, 0)
        name = struct.pack("<I", len(compression)) + compression
        _BOMBS[compression, honest] = Record(CHUNK, head + name + struct.pack("<Q", len(data)) + data)
    return _BOMBS[compression, honest]


_BOMBS: dict[tuple[bytes, bool], Record] = {}


def lying_index(whole: Whole, rng: random.Random) -> bytes:
    """An index that says otherwise than the data, without a checksum that would tell."""
    end = next(record for record in whole.records if record.opcode == DATA_END)
    data = bytearray(whole.data)
    for _ in range(rng.choice((1, 5, 60))):
        data[rng.randrange(end.end, len(data) - 8)] = rng.randrange(256)
    return without_index_checksum(bytes(data))


def without_index_checksum(data: bytes) -> bytes:
    return data[:-12] + bytes(4) + data[-8:]


BY_RECORDS = (
    strange_payloads,
    strange_payloads,
    strange_values,
    strange_values,
    unknown_channels,
    swapped_channels,
    lost_descriptions,
    strange_descriptions,
    strange_times,
    other_compressions,
    wrong_checksums,
    bombs,
    lying_index,
)


def damaged_log(whole: Whole, seed: int) -> Damaged:
    """The same for the same seed."""
    rng = random.Random(seed)
    kinds = (*BY_BYTES, *BY_RECORDS)
    kind = kinds[seed % len(kinds)]
    data = kind(whole, rng)
    how = f"{kind.__name__}, seed {seed}"
    if seed // len(kinds) % 3 == 2 and len(data) > 100:  # damage seldom comes alone
        second = rng.choice((cut, flipped, overwritten))
        data = second(Whole(data), rng)
        how += f", then {second.__name__}"
    return Damaged(data, whole.recoverable_from(data), how)


# ---- the commands ---------------------------------------------------------------------------------------


@contextmanager
def no_longer_than(seconds: float, what: str) -> Iterator[None]:
    def late(number: int, frame: FrameType | None) -> None:
        raise TimeoutError(f"{what} takes longer than {seconds} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


class Commands:
    """Runs commands on one damaged log after the other and complains of what must not be."""

    def __init__(self, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
        self.folder = folder / "logs"
        self.log = self.folder / "damaged.mcap"
        self.out = folder / "out"  # not below the other, where `ls` would find what is written here
        self._capsys = capsys
        self.folder.mkdir()

    def run(self, *arguments: str | Path, codes: tuple[int, ...]) -> tuple[int, str]:
        """The exit code, which must be one of `codes`, and what was printed."""
        words = [str(argument) for argument in arguments]
        with no_longer_than(LONGEST, words[0]):
            code = main(words)
        said = self._capsys.readouterr()
        assert code in codes, f"{words[0]} ended with {code}: {said.err}"
        if code == 2:
            assert said.err.startswith("gi-log: ")
            assert said.err.count("\n") == 1, said.err
        return code, said.out

    def on(self, damaged: Damaged, *, drawing: bool, deciding: bool) -> None:
        """All commands on a log; `drawing` and `deciding`: those that take long because of that, too."""
        self.log.write_bytes(damaged.data)
        shutil.rmtree(self.out, ignore_errors=True)
        self.out.mkdir()
        readable = self.run("info", self.log, codes=(0, 2))[0] == 0
        can = (0,) if readable else (2,)  # all or none
        self.run("show", self.log, codes=can)
        assert self.run("ls", self.folder, codes=(0,))[1]
        self.run("check", self.log, codes=(0, 1) if readable else (2,))
        self.run("relabel", self.log, codes=(0, 1, 2))
        if drawing:
            self.run("frames", self.log, "--out", self.out, codes=can)
            self.run("report", self.log, "--out", self.out / "report.html", codes=can)
        if deciding:
            self.run("replay", self.log, codes=(0, 1, 2))
            self.run("replay", "--force", self.log, codes=(0, 1, 2))
            self.rebuild()
        self.recover(damaged)

    def rebuild(self) -> None:
        dataset = ["rebuild", str(self.log), "--out", str(self.out / "dataset"), "--workers", "1"]
        with no_longer_than(LONGEST, "gi-dataset rebuild"):
            assert gi_dataset(dataset) in (0, 2)
        self._capsys.readouterr()

    def recover(self, damaged: Damaged) -> None:
        recovered = self.out / "recovered.mcap"
        code, said = self.run("recover", self.log, "--out", recovered, codes=(0, 2))
        if code == 2:
            assert damaged.recoverable == 0
            assert list(self.out.glob("*.mcap*")) == []
            return
        assert int(said.split()[0]) >= damaged.recoverable
        self.run("check", recovered, codes=(0,))


@pytest.fixture
def whole(write_run) -> Whole:
    data = write_run(settings=RecordingSettings(flush_seconds=0.0)).read_bytes()
    return Whole(data, list(records_in(data, len(MAGIC), len(data) - len(MAGIC))))


@pytest.fixture
def commands(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Commands:
    return Commands(tmp_path, capsys)


def test_no_damage_makes_a_command_fail_otherwise(whole: Whole, commands: Commands) -> None:
    for seed in range(LOGS):
        damaged = damaged_log(whole, seed)
        try:
            commands.on(damaged, drawing=seed % 9 == 0, deciding=seed % 45 == 0)
        except BaseException as error:
            error.add_note(damaged.how)
            raise


@pytest.mark.fuzz
def test_an_hour_of_damage(whole: Whole, commands: Commands) -> None:
    seconds = float(os.environ.get("FUZZ_SECONDS", "60"))
    seed = first = int(os.environ.get("FUZZ_SEED", time.time_ns() // 1_000_000))
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        damaged = damaged_log(whole, seed)
        try:
            commands.on(damaged, drawing=True, deciding=seed % 10 == 0)
        except BaseException as error:
            error.add_note(damaged.how)
            raise
        seed += 1
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{seed - first} logs from seed {first}, peak memory {peak:.0f} MB")
