"""What a row of a dataset teaches a critic whose goal is any object."""

from pathlib import Path

import numpy as np
import pytest
import torch
from rich.console import Console

from grasping_invisible.data.classes import CLASSES
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.workspace import Workspace
from grasping_invisible.training.experience import Experience
from grasping_invisible.training.packed_maps import PackedMaps
from grasping_invisible.training.train_critic import CriticTraining, train_critic
from grasping_invisible.training.transitions import ANY_OBJECT, HIDDEN, TransitionReader, goal_cells, goal_mask

MAPS = Heightmaps(
    1,
    np.full((224, 224, 3), 128, np.uint8),
    np.zeros((224, 224), np.float32),
    np.zeros((224, 224), np.uint8),
    Workspace(),
)
MAPS.height[100:120, 100:120] = 0.05  # grey
MAPS.height[40:60, 40:60], MAPS.labels[40:60, 40:60] = 0.05, CLASSES.index("red")
PACKED = PackedMaps.of(MAPS)


def row_of(kind: str, **what) -> dict:
    """A row as a dataset holds it, as far as it is read."""
    images = {
        f"{when}_{name}": getattr(PACKED, name)
        for when in ("before", "after")
        for name in ("color", "height", "labels")
    }
    center = dict(zip(("center_x", "center_y", "center_z"), Workspace().center, strict=True))
    facts = {
        "run_id": "r",
        "run_started_ns": 1,
        "step": 0,
        "frame_stamp_ns": 10,
        "after_stamp_ns": 20,
        "cells": 224,
        "resolution": 0.002,
        "kind": kind,
        "rotation": 3,
        "row": 55,
        "column": 55,
        "push_level": 0,
        "usable": True,
        "scene_changed": False,
        "object_grasped": False,
        "consecutive_grasp_failures": 0,
        "goals": [],
        "revealed": None,
    }
    return {**images, **center, **facts, **what}


@pytest.mark.parametrize(
    ("row", "reward", "success"),
    [
        (row_of("grasp", object_grasped=True, scene_changed=True), 0.5, True),
        (row_of("grasp", scene_changed=True), 0.0, False),
        (row_of("push", scene_changed=True), 0.25, False),
        (row_of("push"), 0.0, False),
    ],
)
def test_any_object_that_is_held_or_moved_counts(row, reward, success):
    (transition,) = TransitionReader().of_any_object(row)
    assert (transition.goal, transition.reward, transition.success) == (ANY_OBJECT, reward, success)
    assert transition.looks_ahead == (reward > 0)
    assert transition.aimed == (transition.kind == gi.GRASP)
    _, mask = transition.before()
    assert mask.all()


def test_where_nobody_looked_after_a_grasp_the_state_before_stands_for_what_follows():
    unseen = {"after_stamp_ns": None, "after_color": None, "after_height": None, "after_labels": None}
    (held,) = TransitionReader().of_any_object(row_of("grasp", object_grasped=True, scene_changed=True, **unseen))
    assert held.looks_ahead
    assert held.then is held.seen
    (failed,) = TransitionReader().of_any_object(row_of("grasp", scene_changed=True, **unseen))
    assert failed.then is None


def test_what_teaches_nothing_teaches_nothing_of_any_object_either():
    assert list(TransitionReader().of_any_object(row_of("push", usable=False, why_not="a reason"))) == []


@pytest.mark.parametrize("revealed", [True, False])
def test_a_push_of_a_search_teaches_of_whatever_is_hidden(revealed: bool):
    (transition,) = TransitionReader().of(row_of("push", revealed=revealed))
    assert (transition.goal, transition.success, transition.looks_ahead) == (HIDDEN, revealed, False)
    _, mask = transition.before()
    assert mask.all()


def test_a_state_is_kept_once():
    reader = TransitionReader()
    one, other = (next(reader.of(row_of("push", revealed=False, rotation=k))) for k in (1, 2))
    assert one.seen is other.seen


def test_a_goal_is_asked_about_by_its_mask_and_lies_in_its_cells():
    red = MAPS.labels == CLASSES.index("red")
    np.testing.assert_array_equal(goal_mask(MAPS, CLASSES.index("red")), red)
    np.testing.assert_array_equal(goal_cells(MAPS, CLASSES.index("red")), red)
    assert goal_mask(MAPS, ANY_OBJECT).all()
    np.testing.assert_array_equal(goal_cells(MAPS, ANY_OBJECT), MAPS.height > 0)


def test_a_critic_learns_of_any_object_and_says_so(tmp_path: Path):
    torch.manual_seed(0)
    rows = [row_of(kind, scene_changed=True, object_grasped=kind == "grasp") for kind in ("push", "grasp")] * 3
    taught = [transition for row in rows for transition in TransitionReader().of_any_object(row)]
    experience = Experience(taught, taught[:2], ("a dataset",), {}, 1, 1, agnostic=True)
    settings = CriticTraining(tmp_path / "critic.pt", steps=4, rounds=2, batch=2)
    checkpoint = train_critic(settings, experience, Console(quiet=True))
    assert checkpoint.trained_on["goal"] == "any object"
    assert checkpoint.trained_on["transitions"] == 6
