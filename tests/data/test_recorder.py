import errno
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from grasping_invisible.data.errors import RecordingError
from grasping_invisible.data.log_file import LogFile, is_being_written
from grasping_invisible.data.log_reader import LogReader
from grasping_invisible.data.log_storage import parts_of
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.recorder import PART, Recorder, RecordingSettings
from grasping_invisible.data.topics import COLOR_IMAGE, CONSOLE, DECISION, DEPTH_IMAGE


def decision(step: int) -> bytes:
    return gi.Decision(step=step, why="x" * 50).SerializeToString()


def sequences(path: Path, topic: str = DECISION.key) -> list[int]:
    return [message.sequence for message in LogReader(path).messages([topic])]


def test_what_is_put_is_read_back_in_order(tmp_path: Path) -> None:
    path = tmp_path / "new" / "run.mcap"
    with Recorder(path) as recorder:
        for step in range(50):
            recorder.put(DECISION, decision(step), 1000 + step)
    reader = LogReader(path)
    messages = list(reader.messages())
    assert reader.complete, reader.damage
    assert [m.message.step for m in messages if isinstance(m.message, gi.Decision)] == list(range(50))
    assert [m.publish_time_ns for m in messages] == list(range(1000, 1050))
    assert [m.sequence for m in messages] == list(range(50))
    assert (recorder.dropped_messages, recorder.failure) == (0, None)


def test_metadata_is_kept(tmp_path: Path) -> None:
    with Recorder(tmp_path / "run.mcap") as recorder:
        recorder.add_metadata("run", {"seed": "7"})
    reader = LogReader(tmp_path / "run.mcap")
    assert not list(reader.messages())
    assert reader.metadata["run"] == {"seed": "7"}
    assert reader.metadata["dropped"] == {}


def test_a_log_is_never_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    path.write_text("precious")
    with pytest.raises(RecordingError, match="exists already"):
        Recorder(path)
    assert path.read_text() == "precious"


def test_a_folder_that_cannot_be_made_is_a_recording_error(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(RecordingError, match="cannot create log"):
        Recorder(tmp_path / "file" / "run.mcap")


def stall(monkeypatch: pytest.MonkeyPatch) -> threading.Event:
    """Make the writer's thread wait at its next message until the event is set."""
    released = threading.Event()
    write = LogFile.write

    def slow(self: LogFile, *arguments: object) -> None:
        released.wait(10)
        write(self, *arguments)  # pyright: ignore[reportArgumentType]

    monkeypatch.setattr(LogFile, "write", slow)
    return released


def test_a_full_queue_drops_counts_and_leaves_gaps(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    released = stall(monkeypatch)
    with Recorder(tmp_path / "run.mcap", RecordingSettings(queue_bytes=5000)) as recorder:
        for step in range(100):
            recorder.put(DECISION, decision(step), step)
        dropped = recorder.dropped_messages
        released.set()
        time.sleep(0.1)
        recorder.put(DECISION, decision(100), 100)
    kept = sequences(recorder.path)
    assert 0 < dropped < 100
    assert len(kept) == 101 - dropped
    assert kept[-1] == 100
    reader = LogReader(recorder.path)
    list(reader.messages())
    assert reader.metadata["dropped"] == {DECISION.key: str(dropped)}


def test_images_do_not_push_out_decisions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    released = stall(monkeypatch)
    with Recorder(tmp_path / "run.mcap", RecordingSettings(queue_bytes=2_000_000)) as recorder:
        for _ in range(40):
            recorder.put(COLOR_IMAGE, bytes(100_000), 0)
        recorder.put(DECISION, decision(0), 0)
        released.set()
    assert recorder.dropped.keys() == {COLOR_IMAGE.key}
    assert sequences(recorder.path) == [0]


def test_put_does_not_wait_for_a_stalled_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    released = stall(monkeypatch)
    with Recorder(tmp_path / "run.mcap") as recorder:
        began = time.perf_counter()
        for _ in range(50):
            recorder.put(COLOR_IMAGE, bytes(500_000), 0)
        assert time.perf_counter() - began < 1.0
        released.set()


def test_many_threads_may_speak(tmp_path: Path) -> None:
    with Recorder(tmp_path / "run.mcap") as recorder:
        threads = [
            threading.Thread(target=lambda: [recorder.put(DECISION, decision(0), 0) for _ in range(200)])
            for _ in range(4)
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert sequences(recorder.path) == list(range(800))


def test_a_disk_error_stops_recording_but_not_the_caller(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write = LogFile.write

    def fails_at_sequence_5(self: LogFile, *arguments: object) -> None:
        if arguments[-1] == 5:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        write(self, *arguments)  # pyright: ignore[reportArgumentType]

    monkeypatch.setattr(LogFile, "write", fails_at_sequence_5)
    recorder = Recorder(tmp_path / "run.mcap", RecordingSettings(flush_seconds=0.0))
    for step in range(10):
        recorder.put(DECISION, decision(step), step)
    time.sleep(0.2)
    recorder.put(DECISION, decision(10), 10)
    recorder.close()
    assert recorder.failure is not None
    assert "No space left on device" in recorder.failure
    assert "\n" not in recorder.failure
    assert sequences(recorder.path) == list(range(5))
    assert recorder.dropped_messages == 6


FULL_DISK = """
import resource, signal, sys, time
from pathlib import Path
from grasping_invisible.data.recorder import Recorder
from grasping_invisible.data.topics import COLOR_IMAGE, DECISION
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (2_000_000, 2_000_000))
import os
recorder = Recorder(Path(sys.argv[1]))
for step in range(40):
    recorder.put(DECISION, b"", step)
    recorder.put(COLOR_IMAGE, os.urandom(100_000), step)
    time.sleep(0.01)
recorder.close()
print(recorder.failure)
"""


def test_a_file_that_can_grow_no_more_stays_readable(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    done = subprocess.run(
        [sys.executable, "-c", FULL_DISK, str(path)], capture_output=True, text=True, timeout=60, check=True
    )
    assert "stopped: File too large" in done.stdout
    assert not done.stderr
    reader = LogReader(path)
    kept = [m.topic for m in reader.messages([DECISION.key])]
    assert len(kept) > 5
    assert not reader.complete


KILLED = """
import sys, time
from pathlib import Path
from grasping_invisible.data.recorder import Recorder
from grasping_invisible.data.topics import DECISION, DEPTH_IMAGE
recorder = Recorder(Path(sys.argv[1]))
step = 0
while True:
    recorder.put(DECISION, b"", time.time_ns())
    recorder.put(DEPTH_IMAGE, b"", time.time_ns())
    print(step, flush=True)
    step += 1
    time.sleep(0.02)
"""


def test_a_kill_loses_less_than_a_second(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with subprocess.Popen([sys.executable, "-c", KILLED, str(path)], stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.readline()
        time.sleep(1.5)
        assert is_being_written(path)
        process.send_signal(signal.SIGKILL)
        killed_at = time.time_ns()
        process.wait(10)
    assert not is_being_written(path)
    reader = LogReader(path)
    messages = list(reader.messages())
    assert not reader.complete
    assert reader.damage == [f"the file ends at byte {path.stat().st_size} without an index: it was not closed"]
    assert {message.topic for message in messages} == {DECISION.key, DEPTH_IMAGE.key}
    assert killed_at - messages[-1].publish_time_ns < 1_000_000_000


def test_an_idle_log_is_flushed(tmp_path: Path) -> None:
    with Recorder(tmp_path / "run.mcap", RecordingSettings(flush_seconds=0.1)) as recorder:
        recorder.put(CONSOLE, b"", 0)
        deadline = time.monotonic() + 5
        while not sequences(recorder.path, CONSOLE.key):
            assert time.monotonic() < deadline
            time.sleep(0.02)


def test_a_log_goes_on_in_parts(tmp_path: Path) -> None:
    settings = RecordingSettings(part_bytes=3000, flush_seconds=0.0)
    with Recorder(tmp_path / "run.mcap", settings) as recorder:
        recorder.add_metadata("run", {"seed": "7"})
        for step in range(40):
            recorder.put(DECISION, decision(step), step)
            time.sleep(0.002)
    parts = sorted(tmp_path.glob("*.mcap"))
    assert tmp_path / "run.mcap" in parts
    assert tmp_path / "run.001.mcap" in parts
    kept: list[int] = []
    for number in range(len(parts)):
        reader = LogReader(tmp_path / ("run.mcap" if number == 0 else f"run.{number:03d}.mcap"))
        kept += [message.sequence for message in reader.messages()]
        assert reader.complete
        assert reader.metadata["part"] == {"log": "run.mcap", "part": str(number)}
        assert reader.metadata["run"] == {"seed": "7"}
    assert kept == list(range(40))


def test_old_logs_make_room(tmp_path: Path) -> None:
    old = tmp_path / "a-old.mcap"
    old.write_bytes(bytes(50_000))
    os.utime(old, (1, 1))
    with Recorder(tmp_path / "run.mcap", RecordingSettings(folder_bytes=40_000)) as recorder:
        recorder.put(DECISION, decision(0), 0)
    assert not old.exists()
    assert sequences(recorder.path) == [0]


MOVING = """
import os, sys, threading, time
from pathlib import Path
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.recorder import Recorder
from grasping_invisible.data.topics import COLOR_IMAGE, OUTCOME
recorder = Recorder(Path(sys.argv[1]))
for number in range(10_000):
    stamp = time.time_ns()
    recorder.put(COLOR_IMAGE, os.urandom(200_000), stamp)
    recorder.put(OUTCOME, gi.MotionOutcome(command_id=number).SerializeToString(), stamp)
    time.sleep(0.1)
    print(number, stamp, flush=True)
"""


@pytest.mark.parametrize("after", [0.03, 0.2, 0.35, 0.5, 0.9])
def test_a_kill_at_any_moment_loses_no_finished_motion(tmp_path: Path, after: float) -> None:
    path = tmp_path / "run.mcap"
    with subprocess.Popen([sys.executable, "-c", MOVING, str(path)], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        first = process.stdout.readline()
        time.sleep(after)
        process.send_signal(signal.SIGKILL)
        said = [first, *process.stdout.readlines()]
    finished = {int(line.split()[0]) for line in said if line.endswith("\n")}
    reader = LogReader(path)
    messages = list(reader.messages())
    outcomes = {m.message.command_id for m in messages if isinstance(m.message, gi.MotionOutcome)}
    assert finished <= outcomes
    images = [raw.publish_time for _, _, raw in reader.raw_messages([COLOR_IMAGE.key])]
    latest = max(int(line.split()[1]) for line in said if line.endswith("\n"))
    assert latest - max(images) < 1_000_000_000


def test_a_log_goes_on_in_parts_by_time(tmp_path: Path) -> None:
    settings = RecordingSettings(part_seconds=0.1, flush_seconds=0.0)
    with Recorder(tmp_path / "run.mcap", settings) as recorder:
        for step in range(12):
            recorder.put(DECISION, decision(step), step)
            time.sleep(0.03)
    parts = parts_of(tmp_path / "run.mcap")
    assert 2 <= len(parts) <= 6
    assert [sequence for part in parts for sequence in sequences(part)] == list(range(12))


HOLDING = """
import sys
from pathlib import Path
from grasping_invisible.data.recorder import Recorder
from grasping_invisible.data.topics import DEPTH_IMAGE
recorder = Recorder(Path(sys.argv[1]))
recorder.put(DEPTH_IMAGE, bytes(500_000), 0)
print(flush=True)
sys.stdin.read()
recorder.close()
"""


def test_a_log_that_another_process_writes_is_not_removed_for_room(tmp_path: Path) -> None:
    theirs, closed = tmp_path / "a.mcap", tmp_path / "b.mcap"
    with subprocess.Popen(
        [sys.executable, "-c", HOLDING, str(theirs)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        assert process.stdin is not None
        process.stdout.readline()
        closed.write_bytes(bytes(10_000))
        with Recorder(tmp_path / "c.mcap", RecordingSettings(folder_bytes=1)) as recorder:
            recorder.put(DECISION, decision(0), 0)
        assert sorted(path.name for path in tmp_path.glob("*.mcap")) == ["a.mcap", "c.mcap"]
        process.stdin.close()
        process.wait(10)
    reader = LogReader(theirs)
    assert len(list(reader.raw_messages())) == 1
    assert reader.complete


def test_a_log_whose_name_is_no_text_is_written(tmp_path: Path) -> None:
    with Recorder(tmp_path / "b\udcff.mcap") as recorder:
        recorder.put(DECISION, decision(0), 0)
    assert recorder.failure is None
    reader = LogReader(recorder.path)
    assert len(list(reader.raw_messages())) == 1
    assert reader.metadata[PART]["log"] == r"b\xff.mcap"
