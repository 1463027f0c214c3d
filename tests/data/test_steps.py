from grasping_invisible.data import topics
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi
from grasping_invisible.data.recorder import RecordingSettings
from grasping_invisible.data.steps import steps


def test_each_step_has_what_belongs_to_it(write_run) -> None:
    first, second, third = steps(write_run())
    for number, step in enumerate((first, second, third)):
        assert step.start is not None
        assert step.start.run_id == "run-1"
        assert step.decision.step == number
        assert step.heightmaps is not None
        assert step.heightmaps.step == number
        assert step.q_maps is not None
        assert step.q_maps.step == number
        assert step.command is not None
        assert step.outcome is not None
        assert step.command.id == step.outcome.command_id == 10 + number
        assert step.result is not None
        assert step.result.step == number
        assert step.truth is not None
        assert step.truth.stamp == step.decision.frame_stamp
    assert first.next_heightmaps == second.heightmaps
    assert first.next_truth == second.truth
    assert third.next_heightmaps is None


def test_motions_that_nobody_decided_on_belong_to_no_step(write_run) -> None:
    messages = [
        (topics.COMMAND, gi.MotionCommand(id=1, kind=gi.HOME)),
        (topics.OUTCOME, gi.MotionOutcome(command_id=1)),
        (topics.DECISION, gi.Decision(step=0, kind=gi.GRASP)),
        (topics.COMMAND, gi.MotionCommand(id=2, kind=gi.GRASP)),
        (topics.OUTCOME, gi.MotionOutcome(command_id=2)),
        (topics.COMMAND, gi.MotionCommand(id=3, kind=gi.PLACE)),
        (topics.OUTCOME, gi.MotionOutcome(command_id=3)),
    ]
    [step] = steps(write_run(messages=messages))
    assert step.command is not None
    assert step.outcome is not None
    assert step.command.id == step.outcome.command_id == 2


def test_a_cut_log_gives_the_steps_it_holds(write_run) -> None:
    path = write_run(settings=RecordingSettings(flush_seconds=0.0))
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 3])
    found = list(steps(path))
    assert [step.decision.step for step in found] == list(range(len(found)))
    assert len(found) < 3


def test_a_run_goes_on_over_the_parts_of_its_log(write_run) -> None:
    path = write_run(steps=12, settings=RecordingSettings(part_bytes=20_000, flush_seconds=0.0))
    assert path.with_name("run.001.mcap").exists()
    found = list(steps(path))
    assert [step.decision.step for step in found] == list(range(12))
    assert all(step.next_heightmaps is not None for step in found[:-1])


def test_of_a_run_whose_start_is_lost_nothing_counts_for_the_one_before(practice, record, tmp_path) -> None:
    """Branched collections hold one run after another, and each begins with step 0 again."""
    first, second = practice("a", 0, steps=1)[:-1], practice("b", 0, steps=1, started_ns=1_800_000_000_000_000_000)
    summary = (topics.RUN_SUMMARY, gi.RunSummary(run_id="a", motions=1))
    lost = [(topic, message) for topic, message in second if topic is not topics.RUN_START]
    for between in ([summary], []):
        path = tmp_path / f"{len(between)}.mcap"
        record(path, [*first, *between, *lost])
        one, other = steps(path)
        assert one.start is not None
        assert (one.start.run_id, other.start) == ("a", None)
        assert one.heightmaps == first[1][1]
        assert one.next_heightmaps is None
        assert other.decision == next(message for topic, message in second if topic is topics.DECISION)


def test_what_a_step_led_to_is_not_what_the_one_after_the_next_began_with(practice, record, tmp_path) -> None:
    left = [
        (topic, message)
        for topic, message in practice("a", 0, steps=3)
        if not isinstance(message, gi.Heightmaps | gi.Decision) or message.step != 1
    ]
    record(tmp_path / "a.mcap", left)
    first, third = steps(tmp_path / "a.mcap")
    assert (first.decision.step, third.decision.step) == (0, 2)
    assert first.heightmaps is not None
    assert first.next_heightmaps is None
