"""Why runs failed: one cause each, by rules, from their logs and ground truth."""

from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path

from grasping_invisible.data.clock import to_ns
from grasping_invisible.data.log_reader import read_messages
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.run_names import BUDGET, FOUND, GRASPED, OUTSIDE
from grasping_invisible.data.steps import LoggedStep, steps
from grasping_invisible.data.topics import RUN_START, RUN_SUMMARY
from grasping_invisible.runtime.config import parse_config
from grasping_invisible.runtime.perception import MIN_TARGET_PIXELS
from grasping_invisible.runtime.workspace import Workspace
from grasping_invisible.sim_robot.scene import load_scene, scene_names
from grasping_invisible.training.failed_motions import Fault, fault_of, saw_target, targets, truly_visible

LAST_MOTIONS = 2  # a target that is first seen with no more than these left was found too late
FALLEN = -0.02  # metres; an object lower than this is off the table


class Cause(Enum):
    """What a whole run failed of; where none of these holds, it is the most frequent `Fault` of its motions."""

    ROBOT = "the robot, the link or the physics failed"
    MISJUDGED = "what was in the gripper was judged wrongly"
    GONE = "the target left the workspace"
    GIVEN_UP = "the target was taken to have left the workspace"
    COVERED = "the target was seen from the side alone, under something else"
    NOT_SEGMENTED = "the target was in view and never recognised"
    NEVER_UNCOVERED = "the target was never uncovered"
    MISTAKEN = "something else was taken for the target"
    LATE = "the target was found too late"
    BUDGET = "every motion helped, and they were too few"


@dataclass(frozen=True)
class Run:
    """A run as logged. `method`: how it searched and how it coordinated.

    `summary`: None where the log ends before the run. `damaged`: the log is.
    """

    path: Path
    start: gi.RunStart
    method: str
    steps: tuple[LoggedStep, ...]
    summary: gi.RunSummary | None
    damaged: bool = False

    @property
    def key(self) -> tuple[str, int]:
        """What copies of a run have in common; evaluations call runs by scene and seed alone."""
        return self.start.run_id, to_ns(self.start.stamp)

    @property
    def wholeness(self) -> tuple[bool, bool, int]:
        """Of two copies of a run the greater one holds more of it."""
        return not self.damaged, self.summary is not None, len(self.steps)

    @property
    def last_truth(self) -> gi.TruthState | None:
        """Where everything is at the end."""
        return self.steps[-1].next_truth if self.steps else None

    @property
    def suite(self) -> str:
        """The suite that its scene and its allowance belong to; the scene's own name for other scenes."""
        if self.start.scene not in scene_names():
            return self.start.scene
        scene = load_scene(self.start.scene)
        for_all_of_it = scene.task == "exploration" and self.start.max_motions > scene.max_motions
        return "invisible" if for_all_of_it else scene.task


@dataclass(frozen=True)
class Failure:
    """A failed run, why, and the step that shows it best, if the log holds one. `faults`: of all its motions."""

    run: Run
    cause: Cause | Fault
    step: LoggedStep | None
    faults: tuple[Fault, ...] = ()


def read_runs(path: Path, damage: list[str] | None = None) -> Iterator[Run]:
    """The runs of a log, without Q maps, which say nothing here and weigh most.

    `damage`, if given, takes a line for everything wrong, before the first run. Raises `BadLog`, and `BadInput` where
    this version cannot read a run's configuration.
    """
    damage = [] if damage is None else damage
    starts: dict[str, gi.RunStart] = {}
    summaries: dict[str, gi.RunSummary] = {}
    for logged in read_messages(path, (RUN_START.key, RUN_SUMMARY.key)):
        if isinstance(logged.message, gi.RunStart):
            starts[logged.message.run_id] = logged.message
        elif isinstance(logged.message, gi.RunSummary):
            summaries[logged.message.run_id] = logged.message
    of_run: dict[str, list[LoggedStep]] = defaultdict(list)
    for step in steps(path, damage=damage):
        if step.start is not None:
            of_run[step.start.run_id].append(replace(step, q_maps=None))
    for run_id, start in starts.items():
        yield Run(path, start, method_of(start), tuple(of_run[run_id]), summaries.get(run_id), bool(damage))


def method_of(start: gi.RunStart) -> str:
    """How a run searched and how it coordinated. Raises `BadInput` where its configuration cannot be read."""
    policy = parse_config(start.config_toml, f"the configuration of run {start.run_id}").policy
    return f"{policy.exploration}, {policy.coordination}"


def failure_of(run: Run) -> Failure | None:
    """Why a run failed; None where it did not. Raises `BadMessage` where an image that tells is damaged.

    The cause is the first of these that holds:

    It ended otherwise than by success, its allowance or a target that left the workspace. What it held was judged
    wrongly. The target is outside at the end, or was taken to be. It was never seen from above: only in the camera's
    picture, or not even there though ground truth shows it, or nowhere. At half of the decisions for it or more it was
    truly out of sight. It was first seen with `LAST_MOTIONS` or fewer left. Otherwise the most frequent fault of the
    motions since it was first seen, the latest of equal ones.
    """
    failure = _failure_of(run)
    if failure is None:
        return None
    return replace(failure, faults=tuple(fault for step in run.steps if (fault := fault_of(step)) is not None))


def _failure_of(run: Run) -> Failure | None:
    summary, last = run.summary, run.steps[-1] if run.steps else None
    if summary is None or summary.ended_because not in (GRASPED, FOUND, OUTSIDE, BUDGET):
        return Failure(run, Cause.ROBOT, last)
    misjudged = _misjudged(run)
    if misjudged is not None:
        return Failure(run, Cause.MISJUDGED, misjudged)
    if summary.ended_because not in (OUTSIDE, BUDGET):
        return None
    if run.last_truth is not None and all(_is_outside(item) for item in targets(run.last_truth, run.start)):
        return Failure(run, Cause.GONE, _left_at(run))
    if summary.ended_because == OUTSIDE:
        return Failure(run, Cause.GONE if run.last_truth is None else Cause.GIVEN_UP, last)
    return _failure_of_search(run) or _failure_of_motions(run)


def _failure_of_search(run: Run) -> Failure | None:
    last = run.steps[-1] if run.steps else None
    found = _first_seen(run)
    if found is None:
        for cause, shown in (
            (Cause.COVERED, [step.decision.target_pixels for step in run.steps]),
            (Cause.NOT_SEGMENTED, [truly_visible(step) or 0 for step in run.steps]),
        ):
            if max(shown, default=0) >= MIN_TARGET_PIXELS:
                return Failure(run, cause, run.steps[shown.index(max(shown))])
        return Failure(run, Cause.NEVER_UNCOVERED, last)
    decided = [step for step in run.steps if saw_target(step)]
    mistaken = [step for step in decided if _is_out_of_sight(step)]
    if mistaken and 2 * len(mistaken) >= len(decided):
        return Failure(run, Cause.MISTAKEN, mistaken[0])
    if run.start.max_motions - found <= LAST_MOTIONS < run.start.max_motions:
        return Failure(run, Cause.LATE, last)
    return None


def _failure_of_motions(run: Run) -> Failure:
    found = _first_seen(run) or 0
    faults = [(fault, step) for step in run.steps[found:] if (fault := fault_of(step)) is not None]
    if not faults:
        return Failure(run, Cause.BUDGET, run.steps[-1] if run.steps else None)
    counts = Counter(fault for fault, _ in faults)
    fault, step = max(enumerate(faults), key=lambda entry: (counts[entry[1][0]], entry[0]))[1]
    return Failure(run, fault, step)


def _first_seen(run: Run) -> int | None:
    """How many motions had been made when the runtime first saw the target; None: it never did."""
    for index, step in enumerate(run.steps):
        if saw_target(step):
            return index
        if step.result is not None and step.result.target_visible:
            return index + 1
    return None


def _misjudged(run: Run) -> LoggedStep | None:
    """The step after which something else was taken for the grasped target, or the target was thrown away."""
    for step in run.steps:
        result, truth = step.result, step.next_truth
        if result is None or truth is None or not result.object_grasped:
            continue
        names = {item.name for item in targets(truth, run.start)}
        if result.target_grasped and truth.held_object not in names:
            return step
        if not result.target_grasped and any(_is_newly_outside(step, name) for name in names):
            return step
    return None


def _left_at(run: Run) -> LoggedStep | None:
    """The last step in which a target left the workspace."""
    for step in reversed(run.steps):
        there = [] if step.next_truth is None else targets(step.next_truth, run.start)
        if any(_is_newly_outside(step, item.name) for item in there):
            return step
    return None


def _is_newly_outside(step: LoggedStep, name: str) -> bool:
    if step.truth is None or step.next_truth is None:
        return False
    before, after = ({item.name: item for item in truth.objects} for truth in (step.truth, step.next_truth))
    return name in before and name in after and not _is_outside(before[name]) and _is_outside(after[name])


def _is_outside(item: gi.ObjectTruth) -> bool:
    position = item.position
    return not Workspace().contains(position.x, position.y) or position.z < FALLEN


def _is_out_of_sight(step: LoggedStep) -> bool:
    visible = truly_visible(step)
    return visible is not None and visible < MIN_TARGET_PIXELS / 2
