"""`gi-bench recorder`: a whole runtime that records RGB-D images and all else that is said, for minutes.

The robot is a process of its own at the other end of the link (see `export.bench_robot`), the loop is the runtime's and
decides with the shipped models, and what is timed is what whoever speaks waits for the recorder.
"""

import argparse
import multiprocessing
import resource
import shutil
import sys
import tempfile
import threading
import time
from array import array
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib.metadata import version
from multiprocessing.connection import Connection
from pathlib import Path

import msgspec
import numpy as np
from rich.console import Console

from grasping_invisible.data.errors import BadRequest
from grasping_invisible.data.log_check import check_log
from grasping_invisible.data.log_commands import wording
from grasping_invisible.data.progress import Advance, bar
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.recorder import Recorder
from grasping_invisible.data.topics import COLOR_IMAGE, Topic
from grasping_invisible.data.worker import prepare_worker
from grasping_invisible.export.bench_output import say, two_columns
from grasping_invisible.export.bench_robot import SCENE, serve
from grasping_invisible.export.machine import machine
from grasping_invisible.runtime.bundle import load_bundle
from grasping_invisible.runtime.bus import Bus
from grasping_invisible.runtime.config import Config, to_toml
from grasping_invisible.runtime.decision import DecisionSettings, Deliberation
from grasping_invisible.runtime.errors import RobotError
from grasping_invisible.runtime.frame import RgbdFrame
from grasping_invisible.runtime.judge import Judgement
from grasping_invisible.runtime.link_settings import LinkSettings
from grasping_invisible.runtime.loop import RunPlan, RunProgress, run_loop
from grasping_invisible.runtime.perception import Perception
from grasping_invisible.runtime.robot_link import ZenohRobot
from grasping_invisible.runtime.run_log import RunFacts, RunLog
from grasping_invisible.sim_robot.scene import load_scene

RUN_ID = "gi-bench"
ENDLESS = 1 << 30  # motions
FRAME_BYTES = 1_000_000  # about what a frame takes on the disk, for a look at the room there is
_STARTING_SECONDS = 600.0  # for the robot's process to have rendered its frames; it takes ten on an idle machine


class RecorderFigures(msgspec.Struct, frozen=True):
    """What `gi-bench recorder` found; waits are of one message being handed to the recorder, in milliseconds.

    `cpu_writer` and `cpu_all`: share of one core taken by the recorder's thread and by the whole runtime.
    """

    seconds: float
    asked_seconds: float
    hz: float
    frames: int
    frames_lost: int  # on the link
    decisions: int
    messages: int
    dropped: int
    wait_p50: float
    wait_p99: float
    wait_max: float
    loop_wait_p99: float
    loop_wait_max: float
    log_bytes: int
    bytes_per_minute: float
    cpu_writer: float
    cpu_all: float
    peak_rss: int
    close_seconds: float
    check: list[str]


def register(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> argparse.ArgumentParser:
    """Add the parser of `recorder`."""
    parser = commands.add_parser(
        "recorder",
        help="drops, waits, bytes and CPU of recording RGB-D images and all else",
        description="Run a whole runtime on a robot that sends RGB-D images of 640 x 480 with a sensor's noise, record "
        "everything, and check the log. Ctrl-C ends it early, with the figures so far.",
    )
    parser.add_argument("--seconds", type=_positive, default=600.0, metavar="S", help="how long (default: 600)")
    parser.add_argument("--hz", type=_positive, default=30.0, metavar="HZ", help="camera rate (default: 30)")
    parser.add_argument("--out", type=Path, metavar="DIR", help="keep the log here (default: a temporary folder)")
    parser.set_defaults(run=run)
    return parser


def run(options: argparse.Namespace) -> int:
    """Record, check, print; 1 when something was dropped or the check found something, 130 after Ctrl-C."""
    computer = machine()
    console = Console(stderr=True)
    with _folder(options.out) as folder:
        _look_for_room(folder, options.hz * options.seconds * FRAME_BYTES)
        run = _Run(folder / f"gi-bench-{time.strftime('%Y%m%d-%H%M%S')}.mcap")
        with console.status("starting the robot, which renders its frames first"):
            robot = _RobotProcess(options.hz)
        try:
            with bar("recording", round(options.seconds), console) as advance:
                interrupted = run.record(robot.endpoint, options.seconds, advance)
        finally:
            robot.close()
        with console.status("checking the log"):
            figures = run.figures(options.seconds, options.hz)
    say("recorder", computer, figures, [two_columns("Recording", _rows(figures))], as_json=options.json)
    if interrupted:
        return 130
    return 1 if figures.dropped or figures.frames_lost or figures.check else 0


@dataclass
class _Waits:
    """A sink that hands everything to the recorder and keeps how long that took, in seconds."""

    recorder: Recorder
    all: array = field(default_factory=lambda: array("d"))
    loop: array = field(default_factory=lambda: array("d"))  # of these, in the thread of the loop
    heard: Counter[str] = field(default_factory=Counter)
    loop_thread: int = field(default_factory=threading.get_ident)

    def __call__(self, topic: Topic, payload: bytes, now_ns: int) -> None:
        before = time.perf_counter()
        self.recorder.put(topic, payload, now_ns)
        waited = time.perf_counter() - before
        self.heard[topic.key] += 1
        self.all.append(waited)
        if threading.get_ident() == self.loop_thread:
            self.loop.append(waited)


class _TimeIsUp(Exception):
    """Ends the loop."""


class _Clock:
    """A watcher of the loop that tells how far it is and ends it when the time has come."""

    def __init__(self, seconds: float, advance: Advance) -> None:
        self._began = time.monotonic()
        self._seconds = seconds
        self._advance = advance
        self._told = 0

    @property
    def elapsed(self) -> float:
        return time.monotonic() - self._began

    def perceived(self, frame: RgbdFrame, perception: Perception, step: int) -> None:
        """See `Watcher`."""
        while self._told < min(self.elapsed, self._seconds) - 1:
            self._told += 1
            self._advance()
        if self.elapsed >= self._seconds:
            raise _TimeIsUp

    def decided(self, frame: RgbdFrame, deliberation: Deliberation) -> None:
        """See `Watcher`."""

    def judged(self, deliberation: Deliberation, outcome: gi.MotionOutcome, judgement: Judgement) -> None:
        """See `Watcher`."""


class _Run:
    """One recorded run and what is measured of it."""

    def __init__(self, path: Path) -> None:
        self._bundle = load_bundle()
        self._recorder = Recorder(path)
        self._waits = _Waits(self._recorder)
        self._progress = RunProgress(ended_because="time is up")
        self._seconds = self._cpu_writer = self._cpu_all = 0.0
        self._lost = 0

    def record(self, endpoint: str, seconds: float, advance: Advance) -> bool:
        """Run the loop for so long; true when Ctrl-C ended it."""
        bus = Bus(sinks=(self._waits,))
        target = load_scene(SCENE).target
        log = RunLog(bus, target)
        log.started(self._facts(target))
        robot = ZenohRobot(endpoint, bus, LinkSettings(), RUN_ID)
        clock = _Clock(seconds, advance)
        cpu_before, interrupted = time.process_time(), False
        try:
            plan = RunPlan(max_motions=ENDLESS)
            run_loop(robot, self._bundle, DecisionSettings(target), plan, (log, clock), self._progress)
        except _TimeIsUp:
            pass
        except KeyboardInterrupt:
            self._progress.ended_because, interrupted = "interrupted", True
        finally:
            self._seconds = clock.elapsed
            self._cpu_all = time.process_time() - cpu_before
            self._cpu_writer = _cpu_seconds("recorder")
            self._lost = robot.lost_messages.get(COLOR_IMAGE.key, 0)
            robot.close()
            log.ended(RUN_ID, self._progress, self._recorder.dropped_messages)
        return interrupted

    def figures(self, asked_seconds: float, hz: float) -> RecorderFigures:
        """Close the log, check it, and sum up."""
        before = time.monotonic()
        self._recorder.close()
        closed = time.monotonic() - before
        if self._recorder.failure is not None:
            raise BadRequest(self._recorder.failure)
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
        waits, loop = np.asarray(self._waits.all) * 1e3, np.asarray(self._waits.loop) * 1e3
        size = self._recorder.path.stat().st_size
        return RecorderFigures(
            seconds=round(self._seconds, 1),
            asked_seconds=asked_seconds,
            hz=hz,
            frames=self._waits.heard[COLOR_IMAGE.key],
            frames_lost=self._lost,
            decisions=len(self._progress.decision_ms),
            messages=len(waits),
            dropped=self._recorder.dropped_messages,
            wait_p50=round(float(np.percentile(waits, 50)), 4),
            wait_p99=round(float(np.percentile(waits, 99)), 4),
            wait_max=round(float(waits.max()), 3),
            loop_wait_p99=round(float(np.percentile(loop, 99)), 4),
            loop_wait_max=round(float(loop.max()), 3),
            log_bytes=size,
            bytes_per_minute=round(60.0 * size / self._seconds),
            cpu_writer=round(self._cpu_writer / self._seconds, 3),
            cpu_all=round(self._cpu_all / self._seconds, 3),
            peak_rss=peak,
            close_seconds=round(closed, 2),
            check=check_log(self._recorder.path).problems,
        )

    def _facts(self, target: str) -> RunFacts:
        return RunFacts(
            run_id=RUN_ID,
            project_version=version("grasping-invisible"),
            bundle_sha256=self._bundle.sha256,
            onnxruntime_version=self._bundle.onnxruntime_version,
            target=target,
            scene=SCENE,
            seed=0,
            max_motions=ENDLESS,
            config_toml=to_toml(Config()),
            robot="gi-bench",
        )


class _RobotProcess:
    """The robot's process, which ends with this one."""

    def __init__(self, hz: float) -> None:
        context = multiprocessing.get_context("spawn")
        pipe, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(hz, theirs), daemon=True)
        self._process.start()
        theirs.close()
        try:
            if not pipe.poll(_STARTING_SECONDS):
                raise RobotError(f"the robot's process is not ready after {_STARTING_SECONDS:g} s")
            self.endpoint: str = pipe.recv()
        except EOFError:
            raise RobotError("the robot's process has ended; what it said is above") from None
        except BaseException:
            self._process.kill()
            raise

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.join()


def _serve(hz: float, pipe: Connection) -> None:
    prepare_worker()
    serve(hz, pipe)


def _cpu_seconds(thread_name: str) -> float:
    """What the thread of that name has taken of a core so far; 0 where it has ended."""
    idents = [thread.ident for thread in threading.enumerate() if thread.name == thread_name]
    return sum(time.clock_gettime(time.pthread_getcpuclockid(ident)) for ident in idents if ident is not None)


@contextmanager
def _folder(kept: Path | None) -> Iterator[Path]:
    if kept is not None:
        kept.mkdir(parents=True, exist_ok=True)
        yield kept
        return
    with tempfile.TemporaryDirectory(prefix="gi-bench-") as folder:
        yield Path(folder)


def _look_for_room(folder: Path, needed: float) -> None:
    free = shutil.disk_usage(folder).free
    if free < 1.2 * needed:
        raise BadRequest(
            f"{folder} has {wording.size(free)} free, and the log may take {wording.size(round(needed))}; "
            "give --out another folder, or fewer --seconds"
        )


def _rows(figures: RecorderFigures) -> list[tuple[str, str]]:
    return [
        ("recorded", f"{figures.seconds:g} s of {figures.asked_seconds:g} s, {figures.messages:,} messages"),
        (
            "camera frames",
            f"{figures.frames:,}, {figures.frames / figures.seconds:.1f} a second of {figures.hz:g}; "
            f"{figures.frames_lost} more lost on the link",
        ),
        ("decisions", f"{figures.decisions}"),
        ("dropped messages", f"{figures.dropped}"),
        (
            "wait for the recorder, any message",
            f"p50 {figures.wait_p50:.3f} ms, p99 {figures.wait_p99:.3f} ms, most {figures.wait_max:.2f} ms",
        ),
        (
            "wait for the recorder, in the loop",
            f"p99 {figures.loop_wait_p99:.3f} ms, most {figures.loop_wait_max:.2f} ms",
        ),
        (
            "log",
            f"{wording.size(figures.log_bytes)}, {wording.size(round(figures.bytes_per_minute))} a minute",
        ),
        ("CPU, share of one core", f"writer {figures.cpu_writer:.0%}, whole runtime {figures.cpu_all:.0%}"),
        ("peak memory of the runtime", wording.size(figures.peak_rss)),
        ("closing the log", f"{figures.close_seconds:.1f} s"),
        ("gi-log check", "; ".join(figures.check) or "complete and consistent"),
    ]


def _positive(text: str) -> float:
    value = float(text)
    if not 0.0 < value < 1e6:
        raise argparse.ArgumentTypeError(f"{text} is not a number above 0")
    return value
