"""The one table of everything that is said: key, message type, rate, who says it, whether it is kept.

A topic's zenoh key and its MCAP channel have the same name, and the bytes that travelled are the
bytes that are kept.
"""

from dataclasses import dataclass
from enum import Enum

from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf.message import Message

from grasping_invisible.data.proto import grasping_invisible_pb2 as gi

PROTOCOL_VERSION = 1


class Speaker(Enum):
    """Which side of the link publishes a topic."""

    ROBOT = "robot"
    RUNTIME = "runtime"


class Pattern(Enum):
    """How a topic travels: published to whoever listens, or asked for and answered."""

    PUBLISH = "publish"
    REQUEST = "request"


@dataclass(frozen=True)
class Topic:
    """One key expression and what travels under it."""

    key: str
    message: type[Message]
    speaker: Speaker
    rate: str
    about: str
    pattern: Pattern = Pattern.PUBLISH
    logged: bool = True


COLOR_IMAGE = Topic("gi/robot/camera/color", CompressedImage, Speaker.ROBOT, "camera rate", "colour image, PNG or JPEG")
DEPTH_IMAGE = Topic(
    "gi/robot/camera/depth",
    RawImage,
    Speaker.ROBOT,
    "camera rate",
    "depth registered to colour, 16UC1, millimetres, 0 is no reading; same stamp as its colour image",
)
CAMERA_INFO = Topic(
    "gi/robot/camera/info",
    CameraCalibration,
    Speaker.ROBOT,
    "camera rate",
    "intrinsics of the colour camera",
)
TRANSFORMS = Topic(
    "gi/robot/tf",
    FrameTransforms,
    Speaker.ROBOT,
    "camera rate",
    "panda_link0 to the camera's optical frame and to every link",
)
JOINTS = Topic(
    "gi/robot/joints",
    JointStates,
    Speaker.ROBOT,
    "camera rate",
    "positions and velocities of arm and fingers",
)
ROBOT_HEALTH = Topic("gi/robot/health", gi.RobotHealth, Speaker.ROBOT, "10 Hz", "the robot's heartbeat")
OUTCOME = Topic("gi/robot/outcome", gi.MotionOutcome, Speaker.ROBOT, "per motion", "how a motion ended")
TRUTH = Topic(
    "gi/robot/truth",
    gi.TruthState,
    Speaker.ROBOT,
    "with every still camera frame",
    "simulator only: where everything really is; never read by a decision",
)
COMMAND = Topic(
    "gi/robot/command",
    gi.MotionCommand,
    Speaker.RUNTIME,
    "per motion",
    "a motion to carry out",
    pattern=Pattern.REQUEST,
)
COMMAND_REPLY = Topic(
    "gi/robot/command/reply",
    gi.CommandReply,
    Speaker.ROBOT,
    "per motion",
    "the answer to a command's request; kept under this name in the log",
    pattern=Pattern.REQUEST,
)
STOP = Topic("gi/robot/stop", gi.StopRequest, Speaker.RUNTIME, "when needed", "stop now and stand still safely")
RUNTIME_HEALTH = Topic("gi/runtime/health", gi.RuntimeHealth, Speaker.RUNTIME, "10 Hz", "the runtime's heartbeat")
RUN_START = Topic("gi/runtime/start", gi.RunStart, Speaker.RUNTIME, "once", "what this run is")
HEIGHTMAPS = Topic(
    "gi/runtime/heightmaps",
    gi.Heightmaps,
    Speaker.RUNTIME,
    "per decision, and of what the last motion led to",
    "colour, height and class heightmaps",
)
SEGMENTATION = Topic(
    "gi/runtime/segmentation",
    CompressedImage,
    Speaker.RUNTIME,
    "per decision, and of what the last motion led to",
    "class index of every camera pixel, 8-bit PNG",
)
Q_MAPS = Topic("gi/runtime/q_maps", gi.QMaps, Speaker.RUNTIME, "per decision", "push and grasp Q maps")
DECISION = Topic("gi/runtime/decision", gi.Decision, Speaker.RUNTIME, "per decision", "what was chosen and why")
VIEW = Topic(
    "gi/runtime/view",
    CompressedImage,
    Speaker.RUNTIME,
    "per decision",
    "a picture of the decision: camera view, heightmap, chosen Q map with the action drawn in, JPEG",
)
MARKERS = Topic(
    "gi/runtime/markers",
    SceneUpdate,
    Speaker.RUNTIME,
    "per decision",
    "workspace and chosen action, for a 3-D panel",
)
STEP_RESULT = Topic("gi/runtime/result", gi.StepResult, Speaker.RUNTIME, "per motion", "what came of a step")
CONSOLE = Topic("gi/runtime/console", Log, Speaker.RUNTIME, "when said", "the lines a person saw")
RUN_SUMMARY = Topic("gi/runtime/summary", gi.RunSummary, Speaker.RUNTIME, "once", "how the run ended")

TOPICS: tuple[Topic, ...] = (
    COLOR_IMAGE,
    DEPTH_IMAGE,
    CAMERA_INFO,
    TRANSFORMS,
    JOINTS,
    ROBOT_HEALTH,
    OUTCOME,
    TRUTH,
    COMMAND,
    COMMAND_REPLY,
    STOP,
    RUNTIME_HEALTH,
    RUN_START,
    HEIGHTMAPS,
    SEGMENTATION,
    Q_MAPS,
    DECISION,
    VIEW,
    MARKERS,
    STEP_RESULT,
    CONSOLE,
    RUN_SUMMARY,
)
BY_KEY: dict[str, Topic] = {topic.key: topic for topic in TOPICS}

# Liveliness token of a robot; it vanishes within milliseconds of the robot's process ending.
ROBOT_TOKEN = "gi/robot/alive"
RUNTIME_TOKEN = "gi/runtime/alive"
