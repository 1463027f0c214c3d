"""What the documents promise is there: files, commands, verbs and exit codes."""

import io
import re
import sys
import tomllib
from contextlib import redirect_stdout
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path

import pytest

from grasping_invisible.runtime import errors

PROJECT = Path(__file__).parents[1]
DOCUMENTS = [*sorted(PROJECT.glob("*.md")), *sorted((PROJECT / "docs").rglob("*.md"))]
COMMANDS = tomllib.loads((PROJECT / "pyproject.toml").read_text())["project"]["scripts"]


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_links_lead_somewhere(document: Path) -> None:
    targets = re.findall(r"\]\(([^)#]+)", document.read_text())
    assert [link for link in targets if "://" not in link and not (document.parent / link).exists()] == []


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_commands_and_verbs_exist(document: Path) -> None:
    text = document.read_text()
    verbs = set(re.findall(r"^([a-z]+):", (PROJECT / "Makefile").read_text(), flags=re.MULTILINE))
    assert set(re.findall(r"`(?:\.venv/bin/)?(gi-[a-z-]+)", text)) - set(COMMANDS) == set()
    assert set(re.findall(r"(?:^    |`)make ([a-z]+)", text, flags=re.MULTILINE)) - verbs == set()


@cache
def help_of(*command: str) -> str:
    """What a command, or a command and its subcommand, says of its options."""
    (main,) = entry_points(group="console_scripts", name=command[0])
    said = io.StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(said):
        patch.setattr(sys, "argv", [*command, "--help"])
        with pytest.raises(SystemExit) as end:
            main.load()()
    assert end.value.code in (0, None)
    return said.getvalue()


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_options_exist(document: Path) -> None:
    for line in re.findall(r"(?:^    |`)(?:\.venv/bin/)?(gi-[^`\n#]+)", document.read_text(), re.MULTILINE):
        command, *rest = line.split()
        subcommand = [rest[0]] if rest and re.fullmatch("[a-z]+", rest[0]) else []
        known = set(re.findall(r"--[a-z-]+", help_of(command, *subcommand)))
        assert set(re.findall(r"(?<=\s)--[a-z-]+", line)) - known == set(), line


def first_column(pattern: str) -> list[str]:
    """What stands in the first cells of the README's tables, where it matches."""
    return re.findall(rf"^\| {pattern} \|", (PROJECT / "README.md").read_text(), re.MULTILINE)


def test_readme_lists_every_command() -> None:
    assert set(first_column("`(gi-[a-z-]+)`")) == set(COMMANDS)


def test_readme_lists_the_exit_codes() -> None:
    codes = {value for name, value in vars(errors).items() if name.startswith("EXIT_")}
    assert {int(code) for code in first_column(r"(\d+)")} == codes
