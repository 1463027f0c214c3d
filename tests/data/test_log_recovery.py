from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap.records import Channel, Message
from mcap.stream_reader import StreamReader
from mcap.writer import Writer

from grasping_invisible.data.errors import BadLog, BadRequest
from grasping_invisible.data.log_check import check_log
from grasping_invisible.data.log_reader import LogReader, read_messages
from grasping_invisible.data.log_recovery import recover
from grasping_invisible.data.log_storage import parts_of
from grasping_invisible.data.recorder import RecordingSettings
from grasping_invisible.data.topics import DECISION


@pytest.fixture
def cut_log(write_run) -> Path:
    path = write_run(settings=RecordingSettings(flush_seconds=0.0))
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 3])
    return path


def test_what_can_be_read_becomes_a_complete_log(cut_log: Path, tmp_path: Path) -> None:
    out = tmp_path / "new" / "good.mcap"
    recovery = recover(cut_log, out)
    before, after = LogReader(cut_log), LogReader(out)
    assert list(before.messages()) == list(after.messages())
    assert not before.complete
    assert after.complete
    assert recovery.lost == before.damage
    assert after.metadata["recovered"] == {"from": "run.mcap", "1": before.damage[0]}
    assert after.metadata["run"] == {"project": "test"}


def test_a_complete_log_loses_nothing(write_run, tmp_path: Path) -> None:
    path = write_run()
    recovery = recover(path, tmp_path / "copy.mcap")
    assert recovery.lost == []
    assert recovery.messages == len(list(read_messages(path))) == 35


def test_the_library_reads_a_recovered_log(cut_log: Path, tmp_path: Path) -> None:
    out = tmp_path / "good.mcap"
    recovery = recover(cut_log, out)
    with out.open("rb") as file:
        assert len(list(make_reader(file, validate_crcs=True).iter_messages())) == recovery.messages


def test_nothing_is_overwritten(cut_log: Path) -> None:
    with pytest.raises(BadRequest, match="exists already"):
        recover(cut_log, cut_log)


def test_a_log_without_messages_leaves_no_file(tmp_path: Path) -> None:
    empty = tmp_path / "empty.mcap"
    empty.write_bytes(b"\x89MCAP0\r\n")
    with pytest.raises(BadLog, match="no message"):
        recover(empty, tmp_path / "out.mcap")
    assert list(tmp_path.iterdir()) == [empty]


def test_what_cannot_be_decoded_is_left_out_and_named(write_run, run_of, tmp_path: Path) -> None:
    messages = run_of()
    messages[5] = (DECISION, messages[1][1])  # an image where a decision should be
    path = write_run(messages=messages)
    recovery = recover(path, tmp_path / "good.mcap")
    assert recovery.messages == 34
    assert recovery.lost == ["1 messages: gi/runtime/decision cannot be decoded"]
    assert check_log(tmp_path / "good.mcap").problems == []


def test_a_log_in_parts_becomes_one_file(write_run, tmp_path: Path) -> None:
    path = write_run(steps=12, settings=RecordingSettings(part_bytes=20_000, flush_seconds=0.0))
    parts = parts_of(path)
    assert len(parts) > 2
    whole = sum(len(list(LogReader(part).messages())) for part in parts)
    parts[1].write_bytes(parts[1].read_bytes()[:4000])
    parts[2].write_bytes(b"no log at all")
    recovery = recover(path, tmp_path / "good.mcap")
    assert recovery.parts == len(parts)
    assert 0 < recovery.messages < whole
    assert recovery.lost[0].startswith("run.001.mcap: ")
    assert recovery.lost[-1] == f"{parts[2]} is not an MCAP log"
    assert check_log(tmp_path / "good.mcap").problems == []
    sequences = [logged.sequence for logged in read_messages(tmp_path / "good.mcap", [DECISION.key])]
    assert sequences == sorted(sequences)
    assert sequences[-1] == 11


def test_a_lost_schema_of_ours_is_known(write_run, tmp_path: Path) -> None:
    path = write_run(settings=RecordingSettings(flush_seconds=0.0))
    lost = tmp_path / "lost.mcap"
    with path.open("rb") as file, lost.open("wb") as out:
        writer = Writer(out)
        writer.start()
        channels: dict[int, int] = {}
        for record in StreamReader(file).records:
            if isinstance(record, Channel):  # names a schema that the file does not hold
                channels[record.id] = writer.register_channel(record.topic, record.message_encoding, 77)
            elif isinstance(record, Message):
                channel = channels[record.channel_id]
                writer.add_message(channel, record.log_time, record.data, record.publish_time, record.sequence)
        writer.finish()
    assert recover(lost, tmp_path / "good.mcap").messages == 35
    assert check_log(tmp_path / "good.mcap").problems == []
    with (tmp_path / "good.mcap").open("rb") as file:
        schemas = {schema.name for schema, _, _ in make_reader(file).iter_messages() if schema is not None}
    assert "grasping_invisible.v1.Decision" in schemas
