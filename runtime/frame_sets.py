"""Puts colour, depth, calibration and transforms that were published apart back together, by their stamp."""

from collections import OrderedDict
from dataclasses import dataclass

from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from google.protobuf.message import DecodeError, Message

from grasping_invisible.data.calibration_message import decode_calibration, encode_calibration
from grasping_invisible.data.clock import to_ns
from grasping_invisible.data.errors import BadMessage
from grasping_invisible.data.images import CAMERA_FRAME, decode_color, decode_depth, encode_color, encode_depth
from grasping_invisible.data.topics import CAMERA_INFO, COLOR_IMAGE, DEPTH_IMAGE, TRANSFORMS, Topic
from grasping_invisible.data.transform_message import decode_transform, latest_stamp
from grasping_invisible.runtime.errors import RobotError
from grasping_invisible.runtime.frame import Camera, RgbdFrame

CAMERA_TOPICS = (COLOR_IMAGE, DEPTH_IMAGE, CAMERA_INFO, TRANSFORMS)
_KEPT = 32  # stamps; a set that is not complete by then has lost a part


@dataclass
class FrameParts:
    """What has come of one camera frame so far."""

    color: CompressedImage | None = None
    depth: RawImage | None = None
    info: CameraCalibration | None = None
    transforms: FrameTransforms | None = None

    @classmethod
    def of(cls, frame: RgbdFrame, transforms: FrameTransforms) -> "FrameParts":
        """What a robot sends of a frame, all with its stamp; `transforms` are those of its links at that time."""
        camera, stamp = frame.camera, frame.stamp_ns
        return cls(
            encode_color(frame.color, stamp),
            encode_depth(frame.depth, stamp),
            encode_calibration(camera.intrinsics, camera.width, camera.height, stamp),
            transforms,
        )

    @property
    def messages(self) -> dict[Topic, Message]:
        """The parts that have come, by topic."""
        parts = (self.color, self.depth, self.info, self.transforms)
        return {topic: part for topic, part in zip(CAMERA_TOPICS, parts, strict=True) if part is not None}

    @property
    def missing(self) -> list[str]:
        """Topics that have not come yet."""
        messages = self.messages
        return [topic.key for topic in CAMERA_TOPICS if topic not in messages]

    def decode(self) -> RgbdFrame:
        """The frame, once complete. Raises `RobotError` when its parts are damaged or do not fit together."""
        if self.color is None or self.depth is None or self.info is None or self.transforms is None:
            raise RobotError(f"the camera frame lacks {', '.join(self.missing)}")
        try:
            color, depth = decode_color(self.color), decode_depth(self.depth)
            intrinsics = decode_calibration(self.info)
            base_from_camera = decode_transform(self.transforms, CAMERA_FRAME)
        except BadMessage as error:
            raise RobotError(f"the robot sent a camera frame that cannot be used: {error}") from error
        height, width = color.shape[:2]
        for what, shape in (("depth", depth.shape), ("calibration", (self.info.height, self.info.width))):
            if shape != (height, width):
                raise RobotError(f"colour is {width} x {height} but {what} is {shape[1]} x {shape[0]}")
        camera = Camera(width, height, intrinsics, base_from_camera)
        return RgbdFrame(to_ns(self.color.timestamp), color, depth, camera)


class FrameSets:
    """The most recent camera frames, complete or still arriving. Not safe across threads."""

    def __init__(self) -> None:
        self._sets: OrderedDict[int, FrameParts] = OrderedDict()

    def add(self, topic: Topic, payload: bytes) -> None:
        """Take in a message; one of another topic, or damaged, is left out and its set stays incomplete."""
        try:
            if topic is COLOR_IMAGE:
                color = CompressedImage.FromString(payload)
                self._at(to_ns(color.timestamp)).color = color
            elif topic is DEPTH_IMAGE:
                depth = RawImage.FromString(payload)
                self._at(to_ns(depth.timestamp)).depth = depth
            elif topic is CAMERA_INFO:
                info = CameraCalibration.FromString(payload)
                self._at(to_ns(info.timestamp)).info = info
            elif topic is TRANSFORMS:
                message = FrameTransforms.FromString(payload)
                stamp = latest_stamp(message)
                if stamp is not None:
                    self._at(stamp).transforms = message
        except DecodeError:
            return

    def forget(self) -> None:
        """Leave out all that has come so far."""
        self._sets.clear()

    def first_since(self, stamp_ns: int) -> FrameParts | None:
        """The earliest complete set stamped at or after `stamp_ns`; None if there is none yet."""
        complete = [stamp for stamp, parts in self._sets.items() if stamp >= stamp_ns and not parts.missing]
        return self._sets[min(complete)] if complete else None

    def missing_since(self, stamp_ns: int) -> list[str]:
        """What the fullest set stamped at or after `stamp_ns` lacks; all topics if there is no such set."""
        candidates = [parts.missing for stamp, parts in self._sets.items() if stamp >= stamp_ns]
        return min(candidates, key=len, default=FrameParts().missing)

    def _at(self, stamp_ns: int) -> FrameParts:
        parts = self._sets.setdefault(stamp_ns, FrameParts())
        while len(self._sets) > _KEPT:
            self._sets.popitem(last=False)
        return parts
