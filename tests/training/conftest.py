"""Results and steps of runs that nobody made."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from grasping_invisible.data.classes import CLASSES
from grasping_invisible.data.heightmap_message import HeightmapArrays, encode_heightmaps
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.steps import LoggedStep
from grasping_invisible.runtime.config import Config, to_toml
from grasping_invisible.runtime.workspace import Workspace
from grasping_invisible.training.evaluation import TrialResult
from grasping_invisible.training.failed_runs import Run, method_of
from grasping_invisible.training.stored_results import Measured, ResultsFile

ResultOf = Callable[..., TrialResult]


@pytest.fixture
def result_of() -> ResultOf:
    def build(scene: str, seed: int, success: bool, motions: int, found_truth: bool = True) -> TrialResult:
        return TrialResult(scene, seed, success, success, True, found_truth, motions, 5, (10.0,))

    return build


@pytest.fixture
def results_file(tmp_path: Path) -> Callable[..., Path]:
    """Writes a file of results of one method."""

    def write(
        suite: str,
        method: str,
        results: list[TrialResult],
        name: str | None = None,
        bundle: str = "b",
        task_sha256: str | None = None,
    ) -> Path:
        path = tmp_path / "results" / f"{suite}-{name or method}-{bundle}.jsonl"
        path.unlink(missing_ok=True)
        with ResultsFile(path, Measured(suite, method, name or method, bundle * 64)) as file:
            for result in results:
                file.add(result, task_sha256)
        return path

    return write


class StepMaker:
    """Makes logged steps of a run after red, each with what matters, on the table of `maps`."""

    def __init__(self) -> None:
        self.start = gi.RunStart(
            run_id="r",
            target_color="red",
            scene="exploration-00",
            seed=4,
            max_motions=15,
            config_toml=to_toml(Config()),
        )
        self.walled = True
        self.path = Path("run.mcap")

    def maps(self, step: int, target_cells: int, walled: bool = True) -> gi.Heightmaps:
        """A grey heap, or none, with so many of the target's cells in the middle of it."""
        workspace = Workspace()
        height = np.zeros((workspace.cells,) * 2, np.float32)
        labels = np.zeros(height.shape, np.uint8)
        if self.walled and walled:
            height[62:162, 62:162] = 0.05
        side = math.isqrt(target_cells)
        labels[112 : 112 + side, 112 : 112 + side] = CLASSES.index("red")
        height[112 : 112 + side, 112 : 112 + side] = 0.05
        color = np.full((*height.shape, 3), 120, np.uint8)
        return encode_heightmaps(
            HeightmapArrays(step + 1, step, color, height, labels, workspace.resolution, workspace.center)
        )

    def truth(self, visible: int, x: float = 0.53, y: float = 0.0, z: float = 0.03, held: str = "") -> gi.TruthState:
        """Ground truth with a red cube at a place of the base frame."""
        cube = gi.ObjectTruth(name="cube", color="red", position=gi.Point(x=x, y=y, z=z), visible_pixels=visible)
        other = gi.ObjectTruth(name="other", color="grey", position=gi.Point(x=0.5, y=0.1, z=0.03))
        return gi.TruthState(objects=[cube, other], held_object=held, target_color="red")

    def step(
        self,
        kind: gi.MotionKind,
        *,
        seen: bool = True,
        pixels: int | None = None,
        status: gi.MotionStatus = gi.COMPLETED,
        holding: bool = False,
        target_grasped: bool = False,
        changed: bool = True,
        seen_after: bool = True,
        freed: bool = False,
        truth: gi.TruthState | None = None,
        after: gi.TruthState | None = None,
    ) -> LoggedStep:
        """One motion and what came of it."""
        shown = 500 if seen else 0
        return LoggedStep(
            decision=gi.Decision(
                policy="coordinator" if seen else "explorer",
                kind=kind,
                target_pixels=shown if pixels is None else pixels,
            ),
            start=self.start,
            heightmaps=self.maps(0, 400 if seen else 0),
            outcome=gi.MotionOutcome(status=status, holding=holding),
            result=gi.StepResult(
                status=status,
                scene_changed=changed,
                target_visible=seen_after,
                object_grasped=holding,
                target_grasped=target_grasped,
            ),
            truth=truth or self.truth(shown),
            next_heightmaps=self.maps(1, 400 if seen_after else 0, walled=not freed),
            next_truth=after or self.truth(500 if seen_after else 0),
        )

    def run(self, *made: LoggedStep, ended: str | None = "budget") -> Run:
        """A run of such steps."""
        summary = None if ended is None else gi.RunSummary(run_id="r", ended_because=ended, motions=len(made))
        return Run(self.path, self.start, method_of(self.start), made, summary)


@pytest.fixture
def steps() -> StepMaker:
    return StepMaker()
