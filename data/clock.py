"""Nanoseconds since the epoch, as the code counts time, to and from protobuf timestamps."""

from google.protobuf.timestamp_pb2 import Timestamp

_SECOND = 1_000_000_000


def to_timestamp(stamp_ns: int) -> Timestamp:
    """Nanoseconds since the epoch as a protobuf `Timestamp`."""
    seconds, nanos = divmod(stamp_ns, _SECOND)
    return Timestamp(seconds=seconds, nanos=nanos)


def to_ns(stamp: Timestamp) -> int:
    """A protobuf `Timestamp` as nanoseconds since the epoch."""
    return stamp.seconds * _SECOND + stamp.nanos
