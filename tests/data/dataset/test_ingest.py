from pathlib import Path

from grasping_invisible.data.dataset.cli import main
from grasping_invisible.data.proto import grasping_invisible_pb2 as gi


def test_a_number_out_of_all_range_leaves_its_log_out(write_run, run_of, tmp_path: Path, capsys) -> None:
    messages = run_of()
    for _, message in messages:
        if isinstance(message, gi.RunStart):
            message.stamp.seconds = 1 << 62
    logs = [write_run("another_age.mcap", messages=messages), write_run("sound.mcap")]
    assert main(["rebuild", *map(str, logs), "--out", str(tmp_path / "dataset"), "--workers", "1"]) == 0
    said = capsys.readouterr().out
    assert "left out: another_age.mcap: a number in it is out of all range" in said
    assert "1 logs left out" in said
