"""The config file: a TOML table for each part of the runtime. docs/configuration.md lists every key."""

import math
import tomllib
from pathlib import Path
from typing import Annotated, Any

import msgspec

from grasping_invisible.data.recorder import RecordingSettings
from grasping_invisible.data.run_names import COORDINATOR, EXPLORER
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.runtime.link_settings import LinkSettings
from grasping_invisible.runtime.methods import COORDINATION, EXPLORATION
from grasping_invisible.runtime.onnx_model import DEFAULT_THREADS
from grasping_invisible.runtime.safety import SafetyLimits
from grasping_invisible.runtime.workspace import Workspace


class WorkspaceSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Where the clutter lies: the middle of a square on the table top, base frame, and its cells, metres.

    The square's size goes with the models and cannot be set.
    """

    center: tuple[float, float, float] = Workspace().center

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, self.center)):
            raise ValueError(f"center {list(self.center)} must be finite")

    def workspace(self) -> Workspace:
        """The workspace itself."""
        return Workspace(center=self.center)


class PolicySettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Names of the methods to search by and to coordinate by."""

    exploration: str = EXPLORER
    coordination: str = COORDINATOR

    def __post_init__(self) -> None:
        for name, value, known in (
            ("exploration", self.exploration, EXPLORATION),
            ("coordination", self.coordination, COORDINATION),
        ):
            if value not in known:
                raise ValueError(f"{name} {value!r} is unknown; known: {', '.join(known)}")


class ModelSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How the models are run."""

    threads: Annotated[int, msgspec.Meta(ge=1, le=256)] = DEFAULT_THREADS


class Config(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Everything that can be set; each section's defaults are written where the section is used."""

    link: LinkSettings = LinkSettings()
    workspace: WorkspaceSettings = WorkspaceSettings()
    safety: SafetyLimits = SafetyLimits()
    policy: PolicySettings = PolicySettings()
    models: ModelSettings = ModelSettings()
    recording: RecordingSettings = RecordingSettings()


def load_config(path: Path) -> Config:
    """Read a config file. Raises `BadInput` naming the file, the key, and the keys there are."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
        raise BadInput(f"config {path} cannot be read: {reason}") from error
    return parse_config(text, f"config {path}")


def parse_config(text: str, origin: str) -> Config:
    """The config that a TOML text says. Raises `BadInput` that begins with `origin`, such as the file's name."""
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise BadInput(f"{origin} is not TOML: {error}") from error
    _refuse_unknown(table, origin)
    try:
        return msgspec.convert(table, Config)
    except msgspec.ValidationError as error:
        raise BadInput(f"{origin}: {error}") from error


def to_toml(config: Config) -> str:
    """The whole effective configuration, as a config file that says the same."""
    lines: list[str] = []
    for section, values in msgspec.to_builtins(config).items():
        lines.append(f"[{section}]")
        # A JSON string, number or array is a TOML one too; an absent limit is an absent key.
        lines += [
            f"{key} = {msgspec.json.encode(value).decode()}" for key, value in values.items() if value is not None
        ]
        lines.append("")
    return "\n".join(lines)


def _refuse_unknown(table: dict[str, Any], origin: str) -> None:
    """msgspec names the unknown key, but not those that are known."""
    sections = {field.name: field.type for field in msgspec.structs.fields(Config)}
    for section, values in table.items():
        if section not in sections:
            raise BadInput(f"{origin}: unknown section [{section}]; known: {', '.join(sections)}")
        keys = [field.name for field in msgspec.structs.fields(sections[section])]
        for key in values if isinstance(values, dict) else ():
            if key not in keys:
                raise BadInput(f"{origin}: unknown key {key!r} in [{section}]; known: {', '.join(keys)}")
