"""Scene files: which objects lie where on the table, and which of them is wanted.

Positions are in the workspace frame: origin at the workspace's centre on the table top, axes parallel to the
robot's base frame, metres, z up. docs/scenes.md describes the file for people who write one.
"""

import json
import math
import os
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np

from grasping_invisible.data.classes import GREY, TARGET_COLORS
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.runtime.safety import MAX_MOTIONS
from grasping_invisible.runtime.workspace import Workspace
from grasping_invisible.sim_robot.blocks import BLOCKS, Vector

Task = Literal["exploration", "coordination", "invisible", "free"]
COLORS: tuple[str, ...] = (GREY, *TARGET_COLORS)
MAX_HEIGHT = 0.5  # metres above the table at which an object may start
FRAME_REACH = 0.4  # metres from the middle of a mesh at which its own frame may be
MAX_OBJECTS = 60
SCALE_LIMITS = (1e-6, 1e3)
MASS_LIMITS = (1e-3, 10.0)  # kg
FRICTION_LIMITS = (0.01, 2.0)
WHOLE_TASK_MOTIONS = 15  # to find a hidden target and to grasp it (paper, section VII-C)


class SceneObject(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One object: a built-in block or a mesh, its colour, and its pose in the workspace frame.

    `position`: of the object's own origin, metres; that of a mesh may lie outside the workspace. The orientation
    is `quaternion_xyzw` (object to workspace) or `yaw` (radians about z) or neither. `mass` (kg) and `friction`
    (coefficient against its own kind) are the world's defaults where absent. `scale` multiplies a mesh's lengths into
    metres.
    """

    shape: str | None = None
    mesh: str | None = None
    scale: float = 1.0
    color: str = GREY
    position: tuple[float, float, float]
    quaternion_xyzw: tuple[float, float, float, float] | None = None
    yaw: float | None = None
    mass: float | None = None
    friction: float | None = None

    def __post_init__(self) -> None:
        _check_what(self)
        _check_pose(self)
        for field, value, (low, high) in (
            ("scale", self.scale, SCALE_LIMITS),
            ("mass", self.mass, MASS_LIMITS),
            ("friction", self.friction, FRICTION_LIMITS),
        ):
            if value is not None and not low <= value <= high:
                raise ValueError(f"{field} must lie within {low:g} and {high:g}, not {value}")

    @property
    def quaternion(self) -> tuple[float, float, float, float]:
        """Orientation (x, y, z, w), unit length, object to workspace frame."""
        if self.quaternion_xyzw is None:
            half = 0.5 * (self.yaw or 0.0)
            return (0.0, 0.0, math.sin(half), math.cos(half))
        norm = math.hypot(*self.quaternion_xyzw)
        x, y, z, w = (value / norm for value in self.quaternion_xyzw)
        return (x, y, z, w)

    @property
    def kind(self) -> str:
        """The block's name, or the mesh file's name without its ending."""
        return self.shape if self.shape is not None else Path(self.mesh or "").stem


class Scene(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A task: objects on the table and the colour of the one to find and grasp.

    `clusters` is the number of piles an explorer would have to look into (paper, section VII-A), where known.
    """

    name: str
    task: Task = "free"
    target: str
    max_motions: int = 15
    clusters: int | None = None
    objects: tuple[SceneObject, ...]

    def __post_init__(self) -> None:
        if not self.name:
            raise ValueError("name must not be empty")
        if self.target not in TARGET_COLORS:
            raise ValueError(f"unknown target {self.target!r}; known: {', '.join(TARGET_COLORS)}")
        if not 1 <= self.max_motions <= MAX_MOTIONS:
            raise ValueError(f"max_motions must lie within 1 and {MAX_MOTIONS}, not {self.max_motions}")
        if self.clusters is not None and self.clusters < 1:
            raise ValueError(f"clusters must be at least 1, not {self.clusters}")
        if not 1 <= len(self.objects) <= MAX_OBJECTS:
            raise ValueError(f"objects must hold 1 to {MAX_OBJECTS} objects, not {len(self.objects)}")
        if all(item.color != self.target for item in self.objects):
            present = ", ".join(sorted({item.color for item in self.objects}))
            raise ValueError(f"no object has the target colour {self.target}; the objects are {present}")

    @property
    def target_colors(self) -> tuple[str, ...]:
        """The colours of its objects that can be a target."""
        present = {item.color for item in self.objects}
        return tuple(color for color in TARGET_COLORS if color in present)

    @property
    def motions_to_grasp(self) -> int:
        """Motions allowed until the target is in the gripper.

        An exploration's `max_motions` are for finding alone; finding and grasping get the paper's 15.
        """
        return WHOLE_TASK_MOTIONS if self.task == "exploration" else self.max_motions


def position_limits(item: SceneObject) -> tuple[Vector, Vector]:
    """The least and the most x, y and z of an object's position, metres.

    A block lies where its origin is. A mesh may lie beside its own, and `spawn` sees whether it is over the workspace.
    """
    reach = 0.0 if item.mesh is None else FRAME_REACH
    half = Workspace().size / 2 + reach
    return (-half, -half, 0.0 - reach), (half, half, MAX_HEIGHT + reach)


def scene_names() -> list[str]:
    """Names of the scenes that come with the project, sorted."""
    return sorted(entry.name.removesuffix(".toml") for entry in _shipped().iterdir() if entry.name.endswith(".toml"))


def load_scene(name_or_path: str | Path) -> Scene:
    """The shipped scene of that name, or the scene in that TOML file.

    Raises `BadInput` naming the known scenes, or the file and the field that is wrong.
    """
    text, source = _read(str(name_or_path))
    try:
        scene = msgspec.toml.decode(text, type=Scene)
    except msgspec.DecodeError as error:
        raise BadInput(f"scene {source}: {error}") from None
    folder = Path(source).parent
    return msgspec.structs.replace(scene, objects=tuple(_with_absolute_mesh(item, folder) for item in scene.objects))


def save_scene(scene: Scene, path: str | Path) -> None:
    """Write a scene file; meshes are written relative to its folder. Raises `BadInput` where it cannot be written."""
    path = Path(path)
    lines = [
        f"name = {_toml(scene.name)}",
        f"task = {_toml(scene.task)}",
        f"target = {_toml(scene.target)}",
        f"max_motions = {scene.max_motions}",
    ]
    if scene.clusters is not None:
        lines.append(f"clusters = {scene.clusters}")
    for item in scene.objects:
        lines += ["", "[[objects]]", *_object_lines(item, path.resolve().parent)]
    try:
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as error:
        raise BadInput(f"scene {path} cannot be written: {error.strerror}") from None


def _shipped() -> Traversable:
    return resources.files("grasping_invisible.sim_robot.scenes")


def _read(name_or_path: str) -> tuple[str, str]:
    """The text of a scene and where it came from."""
    path = Path(name_or_path)
    try:
        if name_or_path in scene_names():
            return (_shipped() / f"{name_or_path}.toml").read_text(encoding="utf-8"), name_or_path
        if path.is_file():
            return path.read_text(encoding="utf-8"), str(path)
    except (OSError, UnicodeDecodeError) as error:
        raise BadInput(f"scene {path} cannot be read: {error}") from None
    except ValueError as error:  # a path with a null byte
        raise BadInput(f"scene {name_or_path!r} is not a path: {error}") from None
    raise BadInput(f"unknown scene {name_or_path!r}; known: {', '.join(scene_names())}, or the path of a TOML file")


def _with_absolute_mesh(item: SceneObject, folder: Path) -> SceneObject:
    if item.mesh is None:
        return item
    return msgspec.structs.replace(item, mesh=str((folder / Path(item.mesh).expanduser()).resolve()))


def _object_lines(item: SceneObject, folder: Path) -> list[str]:
    """The lines of one object, only what differs from the defaults."""
    fields: list[tuple[str, object]] = [("shape", item.shape)]
    if item.mesh is not None:
        fields += [("mesh", os.path.relpath(Path(item.mesh).resolve(), folder))]
        fields += [("scale", item.scale)]
    fields += [("color", item.color), ("position", list(item.position))]
    if item.quaternion_xyzw is not None:
        fields.append(("quaternion_xyzw", list(item.quaternion_xyzw)))
    fields += [("yaw", item.yaw), ("mass", item.mass), ("friction", item.friction)]
    return [f"{name} = {_toml(value)}" for name, value in fields if value is not None]


def _toml(value: object) -> str:
    """A string, number or array of numbers as TOML, which writes them as JSON does but for one control character."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _check_what(item: SceneObject) -> None:
    """Raises ValueError where shape, mesh or colour make no sense."""
    if (item.shape is None) == (item.mesh is None):
        raise ValueError("an object has either a shape or a mesh")
    if item.shape is not None and item.shape not in BLOCKS:
        raise ValueError(f"unknown shape {item.shape!r}; known: {', '.join(BLOCKS)}")
    if item.color not in COLORS:
        raise ValueError(f"unknown color {item.color!r}; known: {', '.join(COLORS)}")
    if item.shape is not None and item.scale != 1.0:
        raise ValueError("scale is for meshes; a built-in shape has one size")


def _check_pose(item: SceneObject) -> None:
    """Raises ValueError where a pose is not finite, not over the workspace, or given twice."""
    (_, _, low), (half, _, high) = limits = position_limits(item)
    if not all(least <= value <= most for least, value, most in zip(limits[0], item.position, limits[1], strict=True)):
        raise ValueError(
            f"position {list(item.position)} lies outside the workspace: "
            f"x and y within {half:g} m of its centre, z from {low:g} to {high:g} m"
        )
    if item.quaternion_xyzw is not None and item.yaw is not None:
        raise ValueError("an object has either quaternion_xyzw or yaw")
    if item.yaw is not None and not math.isfinite(item.yaw):
        raise ValueError(f"yaw must be finite, not {item.yaw}")
    if item.quaternion_xyzw is not None:
        norm = float(np.linalg.norm(item.quaternion_xyzw))
        if not 0.9 <= norm <= 1.1:
            raise ValueError(f"quaternion_xyzw must have length 1, not {norm:.3g}")
