import datetime

from google.protobuf import timestamp_pb2 as _timestamp_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class MotionKind(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    MOTION_KIND_UNSPECIFIED: _ClassVar[MotionKind]
    PUSH: _ClassVar[MotionKind]
    GRASP: _ClassVar[MotionKind]
    PLACE: _ClassVar[MotionKind]
    HOME: _ClassVar[MotionKind]

class MotionStatus(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    MOTION_STATUS_UNSPECIFIED: _ClassVar[MotionStatus]
    COMPLETED: _ClassVar[MotionStatus]
    UNREACHABLE: _ClassVar[MotionStatus]
    BLOCKED: _ClassVar[MotionStatus]
    STOPPED: _ClassVar[MotionStatus]
    FAULT: _ClassVar[MotionStatus]

class RobotState(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    ROBOT_STATE_UNSPECIFIED: _ClassVar[RobotState]
    IDLE: _ClassVar[RobotState]
    MOVING: _ClassVar[RobotState]
    SAFE_STOP: _ClassVar[RobotState]
    ROBOT_FAULT: _ClassVar[RobotState]
MOTION_KIND_UNSPECIFIED: MotionKind
PUSH: MotionKind
GRASP: MotionKind
PLACE: MotionKind
HOME: MotionKind
MOTION_STATUS_UNSPECIFIED: MotionStatus
COMPLETED: MotionStatus
UNREACHABLE: MotionStatus
BLOCKED: MotionStatus
STOPPED: MotionStatus
FAULT: MotionStatus
ROBOT_STATE_UNSPECIFIED: RobotState
IDLE: RobotState
MOVING: RobotState
SAFE_STOP: RobotState
ROBOT_FAULT: RobotState

class Point(_message.Message):
    __slots__ = ("x", "y", "z")
    X_FIELD_NUMBER: _ClassVar[int]
    Y_FIELD_NUMBER: _ClassVar[int]
    Z_FIELD_NUMBER: _ClassVar[int]
    x: float
    y: float
    z: float
    def __init__(self, x: _Optional[float] = ..., y: _Optional[float] = ..., z: _Optional[float] = ...) -> None: ...

class MotionCommand(_message.Message):
    __slots__ = ("id", "stamp", "kind", "position", "yaw", "length", "opening")
    ID_FIELD_NUMBER: _ClassVar[int]
    STAMP_FIELD_NUMBER: _ClassVar[int]
    KIND_FIELD_NUMBER: _ClassVar[int]
    POSITION_FIELD_NUMBER: _ClassVar[int]
    YAW_FIELD_NUMBER: _ClassVar[int]
    LENGTH_FIELD_NUMBER: _ClassVar[int]
    OPENING_FIELD_NUMBER: _ClassVar[int]
    id: int
    stamp: _timestamp_pb2.Timestamp
    kind: MotionKind
    position: Point
    yaw: float
    length: float
    opening: float
    def __init__(self, id: _Optional[int] = ..., stamp: _Optional[_Union[datetime.datetime, _timestamp_pb2.Timestamp, _Mapping]] = ..., kind: _Optional[_Union[MotionKind, str]] = ..., position: _Optional[_Union[Point, _Mapping]] = ..., yaw: _Optional[float] = ..., length: _Optional[float] = ..., opening: _Optional[float] = ...) -> None: ...

class CommandReply(_message.Message):
    __slots__ = ("command_id", "accepted", "reason")
    COMMAND_ID_FIELD_NUMBER: _ClassVar[int]
    ACCEPTED_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    command_id: int
    accepted: bool
    reason: str
    def __init__(self, command_id: _Optional[int] = ..., accepted: _Optional[bool] = ..., reason: _Optional[str] = ...) -> None: ...

class MotionOutcome(_message.Message):
    __slots__ = ("command_id", "started", "ended", "status", "detail", "gripper_width", "holding", "path_fraction")
    COMMAND_ID_FIELD_NUMBER: _ClassVar[int]
    STARTED_FIELD_NUMBER: _ClassVar[int]
    ENDED_FIELD_NUMBER: _ClassVar[int]
    STATUS_FIELD_NUMBER: _ClassVar[int]
    DETAIL_FIELD_NUMBER: _ClassVar[int]
    GRIPPER_WIDTH_FIELD_NUMBER: _ClassVar[int]
    HOLDING_FIELD_NUMBER: _ClassVar[int]
    PATH_FRACTION_FIELD_NUMBER: _ClassVar[int]
    command_id: int
    started: _timestamp_pb2.Timestamp
    ended: _timestamp_pb2.Timestamp
    status: MotionStatus
    detail: str
    gripper_width: float
    holding: bool
    path_fraction: float
    def __init__(self, command_id: _Optional[int] = ..., started: _Optional[_Union[datetime.datetime, _timestamp_pb2.Timestamp, _Mapping]] = ..., ended: _Optional[_Union[datetime.datetime, _timestamp_pb2.Timestamp, _Mapping]] = ..., status: _Optional[_Union[MotionStatus, str]] = ..., detail: _Optional[str] = ..., gripper_width: _Optional[float] = ..., holding: _Optional[bool] = ..., path_fraction: _Optional[float] = ...) -> None: ...

class RobotHealth(_message.Message):
    __slots__ = ("stamp", "state", "active_command_id", "gripper_width", "holding", "detail", "robot_name", "protocol_version")
    STAMP_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    ACTIVE_COMMAND_ID_FIELD_NUMBER: _ClassVar[int]
    GRIPPER_WIDTH_FIELD_NUMBER: _ClassVar[int]
    HOLDING_FIELD_NUMBER: _ClassVar[int]
    DETAIL_FIELD_NUMBER: _ClassVar[int]
    ROBOT_NAME_FIELD_NUMBER: _ClassVar[int]
    PROTOCOL_VERSION_FIELD_NUMBER: _ClassVar[int]
    stamp: _timestamp_pb2.Timestamp
    state: RobotState
    active_command_id: int
    gripper_width: float
    holding: bool
    detail: str
    robot_name: str
    protocol_version: int
    def __init__(self, stamp: _Optional[_Union[datetime.datetime, _timestamp_pb2.Timestamp, _Mapping]] = ..., state: _Optional[_Union[RobotState, str]] = ..., active_command_id: _Optional[int] = ..., gripper_width: _Optional[float] = ..., holding: _Optional[bool] = ..., detail: _Optional[str] = ..., robot_name: _Optional[str] = ..., protocol_version: _Optional[int] = ...) -> None: ...

class RuntimeHealth(_message.Message):
    __slots__ = ("stamp", "run_id", "active_command_id")
    STAMP_FIELD_NUMBER: _ClassVar[int]
    RUN_ID_FIELD_NUMBER: _ClassVar[int]
    ACTIVE_COMMAND_ID_FIELD_NUMBER: _ClassVar[int]
    stamp: _timestamp_pb2.Timestamp
    run_id: str
    active_command_id: int
    def __init__(self, stamp: _Optional[_Union[datetime.datetime, _timestamp_pb2.Timestamp, _Mapping]] = ..., run_id: _Optional[str] = ..., active_command_id: _Optional[int] = ...) -> None: ...

class StopRequest(_message.Message):
    __slots__ = ("stamp", "reason")
    STAMP_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    stamp: _timestamp_pb2.Timestamp
    reason: str
    def __init__(self, stamp: _Optional[_Union[datetime.datetime, _timestamp_pb2.Timestamp, _Mapping]] = ..., reason: _Optional[str] = ...) -> None: ...

class ObjectTruth(_message.Message):
    __slots__ = ("name", "shape", "color", "position", "qx", "qy", "qz", "qw", "visible_pixels")
    NAME_FIELD_NUMBER: _ClassVar[int]
    SHAPE_FIELD_NUMBER: _ClassVar[int]
    COLOR_FIELD_NUMBER: _ClassVar[int]
    POSITION_FIELD_NUMBER: _ClassVar[int]
    QX_FIELD_NUMBER: _ClassVar[int]
    QY_FIELD_NUMBER: _ClassVar[int]
    QZ_FIELD_NUMBER: _ClassVar[int]
    QW_FIELD_NUMBER: _ClassVar[int]
    VISIBLE_PIXELS_FIELD_NUMBER: _ClassVar[int]
    name: str
    shape: str
    color: str
    position: Point
    qx: float
    qy: float
    qz: float
    qw: float
    visible_pixels: int
    def __init__(self, name: _Optional[str] = ..., shape: _Optional[str] = ..., color: _Optional[str] = ..., position: _Optional[_Union[Point, _Mapping]] = ..., qx: _Optional[float] = ..., qy: _Optional[float] = ..., qz: _Optional[float] = ..., qw: _Optional[float] = ..., visible_pixels: _Optional[int] = ...) -> None: ...

class TruthState(_message.Message):
    __slots__ = ("stamp", "objects", "held_object", "scene", "seed", "target_color")
    STAMP_FIELD_NUMBER: _ClassVar[int]
    OBJECTS_FIELD_NUMBER: _ClassVar[int]
    HELD_OBJECT_FIELD_NUMBER: _ClassVar[int]
    SCENE_FIELD_NUMBER: _ClassVar[int]
    SEED_FIELD_NUMBER: _ClassVar[int]
    TARGET_COLOR_FIELD_NUMBER: _ClassVar[int]
    stamp: _timestamp_pb2.Timestamp
    objects: _containers.RepeatedCompositeFieldContainer[ObjectTruth]
    held_object: str
    scene: str
    seed: int
    target_color: str
    def __init__(self, stamp: _Optional[_Union[datetime.datetime, _timestamp_pb2.Timestamp, _Mapping]] = ..., objects: _Optional[_Iterable[_Union[ObjectTruth, _Mapping]]] = ..., held_object: _Optional[str] = ..., scene: _Optional[str] = ..., seed: _Optional[int] = ..., target_color: _Optional[str] = ...) -> None: ...

class RunStart(_message.Message):
    __slots__ = ("stamp", "run_id", "project_version", "bundle_sha256", "target_color", "scene", "seed", "max_motions", "config_toml", "robot", "onnxruntime_version")
    STAMP_FIELD_NUMBER: _ClassVar[int]
    RUN_ID_FIELD_NUMBER: _ClassVar[int]
    PROJECT_VERSION_FIELD_NUMBER: _ClassVar[int]
    BUNDLE_SHA256_FIELD_NUMBER: _ClassVar[int]
    TARGET_COLOR_FIELD_NUMBER: _ClassVar[int]
    SCENE_FIELD_NUMBER: _ClassVar[int]
    SEED_FIELD_NUMBER: _ClassVar[int]
    MAX_MOTIONS_FIELD_NUMBER: _ClassVar[int]
    CONFIG_TOML_FIELD_NUMBER: _ClassVar[int]
    ROBOT_FIELD_NUMBER: _ClassVar[int]
    ONNXRUNTIME_VERSION_FIELD_NUMBER: _ClassVar[int]
    stamp: _timestamp_pb2.Timestamp
    run_id: str
    project_version: str
    bundle_sha256: str
    target_color: str
    scene: str
    seed: int
    max_motions: int
    config_toml: str
    robot: str
    onnxruntime_version: str
    def __init__(self, stamp: _Optional[_Union[datetime.datetime, _timestamp_pb2.Timestamp, _Mapping]] = ..., run_id: _Optional[str] = ..., project_version: _Optional[str] = ..., bundle_sha256: _Optional[str] = ..., target_color: _Optional[str] = ..., scene: _Optional[str] = ..., seed: _Optional[int] = ..., max_motions: _Optional[int] = ..., config_toml: _Optional[str] = ..., robot: _Optional[str] = ..., onnxruntime_version: _Optional[str] = ...) -> None: ...

class Heightmaps(_message.Message):
    __slots__ = ("stamp", "step", "rows", "columns", "resolution", "origin", "color_png", "height_png", "labels_png", "classes")
    STAMP_FIELD_NUMBER: _ClassVar[int]
    STEP_FIELD_NUMBER: _ClassVar[int]
    ROWS_FIELD_NUMBER: _ClassVar[int]
    COLUMNS_FIELD_NUMBER: _ClassVar[int]
    RESOLUTION_FIELD_NUMBER: _ClassVar[int]
    ORIGIN_FIELD_NUMBER: _ClassVar[int]
    COLOR_PNG_FIELD_NUMBER: _ClassVar[int]
    HEIGHT_PNG_FIELD_NUMBER: _ClassVar[int]
    LABELS_PNG_FIELD_NUMBER: _ClassVar[int]
    CLASSES_FIELD_NUMBER: _ClassVar[int]
    stamp: _timestamp_pb2.Timestamp
    step: int
    rows: int
    columns: int
    resolution: float
    origin: Point
    color_png: bytes
    height_png: bytes
    labels_png: bytes
    classes: _containers.RepeatedScalarFieldContainer[str]
    def __init__(self, stamp: _Optional[_Union[datetime.datetime, _timestamp_pb2.Timestamp, _Mapping]] = ..., step: _Optional[int] = ..., rows: _Optional[int] = ..., columns: _Optional[int] = ..., resolution: _Optional[float] = ..., origin: _Optional[_Union[Point, _Mapping]] = ..., color_png: _Optional[bytes] = ..., height_png: _Optional[bytes] = ..., labels_png: _Optional[bytes] = ..., classes: _Optional[_Iterable[str]] = ...) -> None: ...

class QMaps(_message.Message):
    __slots__ = ("stamp", "step", "rotations", "rows", "columns", "push_min", "push_max", "grasp_min", "grasp_max", "push_png", "grasp_png", "push_levels")
    STAMP_FIELD_NUMBER: _ClassVar[int]
    STEP_FIELD_NUMBER: _ClassVar[int]
    ROTATIONS_FIELD_NUMBER: _ClassVar[int]
    ROWS_FIELD_NUMBER: _ClassVar[int]
    COLUMNS_FIELD_NUMBER: _ClassVar[int]
    PUSH_MIN_FIELD_NUMBER: _ClassVar[int]
    PUSH_MAX_FIELD_NUMBER: _ClassVar[int]
    GRASP_MIN_FIELD_NUMBER: _ClassVar[int]
    GRASP_MAX_FIELD_NUMBER: _ClassVar[int]
    PUSH_PNG_FIELD_NUMBER: _ClassVar[int]
    GRASP_PNG_FIELD_NUMBER: _ClassVar[int]
    PUSH_LEVELS_FIELD_NUMBER: _ClassVar[int]
    stamp: _timestamp_pb2.Timestamp
    step: int
    rotations: int
    rows: int
    columns: int
    push_min: float
    push_max: float
    grasp_min: float
    grasp_max: float
    push_png: bytes
    grasp_png: bytes
    push_levels: int
    def __init__(self, stamp: _Optional[_Union[datetime.datetime, _timestamp_pb2.Timestamp, _Mapping]] = ..., step: _Optional[int] = ..., rotations: _Optional[int] = ..., rows: _Optional[int] = ..., columns: _Optional[int] = ..., push_min: _Optional[float] = ..., push_max: _Optional[float] = ..., grasp_min: _Optional[float] = ..., grasp_max: _Optional[float] = ..., push_png: _Optional[bytes] = ..., grasp_png: _Optional[bytes] = ..., push_levels: _Optional[int] = ...) -> None: ...

class Place(_message.Message):
    __slots__ = ("x", "y")
    X_FIELD_NUMBER: _ClassVar[int]
    Y_FIELD_NUMBER: _ClassVar[int]
    x: float
    y: float
    def __init__(self, x: _Optional[float] = ..., y: _Optional[float] = ...) -> None: ...

class FruitlessAction(_message.Message):
    __slots__ = ("kind", "x", "y", "yaw", "push_level", "unchanged")
    KIND_FIELD_NUMBER: _ClassVar[int]
    X_FIELD_NUMBER: _ClassVar[int]
    Y_FIELD_NUMBER: _ClassVar[int]
    YAW_FIELD_NUMBER: _ClassVar[int]
    PUSH_LEVEL_FIELD_NUMBER: _ClassVar[int]
    UNCHANGED_FIELD_NUMBER: _ClassVar[int]
    kind: MotionKind
    x: float
    y: float
    yaw: float
    push_level: int
    unchanged: bool
    def __init__(self, kind: _Optional[_Union[MotionKind, str]] = ..., x: _Optional[float] = ..., y: _Optional[float] = ..., yaw: _Optional[float] = ..., push_level: _Optional[int] = ..., unchanged: _Optional[bool] = ...) -> None: ...

class DecisionMemory(_message.Message):
    __slots__ = ("failed_pushes", "consecutive_grasp_failures", "step", "fruitless", "consecutive_pushes", "last_seen", "last_motion")
    FAILED_PUSHES_FIELD_NUMBER: _ClassVar[int]
    CONSECUTIVE_GRASP_FAILURES_FIELD_NUMBER: _ClassVar[int]
    STEP_FIELD_NUMBER: _ClassVar[int]
    FRUITLESS_FIELD_NUMBER: _ClassVar[int]
    CONSECUTIVE_PUSHES_FIELD_NUMBER: _ClassVar[int]
    LAST_SEEN_FIELD_NUMBER: _ClassVar[int]
    LAST_MOTION_FIELD_NUMBER: _ClassVar[int]
    failed_pushes: _containers.RepeatedCompositeFieldContainer[Place]
    consecutive_grasp_failures: int
    step: int
    fruitless: _containers.RepeatedCompositeFieldContainer[FruitlessAction]
    consecutive_pushes: int
    last_seen: _containers.RepeatedCompositeFieldContainer[Place]
    last_motion: bool
    def __init__(self, failed_pushes: _Optional[_Iterable[_Union[Place, _Mapping]]] = ..., consecutive_grasp_failures: _Optional[int] = ..., step: _Optional[int] = ..., fruitless: _Optional[_Iterable[_Union[FruitlessAction, _Mapping]]] = ..., consecutive_pushes: _Optional[int] = ..., last_seen: _Optional[_Iterable[_Union[Place, _Mapping]]] = ..., last_motion: _Optional[bool] = ...) -> None: ...

class StageTime(_message.Message):
    __slots__ = ("stage", "milliseconds")
    STAGE_FIELD_NUMBER: _ClassVar[int]
    MILLISECONDS_FIELD_NUMBER: _ClassVar[int]
    stage: str
    milliseconds: float
    def __init__(self, stage: _Optional[str] = ..., milliseconds: _Optional[float] = ...) -> None: ...

class Decision(_message.Message):
    __slots__ = ("stamp", "frame_stamp", "step", "policy", "method", "kind", "rotation", "row", "column", "position", "yaw", "value", "q_push", "q_grasp", "border_ratio", "border_norm", "grasp_probability", "target_pixels", "memory", "seed", "why", "stages", "opening", "push_level")
    STAMP_FIELD_NUMBER: _ClassVar[int]
    FRAME_STAMP_FIELD_NUMBER: _ClassVar[int]
    STEP_FIELD_NUMBER: _ClassVar[int]
    POLICY_FIELD_NUMBER: _ClassVar[int]
    METHOD_FIELD_NUMBER: _ClassVar[int]
    KIND_FIELD_NUMBER: _ClassVar[int]
    ROTATION_FIELD_NUMBER: _ClassVar[int]
    ROW_FIELD_NUMBER: _ClassVar[int]
    COLUMN_FIELD_NUMBER: _ClassVar[int]
    POSITION_FIELD_NUMBER: _ClassVar[int]
    YAW_FIELD_NUMBER: _ClassVar[int]
    VALUE_FIELD_NUMBER: _ClassVar[int]
    Q_PUSH_FIELD_NUMBER: _ClassVar[int]
    Q_GRASP_FIELD_NUMBER: _ClassVar[int]
    BORDER_RATIO_FIELD_NUMBER: _ClassVar[int]
    BORDER_NORM_FIELD_NUMBER: _ClassVar[int]
    GRASP_PROBABILITY_FIELD_NUMBER: _ClassVar[int]
    TARGET_PIXELS_FIELD_NUMBER: _ClassVar[int]
    MEMORY_FIELD_NUMBER: _ClassVar[int]
    SEED_FIELD_NUMBER: _ClassVar[int]
    WHY_FIELD_NUMBER: _ClassVar[int]
    STAGES_FIELD_NUMBER: _ClassVar[int]
    OPENING_FIELD_NUMBER: _ClassVar[int]
    PUSH_LEVEL_FIELD_NUMBER: _ClassVar[int]
    stamp: _timestamp_pb2.Timestamp
    frame_stamp: _timestamp_pb2.Timestamp
    step: int
    policy: str
    method: str
    kind: MotionKind
    rotation: int
    row: int
    column: int
    position: Point
    yaw: float
    value: float
    q_push: float
    q_grasp: float
    border_ratio: float
    border_norm: float
    grasp_probability: float
    target_pixels: int
    memory: DecisionMemory
    seed: int
    why: str
    stages: _containers.RepeatedCompositeFieldContainer[StageTime]
    opening: float
    push_level: int
    def __init__(self, stamp: _Optional[_Union[datetime.datetime, _timestamp_pb2.Timestamp, _Mapping]] = ..., frame_stamp: _Optional[_Union[datetime.datetime, _timestamp_pb2.Timestamp, _Mapping]] = ..., step: _Optional[int] = ..., policy: _Optional[str] = ..., method: _Optional[str] = ..., kind: _Optional[_Union[MotionKind, str]] = ..., rotation: _Optional[int] = ..., row: _Optional[int] = ..., column: _Optional[int] = ..., position: _Optional[_Union[Point, _Mapping]] = ..., yaw: _Optional[float] = ..., value: _Optional[float] = ..., q_push: _Optional[float] = ..., q_grasp: _Optional[float] = ..., border_ratio: _Optional[float] = ..., border_norm: _Optional[float] = ..., grasp_probability: _Optional[float] = ..., target_pixels: _Optional[int] = ..., memory: _Optional[_Union[DecisionMemory, _Mapping]] = ..., seed: _Optional[int] = ..., why: _Optional[str] = ..., stages: _Optional[_Iterable[_Union[StageTime, _Mapping]]] = ..., opening: _Optional[float] = ..., push_level: _Optional[int] = ...) -> None: ...

class StepResult(_message.Message):
    __slots__ = ("stamp", "step", "command_id", "status", "scene_changed", "target_visible", "object_grasped", "target_grasped", "border_decrease", "detail")
    STAMP_FIELD_NUMBER: _ClassVar[int]
    STEP_FIELD_NUMBER: _ClassVar[int]
    COMMAND_ID_FIELD_NUMBER: _ClassVar[int]
    STATUS_FIELD_NUMBER: _ClassVar[int]
    SCENE_CHANGED_FIELD_NUMBER: _ClassVar[int]
    TARGET_VISIBLE_FIELD_NUMBER: _ClassVar[int]
    OBJECT_GRASPED_FIELD_NUMBER: _ClassVar[int]
    TARGET_GRASPED_FIELD_NUMBER: _ClassVar[int]
    BORDER_DECREASE_FIELD_NUMBER: _ClassVar[int]
    DETAIL_FIELD_NUMBER: _ClassVar[int]
    stamp: _timestamp_pb2.Timestamp
    step: int
    command_id: int
    status: MotionStatus
    scene_changed: bool
    target_visible: bool
    object_grasped: bool
    target_grasped: bool
    border_decrease: float
    detail: str
    def __init__(self, stamp: _Optional[_Union[datetime.datetime, _timestamp_pb2.Timestamp, _Mapping]] = ..., step: _Optional[int] = ..., command_id: _Optional[int] = ..., status: _Optional[_Union[MotionStatus, str]] = ..., scene_changed: _Optional[bool] = ..., target_visible: _Optional[bool] = ..., object_grasped: _Optional[bool] = ..., target_grasped: _Optional[bool] = ..., border_decrease: _Optional[float] = ..., detail: _Optional[str] = ...) -> None: ...

class RunSummary(_message.Message):
    __slots__ = ("stamp", "run_id", "grasped", "found", "motions", "decision_ms_p50", "decision_ms_p99", "dropped_messages", "ended_because", "lost_messages")
    STAMP_FIELD_NUMBER: _ClassVar[int]
    RUN_ID_FIELD_NUMBER: _ClassVar[int]
    GRASPED_FIELD_NUMBER: _ClassVar[int]
    FOUND_FIELD_NUMBER: _ClassVar[int]
    MOTIONS_FIELD_NUMBER: _ClassVar[int]
    DECISION_MS_P50_FIELD_NUMBER: _ClassVar[int]
    DECISION_MS_P99_FIELD_NUMBER: _ClassVar[int]
    DROPPED_MESSAGES_FIELD_NUMBER: _ClassVar[int]
    ENDED_BECAUSE_FIELD_NUMBER: _ClassVar[int]
    LOST_MESSAGES_FIELD_NUMBER: _ClassVar[int]
    stamp: _timestamp_pb2.Timestamp
    run_id: str
    grasped: bool
    found: bool
    motions: int
    decision_ms_p50: float
    decision_ms_p99: float
    dropped_messages: int
    ended_because: str
    lost_messages: int
    def __init__(self, stamp: _Optional[_Union[datetime.datetime, _timestamp_pb2.Timestamp, _Mapping]] = ..., run_id: _Optional[str] = ..., grasped: _Optional[bool] = ..., found: _Optional[bool] = ..., motions: _Optional[int] = ..., decision_ms_p50: _Optional[float] = ..., decision_ms_p99: _Optional[float] = ..., dropped_messages: _Optional[int] = ..., ended_because: _Optional[str] = ..., lost_messages: _Optional[int] = ...) -> None: ...
