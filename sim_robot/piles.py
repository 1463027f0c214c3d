"""Random piles of blocks that lie flat against and on top of each other, as layouts on paper before any physics.

A pile has its own frame: blocks are upright or on a side, their edges parallel to its axes, metres.
"""

import math
from dataclasses import dataclass, replace
from functools import cache

import cv2
import numpy as np
import pybullet as p

from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.sim_robot.blocks import BLOCKS, Vector
from grasping_invisible.sim_robot.bodies import frame_with
from grasping_invisible.sim_robot.meshes import load_solid
from grasping_invisible.sim_robot.scene import FRAME_REACH, SceneObject

Quaternion = tuple[float, float, float, float]
Rectangle = tuple[tuple[float, float], tuple[float, float], float]

UPRIGHT: Quaternion = (0.0, 0.0, 0.0, 1.0)
HALF = math.sqrt(0.5)
ABOUT_X: Quaternion = (HALF, 0.0, 0.0, HALF)
ABOUT_Y: Quaternion = (0.0, HALF, 0.0, HALF)
ABOUT_Z: Quaternion = (0.0, 0.0, HALF, HALF)
UPSIDE_DOWN: Quaternion = (1.0, 0.0, 0.0, 0.0)

# The ways in which a block stays where it is put.
RESTS: dict[str, tuple[Quaternion, ...]] = {
    "cube": (UPRIGHT,),
    "cuboid": (ABOUT_X, ABOUT_X, UPRIGHT),
    "plank": (UPRIGHT, UPRIGHT, ABOUT_X),
    "plate": (ABOUT_Y, ABOUT_Y, UPRIGHT),
    "arch": (ABOUT_X, UPRIGHT, UPSIDE_DOWN),
    "cylinder": (UPRIGHT,),
}
SHAPES = tuple(RESTS)
COVERS = ("plank", "plate", "cube", "cuboid", "arch")  # a cylinder would roll off


@dataclass(frozen=True)
class Kind:
    """What can lie in a pile: a built-in block, or a mesh.

    `size`: extents of the bounding box in the object's own frame, metres; `middle`: where its middle is there. `rests`:
    the orientations in which it stays where it is put. `mesh`, `scale`: as in a scene file; without them a block.
    """

    size: Vector
    rests: tuple[Quaternion, ...]
    shape: str | None = None
    mesh: str | None = None
    scale: float = 1.0
    middle: Vector = (0.0, 0.0, 0.0)


def block_kind(shape: str) -> Kind:
    """A built-in block."""
    return Kind(BLOCKS[shape].size, RESTS[shape], shape)


def mesh_kind(path: str, scale: float) -> Kind:
    """A mesh file, which rests as it stands in its file. Raises `BadInput` where it cannot be used."""
    solid = load_solid(path, scale)
    away = math.hypot(*solid.middle)
    if away > FRAME_REACH:
        raise BadInput(
            f"the frame of mesh {path} is {away:.3g} m from the middle of the mesh: "
            f"move its origin to within {FRAME_REACH} m of it, at best into it"
        )
    return Kind(solid.size, (UPRIGHT,), None, path, scale, solid.middle)


def any_kind(rng: np.random.Generator) -> Kind:
    """A built-in block at random."""
    return block_kind(str(rng.choice(SHAPES)))


LARGEST_GAP = 0.0025  # metres between neighbours that are meant to touch
LOW = 0.05  # metres, height of a block that does not stand on its end
LIFT = 0.0005  # metres between a block and what it is put on


@dataclass(frozen=True)
class Lying:
    """A block at rest in a pile's frame: the middle of its bounding box, and its extents there, metres."""

    kind: Kind
    rotation: Quaternion
    size: Vector
    center: Vector = (0.0, 0.0, 0.0)

    @property
    def top(self) -> float:
        """Height of its upper side."""
        return self.center[2] + self.size[2] / 2

    def at(self, x: float, y: float, bottom: float = 0.0) -> "Lying":
        """The same block elsewhere, standing at height `bottom`."""
        return replace(self, center=(x, y, bottom + LIFT + self.size[2] / 2))

    def overlaps(self, other: "Lying") -> bool:
        """Whether the two overlap seen from above."""
        return all(
            abs(self.center[axis] - other.center[axis]) < (self.size[axis] + other.size[axis]) / 2 - 1e-9
            for axis in (0, 1)
        )


def lay(kind: Kind, rng: np.random.Generator) -> Lying:
    """A block on one of the sides it rests on, along either axis, at the origin."""
    rotation = kind.rests[rng.integers(len(kind.rests))]
    return _lying(kind, rotation, turned=rng.random() < 0.5)


def _lying(kind: Kind, rotation: Quaternion, turned: bool) -> Lying:
    """At the origin on the side it rests on in `rotation`, `turned` by a quarter about the vertical or not."""
    if turned:
        _, rotation = p.multiplyTransforms((0, 0, 0), ABOUT_Z, (0, 0, 0), rotation)
    matrix = np.abs(np.array(p.getMatrixFromQuaternion(rotation)).reshape(3, 3))
    x, y, z = (float(extent) for extent in matrix @ kind.size)
    return Lying(kind, rotation, (x, y, z)).at(0.0, 0.0)


def lay_low(rng: np.random.Generator) -> Lying:
    """A built-in block at random, lying so that another can cover it: not on its end."""
    while True:
        block = lay(any_kind(rng), rng)
        if block.size[2] <= LOW:
            return block


def surround(middle: Lying, sides: int, lowest: float, rng: np.random.Generator) -> list[Lying]:
    """Up to `sides` blocks (of four) on the table against the sides of `middle`, none lower than `lowest`."""
    placed: list[Lying] = []
    for side in rng.permutation(4)[:sides]:
        axis, sign = divmod(int(side), 2)
        for _ in range(20):
            block = lay(any_kind(rng), rng)
            if block.size[2] < lowest - 1e-9:
                continue
            reach = (middle.size[axis] + block.size[axis]) / 2 + rng.uniform(0.0005, LARGEST_GAP)
            # Covering most of the side, not merely touching its corner.
            slack = (block.size[1 - axis] - middle.size[1 - axis]) / 2
            along = rng.uniform(-1, 1) * max(abs(slack), 0.008)
            offset = [along, along]
            offset[axis] = reach if sign else -reach
            block = block.at(middle.center[0] + offset[0], middle.center[1] + offset[1])
            if not any(block.overlaps(other) for other in (middle, *placed)):
                placed.append(block)
                break
    return placed


def cradled(arches: int, rng: np.random.Generator) -> list[Lying]:
    """A cylinder in the tunnel of an arch that lies on its side, or of two that meet around it; the cylinder first."""
    cylinder = lay(block_kind("cylinder"), rng)
    arch = block_kind("arch")
    along_x, depth, height = arch.size  # on its side: the tunnel stands upright and opens towards +y
    apart = depth / 2 + rng.uniform(0.0005, LARGEST_GAP)
    first = Lying(arch, ABOUT_X, (along_x, depth, height)).at(0.0, -apart)
    _, turned = p.multiplyTransforms((0, 0, 0), (0.0, 0.0, 1.0, 0.0), (0, 0, 0), ABOUT_X)
    return [cylinder, first, Lying(arch, turned, first.size).at(0.0, apart)][: 1 + arches]


def around(pile: list[Lying]) -> Lying:
    """The space that a pile takes, as if it were one block."""
    low = np.min([np.subtract(block.center, np.divide(block.size, 2)) for block in pile], axis=0)
    high = np.max([np.add(block.center, np.divide(block.size, 2)) for block in pile], axis=0)
    (x, y, z), (width, depth, height) = ((low + high) / 2).tolist(), (high - low).tolist()
    return Lying(pile[0].kind, UPRIGHT, (width, depth, height), (x, y, z))


def on_top(pile: list[Lying], block: Lying, x: float, y: float) -> Lying:
    """The block put down at (x, y), on the highest of what lies beneath it."""
    block = block.at(x, y)
    return block.at(x, y, max((other.top for other in pile if block.overlaps(other)), default=0.0))


def covering(size: Vector, rng: np.random.Generator) -> Lying:
    """A block lying flat that covers `size`, which has to be `coverable`."""
    while True:
        block = lay(block_kind(str(rng.choice(COVERS))), rng)
        if _covers(block, size):
            return block


def _covers(block: Lying, size: Vector) -> bool:
    """Whether it lies flat and its footprint is no smaller than that of `size`, but for a few millimetres."""
    return block.size[0] > size[0] - 0.004 and block.size[1] > size[1] - 0.004 and block.size[2] <= LOW


def coverable(size: Vector) -> Vector:
    """`size`, or half of it where it is too broad for any block to cover. Raises `BadInput` where that is, too."""
    halves = (size[0] / 2, size[1], size[2]), (size[0], size[1] / 2, size[2])
    for part in (size, halves[int(size[1] > size[0])]):
        if any(_covers(way, part) for way in _covers_lying()):
            return part
    raise BadInput(f"no two blocks cover a target of {size[0] * 1e3:.0f} x {size[1] * 1e3:.0f} mm")


@cache
def _covers_lying() -> tuple[Lying, ...]:
    """All ways in which a block can lie that might cover something."""
    kinds = [block_kind(shape) for shape in COVERS]
    return tuple(_lying(kind, rest, turned) for kind in kinds for rest in kind.rests for turned in (False, True))


def roof(pile: list[Lying], hidden: Lying, blocks: int, rng: np.random.Generator) -> list[Lying]:
    """One block that covers `hidden`, or two alike, side by side, that meet above its middle, or a third on these.

    What is too broad for any block gets at least two, each over half of it; see `coverable`.
    """
    size = coverable(hidden.size)
    halved = next((axis for axis in (0, 1) if size[axis] < hidden.size[axis]), None)
    block = covering(size, rng)
    x, y = hidden.center[:2]
    if blocks == 1 and halved is None:
        return [on_top(pile, block, x, y)]
    across = int(block.size[0] > block.size[1]) if halved is None else halved  # they lie along each other
    apart = block.size[across] / 2 + LARGEST_GAP / 2
    offsets = [(0.0, sign * apart) if across else (sign * apart, 0.0) for sign in (-1, 1)]
    two = [on_top(pile, block, x + dx, y + dy) for dx, dy in offsets]
    return two if blocks <= 2 else [*two, on_top([*pile, *two], covering(size, rng), x, y)]


def footprint(block: Lying, x: float, y: float, yaw: float) -> Rectangle:
    """A block of a pile that stands at (x, y, yaw), seen from above, as OpenCV's rotated rectangle."""
    c, s = math.cos(yaw), math.sin(yaw)
    middle = (x + c * block.center[0] - s * block.center[1], y + s * block.center[0] + c * block.center[1])
    return middle, (block.size[0], block.size[1]), math.degrees(yaw)


def collide(first: list[Rectangle], second: list[Rectangle]) -> bool:
    """Whether any two rectangles of two lists overlap."""
    return any(
        cv2.rotatedRectangleIntersection(one, other)[0] != cv2.INTERSECT_NONE for one in first for other in second
    )


def as_object(block: Lying, color: str, x: float, y: float, yaw: float) -> SceneObject:
    """The block as an object of a scene whose pile stands at (x, y, yaw) in the workspace frame."""
    about_z = (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))
    middle, rotation = p.multiplyTransforms((x, y, 0.0), about_z, block.center, block.rotation)
    return as_scene_object(block.kind, color, middle, rotation)


def as_scene_object(kind: Kind, color: str, middle: Vector, rotation: Quaternion) -> SceneObject:
    """An object of a scene, the middle of its bounding box at a pose of the workspace frame."""
    position = frame_with(kind.middle, middle, rotation)
    return SceneObject(
        shape=kind.shape, mesh=kind.mesh, scale=kind.scale, color=color, position=position, quaternion_xyzw=rotation
    )
