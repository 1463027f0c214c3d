import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType, Writer
from mcap_protobuf.schema import register_schema

from grasping_invisible.data import topics
from grasping_invisible.data.errors import BadLog
from grasping_invisible.data.log_reader import LogReader, read_messages
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.recorder import RecordingSettings

PER_MESSAGE = RecordingSettings(flush_seconds=0.0)


def test_only_the_topics_asked_for(write_run) -> None:
    messages = list(read_messages(write_run(), [topics.DECISION.key, topics.OUTCOME.key]))
    assert [m.topic for m in messages] == [topics.DECISION.key, topics.OUTCOME.key] * 3


def test_unwanted_chunks_are_not_read(write_run) -> None:
    path = write_run(settings=PER_MESSAGE)
    whole = LogReader(path)
    assert len(list(whole.messages())) == 35
    data = bytearray(path.read_bytes())
    image_at = data.find(b"\x89PNG")
    assert image_at > 0
    data[image_at + 100] ^= 255
    path.write_bytes(data)
    assert len(list(read_messages(path, [topics.RUN_SUMMARY.key]))) == 1
    damaged = LogReader(path)
    assert len(list(damaged.messages())) < 35
    assert not damaged.complete


@pytest.mark.parametrize(
    ("content", "what"), [(b"", "is empty"), (b"\x89MCAP", "is not"), (b"# notes\n" * 99, "is not")]
)
def test_what_is_no_log_is_said_so(tmp_path: Path, content: bytes, what: str) -> None:
    path = tmp_path / "x.mcap"
    path.write_bytes(content)
    with pytest.raises(BadLog, match=what):
        LogReader(path)


def test_a_missing_file_and_a_folder_are_bad_logs(tmp_path: Path) -> None:
    with pytest.raises(BadLog, match="No such file"):
        LogReader(tmp_path / "no.mcap")
    with pytest.raises(BadLog, match="directory"):
        LogReader(tmp_path)


def test_a_log_cut_anywhere_gives_what_comes_before_the_cut(write_run, tmp_path: Path) -> None:
    data = write_run(settings=PER_MESSAGE).read_bytes()
    cut = tmp_path / "cut.mcap"
    before = 0
    for length in range(8, len(data), 997):
        cut.write_bytes(data[:length])
        reader = LogReader(cut)
        count = len(list(reader.messages()))
        assert count >= before
        assert not reader.complete
        assert reader.damage
        before = count
    assert before == 35


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(flips=st.lists(st.tuples(st.floats(0, 1, exclude_max=True), st.integers(1, 255)), min_size=1, max_size=4))
def test_a_damaged_byte_costs_at_most_its_chunk(flipped, flips: list[tuple[float, int]]) -> None:
    data, cut = flipped
    damaged = bytearray(data)
    for place, mask in flips:
        damaged[int(place * len(data))] ^= mask
    cut.write_bytes(damaged)
    reader = LogReader(cut)
    messages = list(reader.messages())
    # One chunk holds a message or, while the writer catches up, a few.
    assert len(messages) >= 35 - 12 * len(flips)
    assert len(messages) <= 35
    assert len(messages) == 35 or not reader.complete


@pytest.fixture
def flipped(write_run, tmp_path: Path) -> tuple[bytes, Path]:
    return write_run(settings=PER_MESSAGE).read_bytes(), tmp_path / "flipped.mcap"


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(noise=st.binary(max_size=400))
def test_noise_after_the_magic_is_survived(tmp_path: Path, noise: bytes) -> None:
    path = tmp_path / "noise.mcap"
    path.write_bytes(b"\x89MCAP0\r\n" + noise)
    reader = LogReader(path)
    assert list(reader.messages()) == []
    assert not reader.complete


def test_a_log_without_its_beginning_is_still_read(write_run, tmp_path: Path) -> None:
    path = write_run(settings=PER_MESSAGE)
    path.write_bytes(bytes(64) + path.read_bytes()[64:])
    assert len(list(read_messages(path))) >= 34


def test_descriptions_lost_with_the_first_chunk_are_found_in_the_index(write_run) -> None:
    path = write_run(settings=PER_MESSAGE)
    data = bytearray(path.read_bytes())
    data[data.find(b"zstd") + 40] ^= 255
    path.write_bytes(data)
    reader = LogReader(path)
    assert len(list(reader.messages())) >= 20
    assert not reader.complete


def foreign_log(path: Path, topic: str, message: type, payload: bytes, chunked: bool = True) -> Path:
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.NONE, use_chunking=chunked)
        writer.start()
        channel = writer.register_channel(topic, "protobuf", register_schema(writer, message))
        writer.add_message(channel, 5, payload, 5)
        writer.finish()
    return path


def test_a_topic_of_another_type_is_damage(tmp_path: Path) -> None:
    reader = LogReader(foreign_log(tmp_path / "x.mcap", topics.DECISION.key, gi.QMaps, b""))
    assert list(reader.messages()) == []
    assert not reader.complete
    assert "expected grasping_invisible.v1.Decision" in reader.damage[0]


def test_a_payload_of_another_type_is_damage(tmp_path: Path) -> None:
    reader = LogReader(foreign_log(tmp_path / "x.mcap", topics.DECISION.key, gi.Decision, b"\xff\xff"))
    assert list(reader.messages()) == []
    assert reader.damage == ["1 messages: gi/runtime/decision cannot be decoded"]


@pytest.mark.parametrize("chunked", [True, False])
def test_a_topic_we_do_not_know_is_decoded_by_its_schema(tmp_path: Path, chunked: bool) -> None:
    payload = gi.Place(x=1.5).SerializeToString()
    reader = LogReader(foreign_log(tmp_path / "x.mcap", "other/topic", gi.Place, payload, chunked))
    [message] = reader.messages()
    assert message.message.x == 1.5  # pyright: ignore[reportAttributeAccessIssue]
    assert reader.complete, reader.damage


def test_a_foreign_topic_that_cannot_be_decoded_is_no_damage(tmp_path: Path) -> None:
    reader = LogReader(foreign_log(tmp_path / "x.mcap", "other/topic", gi.Place, b"\xff\xff"))
    assert list(reader.messages()) == []
    assert reader.complete, reader.damage
    [(_, channel, raw, message)] = reader.sound_messages()
    assert (channel.topic, raw.data, message) == ("other/topic", b"\xff\xff", None)


def test_descriptions_are_found_in_an_index_that_has_moved(write_run) -> None:
    path = write_run(settings=PER_MESSAGE)
    data = path.read_bytes()
    first = data.find(b"zstd")
    path.write_bytes(data[: first + 40] + data[first + 49 :])  # what describes the channels, and the place of all else
    reader = LogReader(path)
    assert len(list(reader.messages())) >= 20
    assert "the index at the end is damaged or missing" in reader.damage


BOMBED = """
import resource, sys
import subprocess
import sys
from pathlib import Path
from grasping_invisible.data.log_reader import LogReader
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
reader = LogReader(Path(sys.argv[1]))
print(len(list(reader.messages())), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
"""


@pytest.mark.parametrize("compression", [CompressionType.LZ4, CompressionType.ZSTD])
def test_a_chunk_made_to_fill_the_memory_is_passed_over(write_run, compression: CompressionType) -> None:
    path = write_run(settings=PER_MESSAGE)
    data, bomb = path.read_bytes(), path.with_name("bomb.mcap")
    with bomb.open("wb") as file:
        writer = Writer(file, compression=compression, chunk_size=1 << 29)
        writer.start()
        writer.add_message(writer.register_channel("x", "", 0), 0, bytes(1 << 28), 0)
        writer.finish()
    start = data.find(b"zstd") - 41
    path.write_bytes(data[:start] + bomb.read_bytes()[8:] + data[start:])
    said = subprocess.run(
        [sys.executable, "-c", BOMBED, str(path)], capture_output=True, text=True, timeout=60, check=True
    ).stdout
    messages, kilobytes = map(int, said.split())
    assert messages == 35
    assert kilobytes < 150_000
