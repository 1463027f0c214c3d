"""What a log is about, without reading more of it than needed."""

from pathlib import Path

import msgspec

from grasping_invisible.data import topics
from grasping_invisible.data.log_file import is_being_written
from grasping_invisible.data.log_reader import TopicContent, counts_by_topic, readers_of
from grasping_invisible.data.log_storage import parts_of
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.recorder import DROPPED, LOST

UNFINISHED = "unfinished"
_TOPICS = (topics.RUN_START.key, topics.RUN_SUMMARY.key)


class RunFacts(msgspec.Struct, frozen=True):
    """What the run was, from its `RunStart`."""

    run_id: str
    project_version: str
    bundle_sha256: str
    target: str
    scene: str
    seed: int
    max_motions: int
    robot: str


class RunEnd(msgspec.Struct, frozen=True):
    """How the run ended, from its `RunSummary`; times in milliseconds."""

    grasped: bool
    found: bool
    motions: int
    ended_because: str
    decision_ms_p50: float
    decision_ms_p99: float


class LogSummary(msgspec.Struct, frozen=True):
    """A log over all its parts. Times are nanoseconds since the epoch; 0 where nothing was readable.

    `complete`: every part was closed and what was read of it is sound; `gi-log check` reads all of it. `dropped`:
    messages that the disk could not take; `lost`: messages of the robot's that the link could not carry.
    """

    path: str
    parts: int
    bytes: int
    complete: bool
    being_written: bool
    damage: list[str]
    begun_ns: int
    ended_ns: int
    outcome: str
    run: RunFacts | None
    end: RunEnd | None
    topics: dict[str, TopicContent]
    dropped: dict[str, int]
    lost: dict[str, int]


def summarise(path: Path) -> LogSummary:
    """Read what describes the log that begins at `path`. Raises `BadLog`."""
    run: RunFacts | None = None
    end: RunEnd | None = None
    counts: dict[str, TopicContent] = {}
    damage: list[str] = []
    dropped: dict[str, int] = {}
    lost: dict[str, int] = {}
    times: list[int] = []
    complete = True
    parts = parts_of(path)
    for reader in readers_of(path):
        contents = reader.contents()
        for logged in reader.messages(_TOPICS):
            if isinstance(logged.message, gi.RunStart):
                run = _run_facts(logged.message)
            elif isinstance(logged.message, gi.RunSummary):
                end = _run_end(logged.message)
        if contents.topics:
            times += [contents.begins_ns, contents.ends_ns]
        complete = complete and reader.complete
        damage += reader.named_damage if len(parts) > 1 else reader.damage
        dropped = _counts(reader.metadata.get(DROPPED), dropped)
        lost = _counts(reader.metadata.get(LOST), lost)
        for topic, content in contents.topics.items():
            before = counts.get(topic, TopicContent(content.type, 0))
            counts[topic] = TopicContent(content.type, before.messages + content.messages)
    return LogSummary(
        path=str(path),
        parts=len(parts),
        bytes=sum(part.stat().st_size for part in parts),
        complete=complete,
        being_written=is_being_written(parts[-1]),
        damage=damage,
        begun_ns=min(times, default=0),
        ended_ns=max(times, default=0),
        outcome=_outcome(end),
        run=run,
        end=end,
        topics=dict(sorted(counts.items())),
        dropped=dropped,
        lost=lost,
    )


def _outcome(end: RunEnd | None) -> str:
    if end is None:
        return UNFINISHED
    return "grasped" if end.grasped else end.ended_because or "not grasped"


def _counts(written: dict[str, str] | None, before: dict[str, int]) -> dict[str, int]:
    # Counts are of the whole run so far, so the last part's are the run's.
    if written is None:
        return before
    return counts_by_topic(written)


def _run_facts(start: gi.RunStart) -> RunFacts:
    return RunFacts(
        run_id=start.run_id,
        project_version=start.project_version,
        bundle_sha256=start.bundle_sha256,
        target=start.target_color,
        scene=start.scene,
        seed=start.seed,
        max_motions=start.max_motions,
        robot=start.robot,
    )


def _run_end(summary: gi.RunSummary) -> RunEnd:
    return RunEnd(
        grasped=summary.grasped,
        found=summary.found,
        motions=summary.motions,
        ended_because=summary.ended_because,
        decision_ms_p50=summary.decision_ms_p50,
        decision_ms_p99=summary.decision_ms_p99,
    )
