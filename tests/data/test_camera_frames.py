from pathlib import Path

from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms

from grasping_invisible.data.camera_frames import camera_frames
from grasping_invisible.data.clock import to_timestamp
from grasping_invisible.data.recorder import RecordingSettings
from grasping_invisible.data.topics import CAMERA_INFO, COLOR_IMAGE, DEPTH_IMAGE, TRANSFORMS

START_NS = 1_700_000_000_000_000_000
SECOND = 1_000_000_000


def test_frames_with_the_stamps_asked_for(write_run) -> None:
    wanted = {START_NS, START_NS + 2 * SECOND, 5}
    frames = list(camera_frames(write_run(steps=4), wanted, (COLOR_IMAGE, DEPTH_IMAGE)))
    assert [frame.stamp_ns for frame in frames] == [START_NS, START_NS + 2 * SECOND]
    assert all(set(frame.messages) == {COLOR_IMAGE.key, DEPTH_IMAGE.key} for frame in frames)


def test_an_incomplete_frame_comes_at_the_end(write_run) -> None:
    (frame,) = camera_frames(write_run(), {START_NS}, (COLOR_IMAGE, CAMERA_INFO))
    assert set(frame.messages) == {COLOR_IMAGE.key}


def test_frames_over_all_parts(write_run, tmp_path: Path) -> None:
    path = write_run(steps=12, settings=RecordingSettings(part_bytes=20_000, flush_seconds=0.0))
    assert (tmp_path / "run.001.mcap").exists()
    stamps = {START_NS + step * SECOND for step in range(12)}
    assert {frame.stamp_ns for frame in camera_frames(path, stamps, (COLOR_IMAGE, DEPTH_IMAGE))} == stamps


def test_of_several_transforms_the_latest_counts(write_run) -> None:
    """A camera that stands still may be stamped once and for all."""
    stamps = START_NS - SECOND, START_NS
    poses = FrameTransforms(transforms=[FrameTransform(timestamp=to_timestamp(stamp)) for stamp in stamps])
    (frame,) = camera_frames(write_run(messages=[(TRANSFORMS, poses)]), {START_NS}, (TRANSFORMS,))
    assert frame.messages[TRANSFORMS.key] == poses
