"""A labelled step as a row of a dataset, complete in itself."""

import math
from typing import Any

from grasping_invisible.data.clock import to_ns
from grasping_invisible.data.labelled_steps import LabelledStep
from grasping_invisible.data.labels import RULES
from grasping_invisible.data.log_commands import wording
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi


def row_of(labelled: LabelledStep) -> dict[str, Any] | None:
    """The row, but for the hashes of log and corrections; None where the log lacks the run's start or the heightmaps.

    Images are the logged PNG bytes. What is not known is None.
    """
    step = labelled.step
    if step.start is None or step.heightmaps is None:
        return None
    seen = step.heightmaps
    return {
        **_run(step.start),
        **_decision(step.decision),
        **_outcome(labelled),
        **_label(labelled),
        "target": step.start.target_color,
        "frame_stamp_ns": to_ns(seen.stamp),
        "after_stamp_ns": None if step.next_heightmaps is None else to_ns(step.next_heightmaps.stamp),
        "cells": seen.rows,
        "resolution": seen.resolution,
        "center_x": seen.origin.x,
        "center_y": seen.origin.y,
        "center_z": seen.origin.z,
        **_images("before", seen),
        **_images("after", step.next_heightmaps),
    }


def _run(start: gi.RunStart) -> dict[str, Any]:
    return {
        "run_id": start.run_id,
        "run_started_ns": to_ns(start.stamp),
        "project_version": start.project_version,
        "bundle_sha256": start.bundle_sha256,
        "robot": start.robot,
        "scene": start.scene,
        "seed": start.seed,
        "max_motions": start.max_motions,
    }


def _decision(decision: gi.Decision) -> dict[str, Any]:
    return {
        "step": decision.step,
        "policy": decision.policy,
        "method": decision.method,
        "kind": wording.kind(decision.kind),
        "rotation": decision.rotation,
        "row": decision.row,
        "column": decision.column,
        "push_level": decision.push_level,
        "x": decision.position.x,
        "y": decision.position.y,
        "z": decision.position.z,
        "yaw": decision.yaw,
        "opening": decision.opening,
        "value": decision.value,
        "q_push": decision.q_push,
        "q_grasp": decision.q_grasp,
        "border_ratio": decision.border_ratio,
        "border_norm": decision.border_norm,
        "consecutive_grasp_failures": decision.memory.consecutive_grasp_failures,
        "grasp_probability": None if math.isnan(decision.grasp_probability) else decision.grasp_probability,
        "target_pixels": decision.target_pixels,
    }


def _outcome(labelled: LabelledStep) -> dict[str, Any]:
    outcome, result = labelled.step.outcome, labelled.step.result
    return {
        "status": None if outcome is None else wording.status(outcome.status),
        "holding": None if outcome is None else outcome.holding,
        "path_fraction": None if outcome is None else outcome.path_fraction,
        "scene_changed": None if result is None else result.scene_changed,
        "target_visible": None if result is None else result.target_visible,
        "runtime_target_grasped": None if result is None else result.target_grasped,
    }


def _label(labelled: LabelledStep) -> dict[str, Any]:
    label = labelled.label
    own = next((goal for goal in label.goals if not goal.hindsight), None)
    return {
        "usable": not label.why_not,
        "why_not": label.why_not or None,
        "label_source": label.source,
        "object_grasped": label.grasp.object_grasped,
        "target_grasped": label.grasp.target_grasped,
        "grasped_color": label.grasp.color,
        "reward": None if own is None else own.reward,
        "success": None if own is None else own.success,
        "grasp_label": None if label.classifier is None else label.classifier.grasp,
        "revealed": label.revealed,
        "goals": [
            {
                "goal": goal.goal,
                "hindsight": goal.hindsight,
                "aimed": goal.aimed,
                "success": goal.success,
                "reward": goal.reward,
                "border_ratio": goal.border_ratio,
                "border_norm": goal.border_norm,
            }
            for goal in label.goals
        ],
        "rules": RULES,
    }


def _images(when: str, maps: gi.Heightmaps | None) -> dict[str, bytes | None]:
    return {
        f"{when}_color": None if maps is None else maps.color_png,
        f"{when}_height": None if maps is None else maps.height_png,
        f"{when}_labels": None if maps is None else maps.labels_png,
    }
