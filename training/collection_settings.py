"""`collection.json`: how the logs beside it were collected, so that none of other settings come among them."""

import os
from pathlib import Path

import msgspec

from grasping_invisible.runtime.errors import BadInput

FILE_NAME = "collection.json"


class CollectionSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What decides, with a scene's number, what is in its log; see `Collection`. `bundle_sha256`: None is no bundle."""

    stage: int
    branch: bool
    epsilon: float
    on_policy: bool
    motions: int
    bundle_sha256: str | None


def keep_settings(folder: Path, settings: CollectionSettings) -> None:
    """Note the settings of a folder of logs where none are noted yet. Raises `BadInput` where others are."""
    path = folder / FILE_NAME
    try:
        known = msgspec.json.decode(path.read_bytes(), type=CollectionSettings)
    except FileNotFoundError:
        _write(path, settings)
        return
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise BadInput(f"{path} is not what gi-collect writes: {error}; give --out another folder") from None
    if known != settings:
        raise BadInput(f"{folder} was collected with {_differences(known, settings)}; give --out another folder")


def _differences(known: CollectionSettings, settings: CollectionSettings) -> str:
    return ", ".join(
        f"{name} {_shown(theirs)} instead of {_shown(ours)}"
        for name in CollectionSettings.__struct_fields__
        if (theirs := getattr(known, name)) != (ours := getattr(settings, name))
    )


def _shown(value: str | float | None) -> str:
    return value[:12] if isinstance(value, str) else msgspec.json.encode(value).decode()


def _write(path: Path, settings: CollectionSettings) -> None:
    unfinished = path.with_name(f".{path.name}.{os.getpid()}")  # two collections may begin at once, with other seeds
    unfinished.write_bytes(msgspec.json.format(msgspec.json.encode(settings)) + b"\n")
    os.replace(unfinished, path)
