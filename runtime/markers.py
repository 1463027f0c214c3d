"""The workspace and the chosen motion as Foxglove 3-D markers, base frame, metres."""

import math

from foxglove_schemas_protobuf.ArrowPrimitive_pb2 import ArrowPrimitive
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.CubePrimitive_pb2 import CubePrimitive
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3

from grasping_invisible.data.action_grid import PUSH_LENGTH
from grasping_invisible.data.clock import to_timestamp
from grasping_invisible.data.drawing import FINGER_OPENING
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.transform_message import BASE_FRAME
from grasping_invisible.runtime.decision_record import Decision
from grasping_invisible.runtime.workspace import Workspace

_EDGE = Color(r=0.9, g=0.9, b=0.9, a=0.8)
_PUSH = Color(r=1.0, g=0.85, b=0.1, a=0.9)
_GRASP = Color(r=0.2, g=1.0, b=0.4, a=0.9)
_FINGER = Vector3(x=0.01, y=0.02, z=0.05)


def decision_markers(decision: Decision, workspace: Workspace, stamp_ns: int) -> SceneUpdate:
    """An arrow along a push, or two fingers about to close, and the workspace's edge."""
    motion = SceneEntity(timestamp=to_timestamp(stamp_ns), frame_id=BASE_FRAME, id="motion")
    if decision.kind == gi.PUSH:
        motion.arrows.append(
            ArrowPrimitive(
                pose=_pose(decision, 0.0),
                shaft_length=PUSH_LENGTH * 0.75,
                shaft_diameter=0.01,
                head_length=PUSH_LENGTH * 0.25,
                head_diameter=0.025,
                color=_PUSH,
            )
        )
    else:
        for side in (-0.5, 0.5):
            motion.cubes.append(CubePrimitive(pose=_pose(decision, side * FINGER_OPENING), size=_FINGER, color=_GRASP))
    return SceneUpdate(entities=[_edge(workspace, stamp_ns), motion])


def _edge(workspace: Workspace, stamp_ns: int) -> SceneEntity:
    (low_x, low_y), (high_x, high_y) = workspace.low, workspace.high
    corners = ((low_x, low_y), (high_x, low_y), (high_x, high_y), (low_x, high_y))
    line = LinePrimitive(
        type=LinePrimitive.LINE_LOOP,
        pose=Pose(orientation=Quaternion(w=1.0)),
        thickness=2.0,
        scale_invariant=True,
        points=[Point3(x=x, y=y, z=workspace.center[2]) for x, y in corners],
        color=_EDGE,
    )
    return SceneEntity(timestamp=to_timestamp(stamp_ns), frame_id=BASE_FRAME, id="workspace", lines=[line])


def _pose(decision: Decision, ahead: float) -> Pose:
    """The motion's pose, moved `ahead` metres along its yaw."""
    x, y, z = decision.position
    half = decision.yaw / 2
    return Pose(
        position=Vector3(x=x + ahead * math.cos(decision.yaw), y=y + ahead * math.sin(decision.yaw), z=z),
        orientation=Quaternion(z=math.sin(half), w=math.cos(half)),
    )
