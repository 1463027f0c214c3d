"""The log of an evaluated run: like that of a run of `gi-runtime`, but for the pictures while the arm moves."""

from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path

from grasping_invisible.data.recorder import Recorder
from grasping_invisible.runtime.bundle import ModelBundle
from grasping_invisible.runtime.bus import Bus
from grasping_invisible.runtime.config import Config, PolicySettings, to_toml
from grasping_invisible.runtime.errors import GraspingError
from grasping_invisible.runtime.frame import RgbdFrame
from grasping_invisible.runtime.frame_sets import FrameParts
from grasping_invisible.runtime.loop import RunPlan, RunProgress, Watcher
from grasping_invisible.runtime.robot import Robot
from grasping_invisible.runtime.run_log import RunFacts, RunLog
from grasping_invisible.sim_robot.robot import SimRobot
from grasping_invisible.training.evaluation_methods import Method
from grasping_invisible.training.experience_log import SpokenRobot


class FilmedRobot(SpokenRobot):
    """A simulated robot in this process that also says what its camera sees, whenever it is asked to look."""

    def observe(self) -> RgbdFrame:
        """What a runtime on the link would get of the frame: its messages, decoded."""
        frame = super().observe()
        parts = FrameParts.of(frame, self._robot.transforms(frame.stamp_ns))
        for topic, message in parts.messages.items():
            self._bus.publish(topic, message)
        return parts.decode()


@contextmanager
def logged_run(
    path: Path, robot: SimRobot, bundle: ModelBundle, method: Method, plan: RunPlan, progress: RunProgress
) -> Iterator[tuple[Robot, Watcher]]:
    """A robot and a watcher that leave the log of a run at `path`.

    Raises `RecordingError` where a log is there already, and `OSError` where this one cannot be written.
    """
    recorder = Recorder(path)
    bus = Bus(sinks=(recorder,))
    scene = robot.scene
    facts = RunFacts(
        run_id=path.stem,
        project_version=version("grasping-invisible"),
        bundle_sha256=bundle.sha256,
        onnxruntime_version=bundle.onnxruntime_version,
        target=scene.target,
        scene=scene.name,
        seed=plan.seed,
        max_motions=plan.max_motions,
        config_toml=to_toml(Config(policy=PolicySettings(method.exploration, method.coordination))),
        robot="simulated in this process",
    )
    recorder.add_metadata("run", {key: str(value) for key, value in vars(facts).items()})
    log = RunLog(bus, scene.target)
    log.started(facts)
    try:
        yield FilmedRobot(robot, bus), log
    except GraspingError as error:
        progress.ended_because = str(error)
        raise
    finally:
        log.ended(facts.run_id, progress, recorder.dropped_messages)
        recorder.close()
        if recorder.failure is not None:
            raise OSError(recorder.failure)
