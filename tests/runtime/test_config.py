from pathlib import Path

import msgspec
import pytest

from grasping_invisible.runtime.config import Config, load_config, to_toml
from grasping_invisible.runtime.errors import BadInput

DOCUMENT = Path(__file__).parents[2] / "docs" / "configuration.md"


def loaded(tmp_path: Path, text: str) -> Config:
    path = tmp_path / "config.toml"
    path.write_text(text)
    return load_config(path)


def test_an_empty_file_is_the_defaults(tmp_path: Path) -> None:
    assert loaded(tmp_path, "") == Config()


def test_what_is_set_is_set_and_the_rest_stays(tmp_path: Path) -> None:
    config = loaded(tmp_path, "[link]\nmotion_seconds = 20\n[workspace]\ncenter = [0.4, 0.1, 0.0]\n")
    assert config.link.motion_seconds == 20.0
    assert config.link.reply_seconds == Config().link.reply_seconds
    assert config.workspace.workspace().center == (0.4, 0.1, 0.0)


def test_the_written_configuration_reads_back_the_same(tmp_path: Path) -> None:
    config = loaded(tmp_path, "[recording]\npart_bytes = 1000000\n[policy]\nexploration = 'clutter-prior'\n")
    assert loaded(tmp_path, to_toml(config)) == config


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("[links]", r"unknown section \[links\]; known: link, workspace"),
        ("[link]\nmotion = 3", r"unknown key 'motion' in \[link\]; known: connect_seconds"),
        ("[link]\nmotion_seconds = 'long'", "link.motion_seconds"),
        ("[link]\nmotion_seconds = -1", "link.motion_seconds"),
        ("link = 3", "link"),
        ("[models]\nthreads = 0", "models.threads"),
        ("[policy]\nexploration = 'luck'", "'luck' is unknown; known: explorer"),
        ("[safety]\nmin_height = 0.3", r"min_height 0\.3 must be below max_height 0\.25"),
        ("[safety]\nmax_push_length = 0", "max_push_length 0 forbids all pushes"),
        ("[recording]\nflush_seconds = 1e300", "recording.flush_seconds"),
        ("[recording]\nqueue_bytes = 0", "recording.queue_bytes"),
        ("[recording]\npart_bytes = -1", "recording.part_bytes"),
        ("[recording]\npart_seconds = inf", "recording.part_seconds"),
        ("[workspace]\ncenter = [nan, 0.0, 0.0]", "must be finite"),
        ("[link", "not TOML"),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, text: str, complaint: str) -> None:
    with pytest.raises(BadInput, match=complaint):
        loaded(tmp_path, text)


def test_a_missing_or_binary_file_is_bad_input(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="No such file"):
        load_config(tmp_path / "nowhere.toml")
    (tmp_path / "image.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(BadInput, match="UTF-8"):
        load_config(tmp_path / "image.toml")


def test_the_document_has_every_key_and_its_default() -> None:
    text = DOCUMENT.read_text(encoding="utf-8")
    for section in msgspec.structs.fields(Config):
        assert f"## `[{section.name}]`" in text
        for key in msgspec.structs.fields(section.type):
            value = msgspec.to_builtins(getattr(getattr(Config(), section.name), key.name))
            default = "none" if value is None else f"`{msgspec.json.encode(value).decode()}`"
            assert f"| `{key.name}` | {default} |" in text, f"[{section.name}] {key.name} = {default}"
