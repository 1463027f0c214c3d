"""What can be wrong with kept data, as one small tree."""

EXIT_BAD_INPUT = 2
EXIT_SOFTWARE = 70  # a fault of ours, as sysexits.h has it
EXIT_INTERRUPTED = 130


class DataError(Exception):
    """A log or a message that cannot be used: one clear line for a person."""


class BadLog(DataError):
    """A file that is not a log, or holds nothing that can be read."""


class BadMessage(DataError):
    """A message whose content is not what its type promises, such as a damaged image."""


class BadRequest(DataError):
    """A request that cannot be met, such as an output that exists already."""


class RecordingError(DataError):
    """A log that cannot be created."""


class WorkerDied(DataError):
    """A worker process that was killed or crashed, and its work with it."""
