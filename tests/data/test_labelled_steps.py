import numpy as np

from grasping_invisible.data.labelled_steps import labelled_steps
from grasping_invisible.data.png import encode_png
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi


def test_times_in_another_age_are_no_reason_to_fail(write_run, run_of) -> None:
    messages = run_of()
    for _, message in messages:
        if isinstance(message, gi.Heightmaps):
            message.stamp.seconds, message.stamp.nanos = -(1 << 62), -5
    assert len(list(labelled_steps(write_run(messages=messages)))) == 3


def test_other_labels_of_one_frame_are_other_maps(practice, record, tmp_path) -> None:
    """Motions for two targets tried from one state have its frame, each without its own target's speckle."""
    first, second = practice("a", 0, steps=1), practice("b", 0, steps=1)
    for _, message in second:
        if isinstance(message, gi.Heightmaps):
            message.labels_png = encode_png(np.zeros((224, 224), np.uint8))
    record(tmp_path / "two.mcap", [*first, *second])
    goals = [[goal.goal for goal in item.label.goals] for item in labelled_steps(tmp_path / "two.mcap")]
    assert goals == [["red"], []]
