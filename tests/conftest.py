"""Runs with heightmaps of full size, recorded by the real recorder, for whoever reads logs or datasets."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from google.protobuf.message import Message

from grasping_invisible.data import topics
from grasping_invisible.data.classes import CLASSES
from grasping_invisible.data.clock import to_timestamp
from grasping_invisible.data.drawing import painted
from grasping_invisible.data.heightmap_message import HeightmapArrays, encode_heightmaps
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.recorder import Recorder, RecordingSettings

START_NS = 1_700_000_000_000_000_000
STEP_NS = 1_000_000_000


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
