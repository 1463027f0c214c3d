"""Measuring a bundle: many seeded runs of a suite of scenes, by the robot's own loop, beside ground truth."""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import msgspec

from grasping_invisible.data.file_hash import file_sha256
from grasping_invisible.runtime.decision import DecisionSettings
from grasping_invisible.runtime.errors import BadInput, RobotError
from grasping_invisible.runtime.loop import Goal, RunPlan, RunProgress, run_loop
from grasping_invisible.runtime.perception import MIN_TARGET_PIXELS
from grasping_invisible.runtime.run_log import in_file_name
from grasping_invisible.sim_robot.robot import SimRobot
from grasping_invisible.sim_robot.scene import Scene, load_scene, scene_names
from grasping_invisible.training.evaluation_log import logged_run
from grasping_invisible.training.evaluation_methods import Method
from grasping_invisible.training.worker import loaded_bundle, simulating

SUITES = ("exploration", "coordination", "invisible")
SEEDS_APART = 1000  # between the first seeds of two evaluations, and so their most runs of a scene: no run is in both


@dataclass(frozen=True)
class Trial:
    """One run to make: a scene's name or file, its own name, a seed, what counts, and how many motions it may take.

    `task_sha256`: of all of that but names and seed, and of what the scene holds; see `task_sha256_of`.
    """

    scene: str
    name: str
    seed: int
    goal: Goal
    max_motions: int
    task_sha256: str | None = None


class TrialResult(msgspec.Struct, frozen=True):
    """What came of a run.

    `judged`: the runtime thinks that its goal is reached; an exploration ends when the segmenter sees the target.
    `success`: the same, and for a grasp ground truth agrees. `found_truth`: by ground truth the target is in view at
    the end, or held.
    `target_left`: the run ended because the target had left the workspace. `failure`: why it was cut short, if it was.
    """

    scene: str
    seed: int
    success: bool
    judged: bool
    found: bool
    found_truth: bool
    motions: int
    max_motions: int
    decision_ms: tuple[float, ...]
    failure: str | None = None
    target_left: bool = False

    @property
    def motions_counted(self) -> int:
        """All that were allowed where the target left the workspace, which fails as surely as spending them."""
        return self.max_motions if self.target_left else self.motions


def trials_of(suite: str, runs: int, seed: int) -> list[Trial]:
    """The runs of a suite, `runs` of each scene, or of a scene file, or of all in a folder. Raises `BadInput`."""
    if runs > SEEDS_APART:
        raise BadInput(f"--runs must be at most {SEEDS_APART}, not {runs}: the next --seed begins there")
    trials = []
    sources: dict[str, str] = {}
    for source in _sources_of(suite):
        scene = load_scene(source)
        # Results and logs tell scenes apart by their names.
        if sources.setdefault(scene.name, source) != source:
            raise BadInput(f"{sources[scene.name]} and {source} both hold a scene named {scene.name!r}; rename one")
        finding = scene.task == "exploration" and suite != "invisible"
        goal = Goal.FIND if finding else Goal.GRASP
        motions = scene.motions_to_grasp if suite == "invisible" else scene.max_motions
        task = task_sha256_of(scene, goal, motions)
        first = seed * SEEDS_APART
        trials += [Trial(source, scene.name, run_seed, goal, motions, task) for run_seed in range(first, first + runs)]
    return trials


def task_sha256_of(scene: Scene, goal: Goal, max_motions: int) -> str:
    """A hash of what all runs of a scene have in common: target, objects, meshes by what is in them, goal, motions.

    Raises `BadInput` for a mesh that cannot be read.
    """
    objects = [msgspec.structs.replace(item, mesh=item.mesh and _mesh_sha256(item.mesh)) for item in scene.objects]
    return hashlib.sha256(msgspec.json.encode((scene.target, objects, goal.name, max_motions))).hexdigest()


def _mesh_sha256(mesh: str) -> str:
    try:
        return file_sha256(Path(mesh))
    except (OSError, ValueError) as error:
        raise BadInput(f"mesh {mesh} cannot be read: {error}") from None


def _sources_of(suite: str) -> list[str]:
    """Names of shipped scenes, or scene files."""
    if suite in SUITES:
        task = "exploration" if suite == "invisible" else suite
        return [name for name in scene_names() if name.startswith(task)]
    if Path(suite).is_file():
        return [suite]
    if not Path(suite).is_dir():
        raise BadInput(f"unknown suite {suite!r}; known: {', '.join(SUITES)}, or a scene file or a folder of them")
    files = sorted(str(path) for path in Path(suite).glob("*.toml"))
    if not files:
        raise BadInput(f"suite {suite} holds no scene files (*.toml)")
    return files


def run_trials(
    trials: Sequence[Trial], models: Path | None, method: Method, workers: int, log_dir: Path | None = None
) -> Iterator[TrialResult]:
    """Make the runs in `workers` processes; yields each result when it is there, in no particular order.

    `log_dir`: where each run leaves a log, if anywhere; see `name_log`. Raises `RobotError` where a process dies.
    """
    run = partial(_run_into, models=models, method=method, log_dir=log_dir)
    with simulating(workers) as run_all:
        yield from run_all(run, trials)


def name_log(folder: Path, result: TrialResult) -> None:
    """Give a run's log its name, once the result is kept: one of that name is never of a run to be made again."""
    log = log_path(folder, result.scene, result.seed)
    _unfinished(log).rename(log)


def log_path(folder: Path, scene: str, seed: int) -> Path:
    """Where a run leaves its log."""
    return folder / f"{in_file_name(scene)}-{seed}.mcap"


def _unfinished(log: Path) -> Path:
    return log.with_suffix(".partial")


def _run_into(trial: Trial, models: Path | None, method: Method, log_dir: Path | None) -> TrialResult:
    log = None
    if log_dir is not None:
        log = _unfinished(log_path(log_dir, trial.name, trial.seed))
        log.unlink(missing_ok=True)  # an interrupted evaluation may have left it
    return run_trial(trial, models, method, log)


def run_trial(trial: Trial, models: Path | None, method: Method, log: Path | None = None) -> TrialResult:
    """Make one run in this process. `log`: a new file for its log. Raises `RecordingError` where there is one."""
    bundle = loaded_bundle(models)
    scene = load_scene(trial.scene)
    robot = SimRobot(scene, trial.seed)
    progress, failure = RunProgress(), None
    settings = DecisionSettings(scene.target, robot.workspace, method.exploration, method.coordination)
    plan = RunPlan(seed=trial.seed, max_motions=trial.max_motions, goal=trial.goal)
    try:
        if log is None:
            run_loop(robot, bundle, settings, plan, (), progress)
        else:
            with logged_run(log, robot, bundle, method, plan, progress) as (spoken, watcher):
                run_loop(spoken, bundle, settings, plan, (watcher,), progress)
    except RobotError as error:
        failure = str(error)
    finally:
        truth = robot.truth()
        robot.close()
    targets = {item.name: item.visible_pixels for item in truth.objects if item.color == scene.target}
    held = truth.held_object in targets
    judged = progress.found if trial.goal is Goal.FIND else progress.grasped
    return TrialResult(
        scene=scene.name,
        seed=trial.seed,
        success=judged and (trial.goal is Goal.FIND or held),
        judged=judged,
        found=progress.found,
        found_truth=held or sum(targets.values()) >= MIN_TARGET_PIXELS,
        motions=progress.motions,
        max_motions=trial.max_motions,
        decision_ms=tuple(progress.decision_ms),
        failure=failure,
        target_left=progress.target_left,
    )
