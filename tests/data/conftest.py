"""A small run, recorded by the real recorder, for tests to read, cut and damage."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from google.protobuf.message import Message

from grasping_invisible.data import topics
from grasping_invisible.data.classes import CLASSES
from grasping_invisible.data.clock import to_timestamp
from grasping_invisible.data.drawing import painted
from grasping_invisible.data.heightmap_message import HeightmapArrays, encode_heightmaps
from grasping_invisible.data.images import encode_color, encode_depth, encode_labels
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.q_map_message import QMapArrays, encode_q_maps
from grasping_invisible.data.recorder import Recorder, RecordingSettings

START_NS = 1_700_000_000_000_000_000
STEP_NS = 1_000_000_000
RNG = np.random.default_rng(5)
COLOR = RNG.integers(0, 256, (48, 64, 3), dtype=np.uint8)
DEPTH = RNG.uniform(0.5, 0.9, (48, 64)).astype(np.float32)
LABELS = RNG.integers(0, 8, (48, 64), dtype=np.uint8)
HEIGHT = RNG.uniform(0, 0.1, (24, 24)).astype(np.float32)
Q = RNG.uniform(0, 1, (16, 12, 12)).astype(np.float32)


def step_messages(step: int, count: int) -> list[tuple[topics.Topic, Message]]:
    """What a run says in one step: a push, or in the last one the grasp."""
    now = START_NS + step * STEP_NS
    stamp = to_timestamp(now)
    last = step == count - 1
    kind = gi.GRASP if last else gi.PUSH
    heightmaps = HeightmapArrays(now, step, COLOR[:24, :24], HEIGHT, LABELS[:24, :24], 0.002, (0.5, 0.0, 0.0))
    return [
        (topics.COLOR_IMAGE, encode_color(COLOR, now)),
        (topics.DEPTH_IMAGE, encode_depth(DEPTH, now)),
        (topics.TRUTH, gi.TruthState(stamp=stamp, scene="pile", target_color="red")),
        (topics.SEGMENTATION, encode_labels(LABELS, now)),
        (topics.HEIGHTMAPS, encode_heightmaps(heightmaps)),
        (topics.Q_MAPS, encode_q_maps(QMapArrays(now, step, Q, Q))),
        (
            topics.DECISION,
            gi.Decision(
                stamp=stamp,
                frame_stamp=stamp,
                step=step,
                policy="coordinator" if last else "explorer",
                kind=kind,
                rotation=4,
                position=gi.Point(x=0.5, y=0.1, z=0.02),
                yaw=1.571,
                value=0.75,
                grasp_probability=0.9 if last else float("nan"),
                target_pixels=120 if last else 0,
                why="a test",
                stages=[gi.StageTime(stage="segment", milliseconds=12.5)],
            ),
        ),
        (topics.COMMAND, gi.MotionCommand(id=10 + step, stamp=stamp, kind=kind)),
        (topics.COMMAND_REPLY, gi.CommandReply(command_id=10 + step, accepted=True)),
        (
            topics.OUTCOME,
            gi.MotionOutcome(
                command_id=10 + step,
                started=stamp,
                ended=to_timestamp(now + STEP_NS // 2),
                status=gi.COMPLETED,
                holding=last,
            ),
        ),
        (
            topics.STEP_RESULT,
            gi.StepResult(
                stamp=stamp,
                step=step,
                command_id=10 + step,
                status=gi.COMPLETED,
                scene_changed=True,
                target_grasped=last,
            ),
        ),
    ]


def run_messages(count: int = 3) -> list[tuple[topics.Topic, Message]]:
    """A whole run of `count` steps that ends with the target grasped."""
    end = START_NS + count * STEP_NS
    return [
        (
            topics.RUN_START,
            gi.RunStart(
                stamp=to_timestamp(START_NS),
                run_id="run-1",
                project_version="0.1.0",
                bundle_sha256="ab" * 32,
                target_color="red",
                scene="pile",
                seed=7,
                max_motions=15,
            ),
        ),
        *(message for step in range(count) for message in step_messages(step, count)),
        (
            topics.RUN_SUMMARY,
            gi.RunSummary(
                stamp=to_timestamp(end),
                run_id="run-1",
                grasped=True,
                found=True,
                motions=count,
                ended_because="grasped",
            ),
        ),
    ]


@pytest.fixture
def run_of() -> Callable[..., list[tuple[topics.Topic, Message]]]:
    """The messages of a whole run, fresh at each call: `run_of(steps=3)`."""
    return run_messages


WriteRun = Callable[..., Path]


@pytest.fixture(scope="session")
def record() -> Callable[..., None]:
    """Records messages, one each 0.1 s: `record(path, messages, settings=None)`."""

    def into(
        path: Path, messages: list[tuple[topics.Topic, Message]], settings: RecordingSettings | None = None
    ) -> None:
        with Recorder(path, settings) as recorder:
            recorder.add_metadata("run", {"project": "test"})
            for number, (topic, message) in enumerate(messages):
                recorder.put(topic, message.SerializeToString(), START_NS + number * STEP_NS // 10)
        assert recorder.failure is None

    return into


@pytest.fixture
def write_run(tmp_path: Path, record: Callable[..., None]) -> WriteRun:
    """Records a run and returns its log: `write_run(name, steps=3, settings=None, messages=None)`."""

    def write(
        name: str = "run.mcap",
        steps: int = 3,
        settings: RecordingSettings | None = None,
        messages: list[tuple[topics.Topic, Message]] | None = None,
    ) -> Path:
        path = tmp_path / name
        record(path, messages or run_messages(steps), settings)
        return path

    return write


def seen_from_above(*blocks: tuple[str, tuple[int, int]], step: int = 0, stamp_ns: int = START_NS) -> HeightmapArrays:
    """50 mm cubes of some colours on the workspace, each around a cell of the action grid."""
    labels = np.zeros((224, 224), np.uint8)
    for name, (row, column) in blocks:
        labels[2 * row - 12 : 2 * row + 13, 2 * column - 12 : 2 * column + 13] = CLASSES.index(name)
    height = np.where(labels > 0, 0.05, 0.0).astype(np.float32)
    return HeightmapArrays(stamp_ns, step, painted(labels), height, labels, 0.002, (0.53, 0.0, 0.0))


RED_AT, BLUE_AT = (56, 40), (56, 70)  # cells of the action grid


def practice_messages(
    run_id: str, seed: int, steps: int = 3, started_ns: int = START_NS, scene: str = "pile"
) -> list[tuple[topics.Topic, Message]]:
    """A run after a red block: it pushes past it until its last step, in which it grasps it."""
    messages: list[tuple[topics.Topic, Message]] = [
        (
            topics.RUN_START,
            gi.RunStart(
                stamp=to_timestamp(started_ns), run_id=run_id, target_color="red", scene=scene, seed=seed, robot="sim"
            ),
        )
    ]
    for step in range(steps + 1):
        now, last = started_ns + step * STEP_NS, step == steps - 1
        blocks = [("red", RED_AT), ("blue", (BLUE_AT[0], BLUE_AT[1] + step))][step == steps :]
        maps = seen_from_above(*blocks, step=step, stamp_ns=now)
        messages.append((topics.HEIGHTMAPS, encode_heightmaps(maps)))
        if step == steps:
            break
        kind = gi.GRASP if last else gi.PUSH
        row, column = RED_AT if last else (56, 20)
        messages += [
            (
                topics.DECISION,
                gi.Decision(
                    stamp=to_timestamp(now),
                    frame_stamp=to_timestamp(now),
                    step=step,
                    policy="coordinator",
                    kind=kind,
                    row=row,
                    column=column,
                    q_push=0.25,
                    q_grasp=0.75,
                    grasp_probability=math.nan,
                ),
            ),
            (topics.COMMAND, gi.MotionCommand(id=step + 1, kind=kind)),
            (topics.OUTCOME, gi.MotionOutcome(command_id=step + 1, status=gi.COMPLETED, holding=last)),
            (topics.STEP_RESULT, gi.StepResult(step=step, object_grasped=last, target_grasped=last)),
        ]
    return messages


@pytest.fixture(scope="session")
def practice() -> Callable[..., list[tuple[topics.Topic, Message]]]:
    """The messages of a run with heightmaps of full size: `practice(run_id, seed, steps=3, ...)`."""
    return practice_messages


@pytest.fixture
def write_practice(write_run: WriteRun) -> WriteRun:
    """Records such a run: `write_practice(name, seed, steps=3, **more)`; the run's id is its log's name."""

    def write(name: str, seed: int, steps: int = 3, **more: Any) -> Path:
        return write_run(f"{name}.mcap", messages=practice_messages(name, seed, steps, **more))

    return write
