"""Camera messages out of a log, put together by their stamp."""

from collections import OrderedDict
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from google.protobuf.message import Message

from grasping_invisible.data.clock import to_ns
from grasping_invisible.data.log_reader import read_messages
from grasping_invisible.data.topics import Topic
from grasping_invisible.data.transform_message import latest_stamp

_WAITING = 4  # frames wanted, of which parts may still come


@dataclass(frozen=True)
class LoggedFrame:
    """What a log holds of one camera frame: messages by topic key."""

    stamp_ns: int
    messages: dict[str, Message] = field(default_factory=dict)


def camera_frames(path: Path, stamps: Collection[int], topics: Collection[Topic]) -> Iterator[LoggedFrame]:
    """The frames with the given stamps, over all parts of the log that begins at `path`.

    Each comes as soon as all of `topics` are there, one that lacks some a few frames later; of a frame that the log
    does not hold at all nothing comes. Only frames still incomplete are held. Raises `BadLog`.
    """
    keys = {topic.key for topic in topics}
    wanted = set(stamps)
    incomplete: OrderedDict[int, LoggedFrame] = OrderedDict()
    for logged in read_messages(path, keys):
        stamp = _stamp_of(logged.message)
        if stamp in wanted:
            frame = incomplete.setdefault(stamp, LoggedFrame(stamp))
            frame.messages[logged.topic] = logged.message
            if len(frame.messages) == len(keys):
                wanted.remove(stamp)
                yield incomplete.pop(stamp)
            elif len(incomplete) > _WAITING:
                late, lacking = incomplete.popitem(last=False)
                wanted.remove(late)
                yield lacking
        if not wanted:
            break
    yield from incomplete.values()


def _stamp_of(message: Message) -> int | None:
    if isinstance(message, FrameTransforms):
        return latest_stamp(message)
    timestamp = getattr(message, "timestamp", None)
    return None if timestamp is None else to_ns(timestamp)
