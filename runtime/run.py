"""One run of `gi-runtime`, from its request to its exit code: start everything, loop, sum up, end everything."""

import sys
import uuid
from contextlib import ExitStack
from dataclasses import dataclass
from datetime import datetime
from importlib.metadata import version

import msgspec

from grasping_invisible.data.errors import RecordingError
from grasping_invisible.data.recorder import LOST, Recorder
from grasping_invisible.data.run_names import UNKNOWN_SCENE
from grasping_invisible.data.stream import write_line
from grasping_invisible.runtime.bundle import ModelBundle, load_bundle
from grasping_invisible.runtime.bus import Bus
from grasping_invisible.runtime.config import to_toml
from grasping_invisible.runtime.console import RunConsole
from grasping_invisible.runtime.decision import DecisionSettings
from grasping_invisible.runtime.errors import (
    EXIT_GRASPED,
    EXIT_NOT_GRASPED,
    BadInput,
    GraspingError,
    LinkError,
)
from grasping_invisible.runtime.interruption import interruptions_held
from grasping_invisible.runtime.loop import RunPlan, RunProgress, run_loop
from grasping_invisible.runtime.recording_watch import RecordingWatch
from grasping_invisible.runtime.request import RunRequest
from grasping_invisible.runtime.robot_link import ZenohRobot
from grasping_invisible.runtime.run_log import RunFacts, RunLog, in_file_name
from grasping_invisible.runtime.sim_process import SimAnnouncement, SimProcess
from grasping_invisible.runtime.timing import percentile

DEFAULT_MAX_MOTIONS = 15
Point = tuple[float, float, float]


@dataclass(frozen=True)
class _Task:
    """What is to be done, with all defaults settled."""

    endpoint: str
    scene: str
    target: str
    max_motions: int


def carry_out_run(request: RunRequest) -> int:
    """Run, and sum up. Raises `GraspingError` or `KeyboardInterrupt`; all that was started has ended by then."""
    with ExitStack() as stack:
        sim = _start_simulator(request, stack)
        bundle = load_bundle(request.models, request.config.models.threads)  # while the simulator starts
        task = _task(request, sim.wait_until_ready() if sim else None)
        settings = DecisionSettings(
            task.target,
            request.config.workspace.workspace(),
            request.config.policy.exploration,
            request.config.policy.coordination,
        )
        run = _Run(request, task, bundle, sim, stack)
        return run.carry_out(settings)


def _start_simulator(request: RunRequest, stack: ExitStack) -> SimProcess | None:
    if request.locator is not None:
        return None
    with interruptions_held():  # or a signal could come between the child's start and anyone's knowing of it
        sim = SimProcess(request.scene, request.seed, request.config.link.start_seconds)
        stack.callback(sim.close)
    return sim


def _task(request: RunRequest, announced: SimAnnouncement | None) -> _Task:
    if announced is not None:
        _check_center(request.config.workspace.center, announced.workspace_center)
        _check_target(request.target, announced)
        return _Task(
            announced.endpoint,
            announced.scene,
            request.target or announced.target,
            request.max_motions or announced.max_motions,
        )
    assert request.locator is not None  # or a simulator would have announced itself
    assert request.target is not None  # the command line asks for it
    return _Task(request.locator, UNKNOWN_SCENE, request.target, request.max_motions or DEFAULT_MAX_MOTIONS)


def _check_center(wanted: Point, simulated: Point) -> None:
    """The simulator builds its table in one place, and would refuse most motions meant for another."""
    if wanted != simulated:
        raise BadInput(
            f"[workspace] center is {list(wanted)} in the config, but the simulator's is {list(simulated)}; "
            "leave it out with --robot sim"
        )


def _check_target(wanted: str | None, announced: SimAnnouncement) -> None:
    """What is simulated is known: nobody need search in vain for what it does not hold."""
    if wanted is not None and wanted not in announced.colors:
        raise BadInput(f"scene {announced.scene} holds nothing {wanted}; --target can be {', '.join(announced.colors)}")


class _Run:
    """A run that has its log open, until `carry_out` returns or raises; or is cut short, until `stack` unwinds."""

    def __init__(
        self, request: RunRequest, task: _Task, bundle: ModelBundle, sim: SimProcess | None, stack: ExitStack
    ) -> None:
        self._request = request
        self._task = task
        self._bundle = bundle
        self._sim = sim
        self._run_id = uuid.uuid4().hex
        self._progress = RunProgress()
        self._lost: dict[str, int] = {}
        self._recorder = stack.enter_context(self._open_log())
        self._bus = Bus(sinks=(self._recorder,))
        self._console = RunConsole(sys.stderr if request.json else sys.stdout, self._bus)
        self._log = RunLog(self._bus, task.target)

    def carry_out(self, settings: DecisionSettings) -> int:
        request, task = self._request, self._task
        try:
            self._say_start()
            robot = ZenohRobot(task.endpoint, self._bus, request.config.link, self._run_id)
            try:
                plan = RunPlan(request.seed, task.max_motions, limits=request.config.safety)
                watchers = self._console, RecordingWatch(self._recorder, self._console), self._log
                run_loop(robot, self._bundle, settings, plan, watchers, self._progress)
            finally:
                robot.close()
                self._lost = robot.lost_messages
        except KeyboardInterrupt:
            self._progress.ended_because = "interrupted"
            raise
        except LinkError as error:
            words = "" if self._sim is None else self._sim.last_words()
            told = LinkError(f"{error}; the simulator's last words: {words}") if words else error
            self._progress.ended_because = str(told)
            raise told from None
        except GraspingError as error:
            self._progress.ended_because = str(error)
            raise
        finally:
            self._end()
        return EXIT_GRASPED if self._progress.grasped else EXIT_NOT_GRASPED

    def _open_log(self) -> Recorder:
        started = datetime.now().strftime("%Y%m%d-%H%M%S")
        scene = in_file_name(self._task.scene)
        name = f"{started}-{scene}-{self._task.target}-{self._request.seed}-{self._run_id[:6]}.mcap"
        try:
            return Recorder(self._request.log_dir / name, self._request.config.recording)
        except RecordingError as error:
            raise BadInput(str(error)) from error

    def _say_start(self) -> None:
        request, task = self._request, self._task
        facts = RunFacts(
            run_id=self._run_id,
            project_version=version("grasping-invisible"),
            bundle_sha256=self._bundle.sha256,
            onnxruntime_version=self._bundle.onnxruntime_version,
            target=task.target,
            scene=task.scene,
            seed=request.seed,
            max_motions=task.max_motions,
            config_toml=to_toml(request.config),
            robot=request.locator or "sim",
        )
        self._recorder.add_metadata("run", {key: str(value) for key, value in vars(facts).items()})
        self._log.started(facts)
        self._console.say(
            f"find and grasp {task.target} in {task.scene}, seed {request.seed}, at most {task.max_motions} motions"
        )

    def _end(self) -> None:
        """Sum up for the log, a person and a program, and close the log."""
        progress = self._progress
        lost = sum(self._lost.values())
        self._recorder.add_metadata(LOST, {topic: str(count) for topic, count in sorted(self._lost.items())})
        self._log.ended(self._run_id, progress, self._recorder.dropped_messages, lost)
        verdict = "grasped" if progress.grasped else "not grasped" if progress.found else "not found"
        self._console.say(f"{self._task.target} {verdict} after {progress.motions} motions ({progress.ended_because})")
        if progress.target_left:
            self._console.say(f"{self._task.target} lies outside the workspace now: put it back before the next run")
        if lost:
            self._console.say(f"{lost} messages of the robot were lost on the link, such as camera frames")
        self._console.say(f"log: {self._recorder.path}")
        self._recorder.close()
        if self._recorder.failure is not None:
            write_line(f"gi-runtime: {self._recorder.failure}", sys.stderr)
        if self._request.json:
            write_line(msgspec.json.encode(self._summary()).decode(), sys.stdout)

    def _summary(self) -> dict[str, object]:
        progress = self._progress
        return {
            "grasped": progress.grasped,
            "found": progress.found,
            "motions": progress.motions,
            "ended_because": progress.ended_because,
            "target": self._task.target,
            "scene": self._task.scene,
            "seed": self._request.seed,
            "log": str(self._recorder.path),
            "decision_ms": {
                "p50": round(percentile(progress.decision_ms, 50), 3),
                "p99": round(percentile(progress.decision_ms, 99), 3),
            },
        }
