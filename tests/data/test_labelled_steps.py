from grasping_invisible.data.labelled_steps import labelled_steps
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi


def test_times_in_another_age_are_no_reason_to_fail(write_run, run_of) -> None:
    messages = run_of()
    for _, message in messages:
        if isinstance(message, gi.Heightmaps):
            message.stamp.seconds, message.stamp.nanos = -(1 << 62), -5
    assert len(list(labelled_steps(write_run(messages=messages)))) == 3
