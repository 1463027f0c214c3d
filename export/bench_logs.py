"""Logs for `gi-bench rebuild`: small runs that look like real ones, made quickly and from a seed."""

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from google.protobuf.message import Message

from grasping_invisible.data import topics
from grasping_invisible.data.action_grid import ACTION_CELLS, PUSH_LENGTH, PUSH_LEVELS, ROTATIONS, rotation_angle
from grasping_invisible.data.classes import CLASSES, GREY, RGB, TARGET_COLORS
from grasping_invisible.data.clock import to_timestamp
from grasping_invisible.data.heightmap_message import HeightmapArrays, encode_heightmaps
from grasping_invisible.data.images import encode_color, encode_depth
from grasping_invisible.data.log_file import LogFile
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.q_map_message import QMapArrays, encode_q_maps
from grasping_invisible.data.recorder import PART
from grasping_invisible.data.topics import Topic
from grasping_invisible.runtime.config import Config, to_toml
from grasping_invisible.runtime.motion import cell_position
from grasping_invisible.runtime.workspace import Workspace

STEPS = 6
_FRAME = 320, 240  # pixels, one frame a step, colour and depth
BEGIN_NS = 1_700_000_000_000_000_000
STEP_NS = 2_000_000_000
_TABLES = 40  # different pieces of clutter, which logs combine anew
_SHADE = 4  # standard deviation of a colour value


class LogMaker:
    """Writes logs of seeded runs: `STEPS` motions among blocks, with heightmaps, Q maps and some camera images."""

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self._workspace = Workspace()
        rng = np.random.default_rng(seed)
        self._maps = [self._table(rng) for _ in range(_TABLES)]
        self._q_maps = [_values(rng) for _ in range(4)]
        self._frames = [_frame(rng) for _ in range(8)]

    def write(self, folder: Path, number: int) -> Path:
        """The log of run `number`, the same for the same seed."""
        rng = np.random.default_rng((self._seed, number))
        path = folder / f"run-{number:05d}.mcap"
        log = LogFile(path)
        log.add_metadata(PART, {"log": path.name, "part": "0"})
        sequences: dict[str, int] = {}
        for index, (topic, message) in enumerate(self._run(number, rng)):
            sequence = sequences.get(topic.key, 0)
            sequences[topic.key] = sequence + 1
            stamp = BEGIN_NS + index * 1_000_000
            log.write(topic, message.SerializeToString(deterministic=True), stamp, stamp, sequence)
        log.finish()
        return path

    def _run(self, number: int, rng: np.random.Generator) -> Iterator[tuple[Topic, Message]]:
        """Messages to be written at once: the next step may change them."""
        run_id = f"{self._seed:04x}{number:08x}"
        target = str(rng.choice(TARGET_COLORS))
        start = gi.RunStart(
            stamp=to_timestamp(BEGIN_NS),
            run_id=run_id,
            project_version="0",
            bundle_sha256="0" * 64,
            target_color=target,
            scene="gi-bench",
            seed=number,
            max_motions=STEPS,
            config_toml=to_toml(Config()),
            robot="gi-bench",
        )
        end = gi.RunSummary(stamp=to_timestamp(BEGIN_NS), run_id=run_id, motions=STEPS, ended_because="budget")
        yield topics.RUN_START, start
        for step in range(STEPS):
            yield from self._step(step, rng)
        yield topics.HEIGHTMAPS, self._seen(STEPS, rng)
        yield topics.RUN_SUMMARY, end

    def _step(self, step: int, rng: np.random.Generator) -> list[tuple[Topic, Message]]:
        stamp = to_timestamp(BEGIN_NS + step * STEP_NS)
        kind = gi.GRASP if rng.random() < 0.5 else gi.PUSH
        row, column, rotation = (int(number) for number in rng.integers((20, 20, 0), (92, 92, ROTATIONS)))
        x, y = cell_position(row, column, self._workspace)
        position, yaw = gi.Point(x=x, y=y, z=0.02), rotation_angle(rotation)
        holding = kind == gi.GRASP and bool(rng.random() < 0.3)
        q_maps = self._q_maps[int(rng.integers(len(self._q_maps)))]
        q_maps.step = step
        frame = self._frames[int(rng.integers(len(self._frames)))]
        for _, image in frame:
            image.timestamp.CopyFrom(stamp)
        return [
            *frame,
            (topics.HEIGHTMAPS, self._seen(step, rng)),
            (
                topics.DECISION,
                gi.Decision(
                    stamp=stamp,
                    frame_stamp=stamp,
                    step=step,
                    policy="coordinator",
                    method="coordinator",
                    kind=kind,
                    rotation=rotation,
                    row=row,
                    column=column,
                    position=position,
                    yaw=yaw,
                    value=0.5,
                    grasp_probability=0.5,
                    target_pixels=900,
                    stages=[gi.StageTime(stage="segment", milliseconds=20.0)],
                ),
            ),
            (topics.Q_MAPS, q_maps),
            (
                topics.COMMAND,
                gi.MotionCommand(id=step + 1, stamp=stamp, kind=kind, position=position, yaw=yaw, length=PUSH_LENGTH),
            ),
            (topics.COMMAND_REPLY, gi.CommandReply(command_id=step + 1, accepted=True)),
            (
                topics.OUTCOME,
                gi.MotionOutcome(command_id=step + 1, started=stamp, ended=stamp, status=gi.COMPLETED, holding=holding),
            ),
            (
                topics.STEP_RESULT,
                gi.StepResult(
                    stamp=stamp,
                    step=step,
                    command_id=step + 1,
                    status=gi.COMPLETED,
                    scene_changed=True,
                    target_visible=True,
                    object_grasped=holding,
                ),
            ),
        ]

    def _seen(self, step: int, rng: np.random.Generator) -> gi.Heightmaps:
        maps = self._maps[int(rng.integers(_TABLES))]
        maps.step = step
        maps.stamp.CopyFrom(to_timestamp(BEGIN_NS + step * STEP_NS))
        return maps

    def _table(self, rng: np.random.Generator) -> gi.Heightmaps:
        """A table with a dozen blocks on it, whose colours and heights have noise."""
        cells = self._workspace.cells
        color = np.full((cells, cells, 3), RGB[GREY], np.float32)
        height, labels = np.zeros((cells, cells), np.float32), np.zeros((cells, cells), np.uint8)
        for block in range(12):
            (top, left), (high, wide) = rng.integers(0, cells - 50, 2), rng.integers(15, 50, 2)
            area = np.s_[top : top + high, left : left + wide]
            labels[area] = block % len(CLASSES)
            color[area] = RGB[CLASSES[labels[top, left]]] if labels[top, left] else RGB[GREY]
            height[area] = rng.uniform(0.03, 0.1)
        color += rng.normal(0.0, _SHADE, color.shape)
        height += rng.normal(0.001, 0.0005, height.shape).astype(np.float32)
        shown = np.clip(color, 0, 255).astype(np.uint8)
        center, resolution = self._workspace.center, self._workspace.resolution
        return encode_heightmaps(HeightmapArrays(0, 0, shown, height.clip(0), labels, resolution, center))


def _values(rng: np.random.Generator) -> gi.QMaps:
    """Q maps as smooth as a critic's."""
    coarse = rng.uniform(0, 1, ((len(PUSH_LEVELS) + 1) * ROTATIONS, 8, 8)).astype(np.float32)
    stack = np.stack([cv2.resize(values, (ACTION_CELLS, ACTION_CELLS)) for values in coarse])
    *pushes, grasps = stack.reshape(-1, ROTATIONS, ACTION_CELLS, ACTION_CELLS)
    return encode_q_maps(QMapArrays(0, 0, np.stack(pushes), grasps))


def _frame(rng: np.random.Generator) -> list[tuple[Topic, CompressedImage | RawImage]]:
    """A camera's image and depth, with noise."""
    coarse = rng.uniform(40, 220, (12, 16, 3)).astype(np.float32)
    color = np.asarray(cv2.resize(coarse, _FRAME, interpolation=cv2.INTER_NEAREST), np.float32)
    depth = (0.7 - color[..., 0] / 2000 + rng.normal(0.0, 0.001, _FRAME[::-1])).astype(np.float32)
    color = np.clip(color + rng.normal(0.0, 2.0, color.shape), 0, 255).astype(np.uint8)
    return [(topics.COLOR_IMAGE, encode_color(color, 0)), (topics.DEPTH_IMAGE, encode_depth(depth, 0))]
