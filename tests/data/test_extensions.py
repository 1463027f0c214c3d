from importlib.metadata import EntryPoint
from typing import Any

import pytest

from grasping_invisible.data import extensions as module
from grasping_invisible.data.cli import main
from grasping_invisible.data.extensions import LOG_COMMANDS, extensions

GOOD = EntryPoint("show-again", "grasping_invisible.data.log_commands.show", LOG_COMMANDS)
BROKEN = EntryPoint("broken", "grasping_invisible.nowhere", LOG_COMMANDS)


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Two contributions, one that cannot be loaded; the groups that were asked for."""
    asked = []

    def entry_points(group: str) -> list[Any]:
        asked.append(group)
        return [GOOD, BROKEN]

    monkeypatch.setattr(module, "entry_points", entry_points)
    return asked


def test_a_broken_one_says_why_and_harms_no_other(installed: list[str]) -> None:
    broken, good = extensions(LOG_COMMANDS)
    assert (broken.name, broken.loaded) == ("broken", None)
    assert broken.failure == "No module named 'grasping_invisible.nowhere'"
    assert (good.name, good.failure) == ("show-again", "")
    assert callable(good.loaded.register)


def test_a_known_command_looks_for_no_others(installed: list[str], write_run) -> None:
    assert main(["show", str(write_run())]) == 0
    assert installed == []


def test_a_broken_command_is_one_line_and_code_2(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(module, "entry_points", lambda group: [BROKEN])
    assert main(["broken", "run.mcap"]) == 2
    assert capsys.readouterr().err == (
        "gi-log: broken cannot be used here: No module named 'grasping_invisible.nowhere'\n"
    )
    with pytest.raises(SystemExit, match="0"):
        main(["--help"])
    assert "broken" in capsys.readouterr().out
