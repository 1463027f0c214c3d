"""Turns what the loop does into messages on the bus. What takes long is done in a thread of its own."""

import re
import sys
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

from foxglove_schemas_protobuf.Log_pb2 import Log

from grasping_invisible.data.clock import to_timestamp
from grasping_invisible.data.heightmap_message import HeightmapArrays, encode_heightmaps
from grasping_invisible.data.images import encode_color, encode_labels
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.q_map_message import QMapArrays, encode_q_maps
from grasping_invisible.data.stream import write_line
from grasping_invisible.data.topics import (
    CONSOLE,
    DECISION,
    HEIGHTMAPS,
    MARKERS,
    Q_MAPS,
    RUN_START,
    RUN_SUMMARY,
    SEGMENTATION,
    STEP_RESULT,
    VIEW,
)
from grasping_invisible.runtime.bus import Bus
from grasping_invisible.runtime.decision import Deliberation
from grasping_invisible.runtime.frame import RgbdFrame
from grasping_invisible.runtime.judge import Judgement
from grasping_invisible.runtime.loop import RunProgress
from grasping_invisible.runtime.markers import decision_markers
from grasping_invisible.runtime.perception import Perception
from grasping_invisible.runtime.picture import draw_decision
from grasping_invisible.runtime.timing import percentile

_VIEW_QUALITY = 88


def in_file_name(name: str) -> str:
    """A name as a part of a file's: whatever a scene file calls itself, it leads to no other folder."""
    return re.sub(r"[^\w.]+", "-", name)


@dataclass(frozen=True)
class RunFacts:
    """What a run is, as logged at its start."""

    run_id: str
    project_version: str
    bundle_sha256: str
    onnxruntime_version: str
    target: str
    scene: str
    seed: int
    max_motions: int
    config_toml: str
    robot: str


class RunLog:
    """A watcher of the loop that says on the bus what it saw, decided and concluded.

    Without `pictures` it leaves out what people look at: segmentation, Q maps, markers and the view. A picture that
    cannot be made is missing from the log; that is told once, and the run goes on.
    """

    def __init__(self, bus: Bus, target: str, *, pictures: bool = True) -> None:
        self._bus = bus
        self._pictures = pictures
        self._target = target
        self._worker = ThreadPoolExecutor(1, thread_name_prefix="run log")
        self._pending: list[Future[None]] = []
        self._complained = False

    def started(self, facts: RunFacts) -> None:
        """Say what this run is."""
        self._bus.publish(
            RUN_START,
            gi.RunStart(
                stamp=to_timestamp(time.time_ns()),
                run_id=facts.run_id,
                project_version=facts.project_version,
                bundle_sha256=facts.bundle_sha256,
                target_color=facts.target,
                scene=facts.scene,
                seed=facts.seed,
                max_motions=facts.max_motions,
                config_toml=facts.config_toml,
                robot=facts.robot,
                onnxruntime_version=facts.onnxruntime_version,
            ),
        )

    def perceived(self, frame: RgbdFrame, perception: Perception, step: int) -> None:
        """See `Watcher`."""
        self._later(self._say_perception, perception, step)

    def decided(self, frame: RgbdFrame, deliberation: Deliberation) -> None:
        """See `Watcher`."""
        self._finish_pending()  # a log holds one step after the other
        self._bus.publish(DECISION, deliberation.decision.message(time.time_ns(), deliberation.stage_ms))
        if self._pictures:
            self._later(self._say_deliberation, frame, deliberation)

    def judged(self, deliberation: Deliberation, outcome: gi.MotionOutcome, judgement: Judgement) -> None:
        """See `Watcher`."""
        self._bus.publish(STEP_RESULT, judgement.message(deliberation.decision, outcome, time.time_ns()))

    def ended(self, run_id: str, progress: RunProgress, dropped_messages: int, lost_messages: int = 0) -> None:
        """Say how the run ended; everything before is said by then. `lost_messages`: of the robot's, on the link."""
        self._worker.shutdown(wait=True)
        self._bus.publish(
            RUN_SUMMARY,
            gi.RunSummary(
                stamp=to_timestamp(time.time_ns()),
                run_id=run_id,
                grasped=progress.grasped,
                found=progress.found,
                motions=progress.motions,
                decision_ms_p50=percentile(progress.decision_ms, 50),
                decision_ms_p99=percentile(progress.decision_ms, 99),
                dropped_messages=dropped_messages,
                lost_messages=lost_messages,
                ended_because=progress.ended_because,
            ),
        )

    def _later(self, say: Callable[..., None], *arguments: object) -> None:
        self._pending.append(self._worker.submit(self._try, say, *arguments))

    def _try(self, say: Callable[..., None], *arguments: object) -> None:
        try:
            say(*arguments)
        except Exception as error:
            if self._complained:
                return
            self._complained = True
            line = f"the log will lack pictures or maps, the run goes on: {error!r}"
            now = to_timestamp(time.time_ns())
            self._bus.publish(CONSOLE, Log(timestamp=now, level=Log.WARNING, message=line, name="run log"))
            write_line(line, sys.stderr)

    def _finish_pending(self) -> None:
        for pending in self._pending:
            pending.result()
        self._pending.clear()

    def _say_perception(self, perception: Perception, step: int) -> None:
        maps = perception.maps
        if self._pictures:
            self._bus.publish(SEGMENTATION, encode_labels(perception.labels, maps.stamp_ns))
        arrays = HeightmapArrays(
            stamp_ns=maps.stamp_ns,
            step=step,
            color=maps.color,
            height=maps.height,
            labels=maps.labels,
            resolution=maps.workspace.resolution,
            center=maps.workspace.center,
        )
        self._bus.publish(HEIGHTMAPS, encode_heightmaps(arrays))

    def _say_deliberation(self, frame: RgbdFrame, deliberation: Deliberation) -> None:
        decision, q_maps = deliberation.decision, deliberation.q_maps
        stamp = decision.frame_stamp_ns
        self._bus.publish(Q_MAPS, encode_q_maps(QMapArrays(stamp, decision.step, q_maps.push, q_maps.grasp)))
        workspace = deliberation.perception.maps.workspace
        self._bus.publish(MARKERS, decision_markers(decision, workspace, time.time_ns()))
        picture = draw_decision(frame, deliberation, self._target)
        self._bus.publish(VIEW, encode_color(picture, stamp, frame_id="decision", jpeg_quality=_VIEW_QUALITY))
