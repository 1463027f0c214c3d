import pytest

from grasping_invisible.data import topics
from grasping_invisible.data.log_check import check_log
from grasping_invisible.data.log_recovery import recover
from grasping_invisible.data.log_summary import summarise
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.recorder import Recorder, RecordingSettings
from grasping_invisible.data.steps import steps


def test_a_whole_run_has_no_problem(write_run) -> None:
    assert check_log(write_run()).problems == []


def test_a_run_in_parts_has_no_problem(write_run) -> None:
    path = write_run(steps=12, settings=RecordingSettings(part_bytes=20_000, flush_seconds=0.0))
    assert path.with_name("run.002.mcap").exists()
    assert check_log(path).problems == []


def test_a_later_part_that_a_power_cut_left_empty_is_damage_of_a_log_that_can_be_read(write_run) -> None:
    path = write_run(steps=12, settings=RecordingSettings(part_bytes=20_000, flush_seconds=0.0))
    before = len(list(steps(path)))
    *_, last = sorted(path.parent.glob("run.*.mcap"))
    last.write_bytes(b"")
    assert f"{last.name}: is empty" in check_log(path).problems
    summary = summarise(path)
    assert (summary.complete, summary.damage) == (False, [f"{last.name}: is empty"])
    damage: list[str] = []
    assert len(list(steps(path, damage=damage))) >= before - 1
    assert damage == [f"{last.name}: is empty"]


@pytest.mark.parametrize(
    ("topic", "problem"),
    [
        (topics.RUN_START, "0 messages say how the run started, expected 1"),
        (topics.RUN_SUMMARY, "0 messages say how the run ended, expected 1"),
        (topics.DEPTH_IMAGE, "decision 0: the image of gi/robot/camera/depth it was made from is missing"),
        (topics.OUTCOME, "command 10 has no outcome"),
        (topics.STEP_RESULT, "decision 0 has no result"),
    ],
)
def test_what_is_missing_from_a_run_is_named(write_run, run_of, topic: topics.Topic, problem: str) -> None:
    messages = [pair for pair in run_of() if pair[0] is not topic]
    assert problem in check_log(write_run(messages=messages)).problems


def test_decisions_out_of_order_are_named(write_run, run_of) -> None:
    messages = run_of()
    for _, message in messages:
        if isinstance(message, gi.Decision):
            message.step += 5
    assert "decisions are not numbered 0, 1, 2, ...: [5, 6, 7]" in check_log(write_run(messages=messages)).problems


def test_a_refused_command_needs_no_outcome(write_run, run_of) -> None:
    messages = [
        *run_of()[:-1],
        (topics.COMMAND, gi.MotionCommand(id=98)),
        (topics.COMMAND_REPLY, gi.CommandReply(command_id=98, accepted=False)),
        (topics.COMMAND, gi.MotionCommand(id=99)),
        run_of()[-1],
    ]
    assert check_log(write_run(messages=messages)).problems == []


def test_drops_are_named(tmp_path, run_of) -> None:
    with Recorder(tmp_path / "run.mcap", RecordingSettings(queue_bytes=100_000)) as recorder:
        for topic, message in run_of():
            recorder.put(topic, message.SerializeToString(), 0)
        recorder.put(topics.VIEW, bytes(200_000), 0)
    assert "gi/runtime/view: 1 messages were dropped while recording" in check_log(recorder.path).problems


def test_a_damaged_count_of_drops_is_damage(tmp_path, run_of) -> None:
    with Recorder(tmp_path / "run.mcap", RecordingSettings(queue_bytes=100_000)) as recorder:
        for topic, message in run_of():
            recorder.put(topic, message.SerializeToString(), 0)
        recorder.put(topics.VIEW, bytes(200_000), 0)
    data = recorder.path.read_bytes()
    count = topics.VIEW.key.encode() + b"\x01\x00\x00\x00"
    assert count + b"1" in data
    recorder.path.write_bytes(data.replace(count + b"1", count + b"q"))
    assert "how many messages of gi/runtime/view were dropped is damaged" in check_log(recorder.path).problems


def test_a_lost_chunk_leaves_a_gap(write_run) -> None:
    path = write_run(settings=RecordingSettings(flush_seconds=0.0))
    data = bytearray(path.read_bytes())
    second_image = data.find(b"\x89PNG", data.find(b"\x89PNG") + 9000)
    data[second_image + 50] ^= 255
    path.write_bytes(data)
    problems = check_log(path).problems
    assert any("damaged" in problem for problem in problems)
    assert any("messages are missing" in problem for problem in problems)


def test_messages_that_cannot_be_decoded_are_not_missing_as_well(tmp_path, run_of) -> None:
    with Recorder(tmp_path / "run.mcap", RecordingSettings(queue_bytes=100_000)) as recorder:
        for topic, message in run_of():
            recorder.put(topic, message.SerializeToString(), 0)
        recorder.put(topics.VIEW, bytes(200_000), 0)  # dropped
        for payload in (b"\xff\xff", b"\xff\xff", b"", b"\xff\xff"):
            recorder.put(topics.VIEW, payload, 0)
    assert check_log(recorder.path).problems == [
        "run.mcap: 3 messages: gi/runtime/view cannot be decoded",
        "gi/runtime/view: 1 messages were dropped while recording",
    ]


def test_a_log_being_written_is_not_complete(tmp_path) -> None:
    with Recorder(tmp_path / "run.mcap"):
        assert "run.mcap: still being written" in check_log(tmp_path / "run.mcap").problems


def test_a_recovered_log_is_sound_and_says_what_it_lacks(write_run) -> None:
    path = write_run(settings=RecordingSettings(flush_seconds=0.0))
    path.write_bytes(path.read_bytes()[:60_000])
    recover(path, path.with_name("recovered.mcap"))
    checkup = check_log(path.with_name("recovered.mcap"))
    assert checkup.problems == []
    assert "from: run.mcap" in checkup.losses
    assert "0 messages say how the run ended, expected 1" in checkup.losses
