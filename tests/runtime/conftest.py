"""Small worlds made by hand: tables with blocks as heightmaps, and a robot with a red block under a grey cover."""

import socket
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from google.protobuf.message import Message
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import ACTION_CELLS, PUSH_LEVELS, ROTATIONS
from grasping_invisible.data.classes import CLASSES
from grasping_invisible.data.clock import to_timestamp
from grasping_invisible.data.images import CAMERA_FRAME
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.recorder import Recorder, RecordingSettings
from grasping_invisible.data.topics import (
    COMMAND,
    OUTCOME,
    Topic,
)
from grasping_invisible.data.transform_message import encode_transforms
from grasping_invisible.runtime.bus import Bus
from grasping_invisible.runtime.config import Config, to_toml
from grasping_invisible.runtime.critic import QMaps
from grasping_invisible.runtime.decision import DecisionSettings
from grasping_invisible.runtime.decision_record import Decision
from grasping_invisible.runtime.frame import Camera, RgbdFrame
from grasping_invisible.runtime.frame_sets import FrameParts
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.loop import RunPlan, run_loop
from grasping_invisible.runtime.memory import Memory
from grasping_invisible.runtime.perception import Perception
from grasping_invisible.runtime.rotation import action_grid
from grasping_invisible.runtime.run_log import RunFacts, RunLog
from grasping_invisible.runtime.situation import Situation, situation_of
from grasping_invisible.runtime.workspace import Workspace

Block = tuple[float, float, float, float, str]  # x, y of its middle, side, top: metres; colour
TableWith = Callable[..., Heightmaps]

TABLE, COVER, TARGET = (240, 236, 230), (158, 154, 144), (222, 36, 30)
CAMERA_HEIGHT = 0.8
# Straight above the workspace's centre, image x along base -y, image y along base -x.
CAMERA = Camera(
    320,
    240,
    np.array([[300.0, 0, 159.5], [0, 300.0, 119.5], [0, 0, 1]]),
    np.array([[0.0, -1, 0, 0.53], [-1, 0, 0, 0], [0, 0, -1, CAMERA_HEIGHT], [0, 0, 0, 1]]),
)


class TableRobot:
    """A robot whose first push uncovers the target and whose grasps take what lies under the fingers."""

    def __init__(self) -> None:
        self.covered = True
        self.target_there = True
        self.holding = False
        self.knocked_out = False
        self.grasps_fail = 0
        self.failed_grasps_knock_it_out = False  # of the workspace
        self.decoy_first = False
        self.commands: list[gi.MotionCommand] = []
        self.stopped: list[str] = []
        self.status: gi.MotionStatus = gi.COMPLETED

    def observe(self) -> RgbdFrame:
        color = np.full((CAMERA.height, CAMERA.width, 3), TABLE, np.uint8)
        depth = np.full((CAMERA.height, CAMERA.width), CAMERA_HEIGHT, np.float32)
        if self.target_there:
            columns = slice(270, 290) if self.knocked_out else slice(150, 170)  # the workspace ends at column 245
            color[110:130, columns], depth[110:130, columns] = TARGET, CAMERA_HEIGHT - 0.05
        cover = slice(95, 145) if self.covered else slice(150, 200)
        color[cover, 135:185], depth[cover, 135:185] = COVER, CAMERA_HEIGHT - 0.08
        return RgbdFrame(time.time_ns(), color, depth, CAMERA)

    def execute(self, command: gi.MotionCommand) -> gi.MotionOutcome:
        self.commands.append(command)
        if command.kind == gi.PUSH:
            self.covered = False
        elif command.kind == gi.PLACE:
            self.holding = False
        elif command.kind == gi.GRASP:
            self._grasp()
        now = to_timestamp(time.time_ns())
        return gi.MotionOutcome(
            command_id=command.id, started=now, ended=now, status=self.status, detail="done", holding=self.holding
        )

    def _grasp(self) -> None:
        if self.decoy_first:
            self.decoy_first, self.holding = False, True  # something, but the target stays where it is
        elif self.grasps_fail:
            self.grasps_fail -= 1
            self.knocked_out = self.failed_grasps_knock_it_out
        else:
            self.holding, self.target_there = True, False

    def stop(self, reason: str) -> None:
        self.stopped.append(reason)

    def close(self) -> None:
        pass


class ColorModels:
    """Red is class 1; a grasp is good where the target is; a push is good everywhere."""

    def segment(self, color: NDArray[np.uint8]) -> NDArray[np.uint8]:
        return (color == np.array(TARGET)).all(axis=2).astype(np.uint8)

    def q_maps(self, maps: Heightmaps, mask: NDArray[np.bool_]) -> QMaps:
        cells = mask.reshape(ACTION_CELLS, 2, ACTION_CELLS, 2).max(axis=(1, 3))
        grasp = np.tile(cells, (ROTATIONS, 1, 1)).astype(np.float32)
        return QMaps(push=np.full((len(PUSH_LEVELS), *grasp.shape), 0.3, np.float32), grasp=grasp)

    def grasp_probability(self, features: NDArray[np.float32]) -> float:
        return 0.9


class SetModels:
    """Says what it is set to, whatever it is asked, and keeps what it was asked."""

    def __init__(self) -> None:
        shape = (ROTATIONS, ACTION_CELLS, ACTION_CELLS)
        self.q = QMaps(np.zeros((len(PUSH_LEVELS), *shape), np.float32), np.zeros(shape, np.float32))
        self.probability = 0.5
        self.masks: list[NDArray[np.bool_]] = []
        self.features: list[NDArray[np.float32]] = []

    def segment(self, color: NDArray[np.uint8]) -> NDArray[np.uint8]:
        return np.zeros(color.shape[:2], np.uint8)

    def q_maps(self, maps: Heightmaps, mask: NDArray[np.bool_]) -> QMaps:
        self.masks.append(mask)
        return self.q

    def grasp_probability(self, features: NDArray[np.float32]) -> float:
        self.features.append(features)
        return self.probability


class RecordedRobot(TableRobot):
    """Like a robot on the link: what the runtime sees is what travelled, and that is recorded."""

    def __init__(self, record: Callable[[Topic, Message], object]) -> None:
        super().__init__()
        self._record = record

    def observe(self) -> RgbdFrame:
        frame = super().observe()
        transforms = encode_transforms({CAMERA_FRAME: frame.camera.base_from_camera}, frame.stamp_ns)
        parts = FrameParts.of(frame, transforms)
        for topic, message in parts.messages.items():
            self._record(topic, message)
        return parts.decode()

    def execute(self, command: gi.MotionCommand) -> gi.MotionOutcome:
        self._record(COMMAND, command)
        outcome = super().execute(command)
        self._record(OUTCOME, outcome)
        return outcome


@pytest.fixture
def recorded_run(tmp_path: Path, color_models: ColorModels) -> Path:
    """The log of a whole run with that robot: a push that uncovers the red target, and its grasp."""
    path = tmp_path / "run.mcap"
    with Recorder(path, RecordingSettings(flush_seconds=0.0)) as recorder:
        bus = Bus(sinks=(recorder,))
        log = RunLog(bus, "red")
        log.started(RunFacts("r", "0", "b" * 64, "1", "red", "table", 3, 5, to_toml(Config()), "here"))
        progress = run_loop(RecordedRobot(bus.publish), color_models, DecisionSettings("red"), RunPlan(seed=3), (log,))
        log.ended("r", progress, 0)
    return path


@pytest.fixture
def table_robot() -> TableRobot:
    return TableRobot()


@pytest.fixture
def color_models() -> ColorModels:
    return ColorModels()


@pytest.fixture
def free_endpoint() -> str:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


@pytest.fixture
def table_with() -> TableWith:
    """Heightmaps of square blocks on an otherwise empty table; later blocks lie over earlier ones."""

    def build(*blocks: Block) -> Heightmaps:
        workspace = Workspace()
        cells = workspace.cells
        height = np.zeros((cells, cells), np.float32)
        labels = np.zeros((cells, cells), np.uint8)
        for x, y, side, top, color in blocks:
            top_row, left = workspace.cell_of(x - side / 2 + 1e-6, y + side / 2 - 1e-6)
            extent = round(side / workspace.resolution)
            area = np.s_[max(0, top_row) : top_row + extent, max(0, left) : left + extent]
            height[area] = top
            labels[area] = CLASSES.index(color) if color in CLASSES else 0
        color = np.full((cells, cells, 3), 120, np.uint8)
        return Heightmaps(5, color, height, labels, workspace)

    return build


@pytest.fixture
def perceived(table_with: TableWith) -> Callable[..., Perception]:
    """What is perceived of such a table, with red the target."""

    def build(*blocks: Block) -> Perception:
        maps = table_with(*blocks)
        mask = maps.labels == CLASSES.index("red")
        patches, nothing = np.repeat(mask, 3, axis=0), np.zeros_like(mask)
        return Perception(maps.labels, maps, mask, patches, False, nothing, nothing, 0.0, {})

    return build


@pytest.fixture
def set_models() -> SetModels:
    return SetModels()


@pytest.fixture
def situation(perceived: Callable[..., Perception], set_models: SetModels) -> Callable[..., Situation]:
    """What a method decides from on such a table, by `set_models`."""

    def build(*blocks: Block, memory: Memory = Memory(), seed: int = 0) -> Situation:  # noqa: B008
        return situation_of(perceived(*blocks), "red", memory, set_models, seed)

    return build


@pytest.fixture
def recorded_robot() -> type[RecordedRobot]:
    return RecordedRobot


@pytest.fixture
def decision() -> Callable[..., Decision]:
    """Builds the decision for a motion that starts at a place; base frame."""

    def build(
        kind: gi.MotionKind, x: float = 0.5, y: float = 0.0, yaw: float = 0.0, policy: str = "coordinator"
    ) -> Decision:
        row, column = action_grid(Workspace()).cell_of(x, y)
        return Decision(
            frame_stamp_ns=5,
            step=2,
            policy=policy,
            method=policy,
            kind=kind,
            rotation=0,
            row=row,
            column=column,
            level=0,
            position=(x, y, 0.02),
            yaw=yaw,
            opening=0.0,
            value=0.5,
            q_push=0.5,
            q_grasp=0.5,
            border_ratio=0.0,
            border_norm=0.0,
            grasp_probability=None,
            target_pixels=0,
            memory=Memory(),
            seed=0,
            why="",
        )

    return build
