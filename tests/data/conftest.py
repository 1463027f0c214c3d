"""A small run, recorded by the real recorder, for tests to read, cut and damage."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from google.protobuf.message import Message

from grasping_invisible.data import topics
from grasping_invisible.data.clock import to_timestamp
from grasping_invisible.data.heightmap_message import HeightmapArrays, encode_heightmaps
from grasping_invisible.data.images import encode_color, encode_depth, encode_labels
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.q_map_message import QMapArrays, encode_q_maps
from grasping_invisible.data.recorder import RecordingSettings

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
        (topics.Q_MAPS, encode_q_maps(QMapArrays(now, step, np.stack([Q, Q]), Q))),
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


@pytest.fixture
def write_practice(write_run: WriteRun, practice: Callable[..., list[tuple[topics.Topic, Message]]]) -> WriteRun:
    """Records such a run: `write_practice(name, seed, steps=3, **more)`; the run's id is its log's name."""

    def write(name: str, seed: int, steps: int = 3, **more: Any) -> Path:
        return write_run(f"{name}.mcap", messages=practice(name, seed, steps, **more))

    return write
