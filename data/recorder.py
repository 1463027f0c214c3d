"""Writes what is said to a log, from a thread: whoever speaks never waits for the disk."""

import math
import threading
import time
from collections import Counter, deque
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Annotated

import msgspec

from grasping_invisible.data.errors import RecordingError
from grasping_invisible.data.log_file import LogFile
from grasping_invisible.data.log_storage import keep_within, part_path
from grasping_invisible.data.shown_name import shown
from grasping_invisible.data.topics import DECISION, OUTCOME, RUN_START, RUN_SUMMARY, STEP_RESULT, Topic

DROPPED = "dropped"  # metadata: how many messages of each topic did not reach the log, so far
LOST = "lost"  # metadata: how many of the robot's messages of each topic were lost on the link
PART = "part"  # metadata: which part of which log this file is

# Few and small, and what a log is for: not kept back until the next flush.
_AT_ONCE = frozenset(topic.key for topic in (RUN_START, DECISION, OUTCOME, STEP_RESULT, RUN_SUMMARY))
_SMALL_BYTES = 64 * 1024
_CLOSE_SECONDS = 10.0
_BUDGET_CHECK_SECONDS = 10.0


class RecordingSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How much memory and disk a recording may take; `None` means no limit.

    `flush_seconds` bounds what a kill can lose; decisions, outcomes and results do not wait for it. A new part begins
    after `part_bytes` or `part_seconds`.
    `folder_bytes` is the budget of the log's whole folder: the oldest closed logs make room, each with all
    its parts, while a log being written stays whole.
    """

    queue_bytes: Annotated[int, msgspec.Meta(ge=1_000_000)] = 64 << 20
    flush_seconds: Annotated[float, msgspec.Meta(ge=0, le=3600)] = 0.4
    part_bytes: Annotated[int, msgspec.Meta(ge=1_000_000)] | None = None
    part_seconds: Annotated[float, msgspec.Meta(ge=1, le=1e9)] | None = None
    folder_bytes: Annotated[int, msgspec.Meta(ge=0)] | None = None


@dataclass(frozen=True)
class _Message:
    topic: Topic
    payload: bytes
    log_time_ns: int
    publish_time_ns: int
    sequence: int

    @property
    def cost(self) -> int:
        return len(self.payload) + 256  # about what the objects around it take


@dataclass(frozen=True)
class _Metadata:
    name: str
    data: dict[str, str]
    cost = 0


class Recorder:
    """Records messages to one log. Safe to call from any thread.

    A message that finds the queue full, or comes after the disk failed, is dropped and counted: in
    `dropped`, and in the log. Sequence numbers count dropped messages too, so gaps show where.
    """

    def __init__(self, path: Path, settings: RecordingSettings | None = None) -> None:
        """Create the log. Raises `RecordingError` when it cannot be created or exists already."""
        self.path = path
        self._settings = settings or RecordingSettings()
        self._queue: deque[_Message | _Metadata] = deque()
        self._queued_bytes = 0
        self._sequences: Counter[str] = Counter()
        self._dropped: Counter[str] = Counter()
        self._changed = threading.Condition()
        self._closing = False
        self._failure: str | None = None
        self._run_metadata: list[_Metadata] = []
        self._part = 0
        self._file = LogFile(path)
        self._unflushed: Counter[str] = Counter()
        self._drops_written = 0
        self._budget_checked_at = 0.0
        # A daemon: a disk that hangs must not keep the process alive.
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)
        self._thread.start()

    @property
    def failure(self) -> str | None:
        """Why recording stopped, in one line; None while all is well."""
        return self._failure

    @property
    def dropped(self) -> dict[str, int]:
        """How many messages of each topic did not reach the log; after a failure, at most so many."""
        with self._changed:
            return dict(self._dropped)

    @property
    def dropped_messages(self) -> int:
        """How many messages did not reach the log."""
        with self._changed:
            return self._dropped.total()

    def put(self, topic: Topic, payload: bytes, publish_time_ns: int) -> None:
        """Keep one serialised message of the topic's type, spoken at `publish_time_ns`. Never waits."""
        log_time_ns = time.time_ns()
        with self._changed:
            message = _Message(topic, payload, log_time_ns, publish_time_ns, self._sequences[topic.key])
            self._sequences[topic.key] += 1
            if self._failure is not None or self._closing or self._is_full_for(message):
                self._dropped[topic.key] += 1
                return
            self._append(message)

    __call__ = put

    def add_metadata(self, name: str, data: dict[str, str]) -> None:
        """Keep a named table of strings about the run, in every part of the log."""
        with self._changed:
            if self._failure is None and not self._closing:
                self._append(_Metadata(name, dict(data)))

    def close(self) -> None:
        """Write what is queued, complete the log and let go of it. Never raises; see `failure`."""
        with self._changed:
            self._closing = True
            self._changed.notify()
        self._thread.join(_CLOSE_SECONDS)
        if self._thread.is_alive():
            self._failure = f"recording not finished: the disk of {self._file.path} does not answer"

    def __enter__(self) -> "Recorder":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _is_full_for(self, message: _Message) -> bool:
        # The last tenth is kept for small messages: a flood of images must not push out a decision.
        limit = self._settings.queue_bytes
        if len(message.payload) > _SMALL_BYTES:
            limit -= limit // 10
        return self._queued_bytes + message.cost > limit

    def _append(self, entry: _Message | _Metadata) -> None:
        self._queue.append(entry)
        self._queued_bytes += entry.cost
        self._changed.notify()

    # ---- the writer's thread ----------------------------------------------------------------------

    def _run(self) -> None:
        try:
            self._write_until_closed()
        except OSError as error:
            self._fail(error.strerror or str(error))
        except RecordingError as error:
            self._fail(str(error))
        except Exception as error:  # whatever it is, the robot's loop must go on and the reason be seen
            self._fail(repr(error))

    def _write_until_closed(self) -> None:
        self._begin_part()
        flush_at: float | None = None  # None: all that was written is flushed
        while True:
            entry, closing = self._next_entry(flush_at)
            if entry is not None:
                self._write(entry)
                waits = 0.0 if _is_urgent(entry) else self._settings.flush_seconds
                flush_at = min(flush_at or math.inf, time.monotonic() + waits)
            elif closing:
                break
            if flush_at is not None and time.monotonic() >= flush_at:
                self._flush()
                flush_at = None
        self._finish_part()

    def _next_entry(self, deadline: float | None) -> tuple[_Message | _Metadata | None, bool]:
        """The oldest entry, or None when the deadline came or the recorder closes, and whether it closes."""
        with self._changed:
            timeout = None if deadline is None else max(0.0, deadline - time.monotonic())
            self._changed.wait_for(lambda: self._queue or self._closing, timeout)
            if not self._queue:
                return None, self._closing
            entry = self._queue.popleft()
            self._queued_bytes -= entry.cost
            return entry, self._closing

    def _write(self, entry: _Message | _Metadata) -> None:
        if isinstance(entry, _Metadata):
            self._run_metadata.append(entry)
            self._file.add_metadata(entry.name, entry.data)
            return
        if self._part_is_full():
            self._finish_part()
            self._part += 1
            self._file = LogFile(part_path(self.path, self._part))
            self._begin_part()
        self._unflushed[entry.topic.key] += 1
        self._file.write(entry.topic, entry.payload, entry.log_time_ns, entry.publish_time_ns, entry.sequence)

    def _flush(self) -> None:
        dropped = self.dropped
        if sum(dropped.values()) != self._drops_written:
            self._write_drops(dropped)
        self._file.flush()
        self._unflushed.clear()
        if time.monotonic() - self._budget_checked_at > _BUDGET_CHECK_SECONDS:
            self._keep_budget()

    def _part_is_full(self) -> bool:
        limits = self._settings
        return (limits.part_bytes is not None and self._file.size >= limits.part_bytes) or (
            limits.part_seconds is not None and time.monotonic() - self._file.opened_at >= limits.part_seconds
        )

    def _begin_part(self) -> None:
        self._keep_budget()
        self._file.add_metadata(PART, {"log": shown(self.path.name), "part": str(self._part)})
        for entry in self._run_metadata:
            self._file.add_metadata(entry.name, entry.data)
        self._file.flush()

    def _finish_part(self) -> None:
        self._write_drops(self.dropped)
        self._file.finish()

    def _write_drops(self, dropped: dict[str, int]) -> None:
        self._file.add_metadata(DROPPED, {topic: str(count) for topic, count in sorted(dropped.items())})
        self._drops_written = sum(dropped.values())

    def _keep_budget(self) -> None:
        self._budget_checked_at = time.monotonic()
        if self._settings.folder_bytes is not None:
            keep_within(self.path.parent, self._settings.folder_bytes)

    def _fail(self, reason: str) -> None:
        self._file.abandon()
        with self._changed:
            self._failure = f"recording to {self._file.path} stopped: {reason}"
            self._dropped += self._unflushed
            for entry in self._queue:
                if isinstance(entry, _Message):
                    self._dropped[entry.topic.key] += 1
            self._queue.clear()
            self._queued_bytes = 0


def _is_urgent(entry: _Message | _Metadata) -> bool:
    return isinstance(entry, _Message) and entry.topic.key in _AT_ONCE
