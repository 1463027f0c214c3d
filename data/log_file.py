"""One MCAP file while it is being written."""

import fcntl
import os
import time
from contextlib import suppress
from pathlib import Path

from mcap.writer import Writer
from mcap_protobuf.schema import register_schema

from grasping_invisible.data.errors import RecordingError
from grasping_invisible.data.regular_file import open_regular
from grasping_invisible.data.topics import Topic

# Small, so that compressing one never holds up the writer for long and a damaged one loses little.
_CHUNK_BYTES = 1 << 20


class LogFile:
    """A new log: a channel for each topic, named by its key, with its protobuf schema.

    Holds a lock on the file until it is closed or its process ends; see `is_being_written`.
    Writing may raise `OSError`; what was flushed before stays readable.
    """

    def __init__(self, path: Path) -> None:
        """Create `path`, and its folder. Raises `RecordingError`, also when it exists already."""
        self.path = path
        # Begun under another name and then renamed: from the first moment that it is there, the file is a log.
        beginning = path.with_name(f".{path.name}.beginning")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            if path.exists():
                raise RecordingError(f"log {path} exists already; logs are never overwritten")
            self._file = beginning.open("wb")
            fcntl.flock(self._file, fcntl.LOCK_EX)
            self._writer = Writer(self._file, chunk_size=_CHUNK_BYTES)
            self._writer.start(profile="", library="grasping-invisible")
            self._writer.flush()
            os.fsync(self._file.fileno())  # nor does a power cut leave it there empty
            beginning.rename(path)
        except OSError as error:
            raise RecordingError(f"cannot create log {path}: {error.strerror}") from None
        self._channels: dict[str, int] = {}
        self.opened_at = time.monotonic()

    @property
    def size(self) -> int:
        """Bytes written so far."""
        return self._file.tell()

    def write(self, topic: Topic, payload: bytes, log_time_ns: int, publish_time_ns: int, sequence: int) -> None:
        """Add one serialised message of the topic's type."""
        channel = self._channels.get(topic.key)
        if channel is None:
            schema = register_schema(self._writer, topic.message)
            channel = self._writer.register_channel(topic.key, "protobuf", schema)
            self._channels[topic.key] = channel
        self._writer.add_message(channel, log_time_ns, payload, publish_time_ns, sequence)

    def add_metadata(self, name: str, data: dict[str, str]) -> None:
        """Add a named table of strings."""
        self._writer.add_metadata(name, data)

    def flush(self) -> None:
        """Hand everything to the operating system as complete chunks: it survives the end of this process."""
        self._writer.flush()

    def finish(self) -> None:
        """Write the index and close; the log is then complete."""
        self._writer.finish()
        self._file.close()

    def abandon(self) -> None:
        """Close without an index, after a write failed. Never raises."""
        with suppress(OSError):  # what could not be written is lost; the caller knows
            self._file.close()


def is_being_written(path: Path) -> bool:
    """Whether a living process has this log open for writing."""
    try:
        with open_regular(path) as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    return False
