import pytest

from grasping_invisible.data.command import run_command
from grasping_invisible.data.errors import BadLog


def test_an_error_that_quotes_a_log_stays_one_harmless_line(capsys: pytest.CaptureFixture[str]) -> None:
    def body() -> int:
        raise BadLog("run \x1b[31m\n\r\0 of a  b.mcap, für immer")

    assert run_command("gi-log", body) == 2
    assert capsys.readouterr().err == "gi-log: run \\x1b[31m  \\x00 of a  b.mcap, für immer\n"


def test_an_interruption_is_explained(capsys: pytest.CaptureFixture[str]) -> None:
    def body() -> int:
        raise KeyboardInterrupt

    assert run_command("gi-dataset", body, "interrupted; go on") == 130
    assert capsys.readouterr().err == "gi-dataset: interrupted; go on\n"
