"""The toy blocks, made from code: their dimensions, volume, and geometry for contact and for the camera.

A block's own frame has its origin in the middle of its bounding box; a mesh keeps the frame of its file.
Lengths are metres.
"""

import itertools
from dataclasses import dataclass
from typing import Literal

import numpy as np
import trimesh
from numpy.typing import NDArray

Vector = tuple[float, float, float]

ARCH_SIZE: Vector = (0.100, 0.050, 0.050)
TUNNEL_RADIUS = 0.024
CYLINDER_DIAMETER = 0.0448
CYLINDER_LENGTH = 0.050
# Flat faces of the tunnel's half circle; they touch the circle from outside, so nothing juts into the tunnel.
TUNNEL_FACES = 6
SEEN_FACES = 32  # rounder for the camera
# An arch on its side rests on its legs alone: with every slice of the crown touching too, the many redundant
# contacts of a pile of arches slow the solver several times over.
CROWN_INSET = 0.0006


@dataclass(frozen=True)
class Solid:
    """The geometry of one kind of object, in its own frame, metres.

    `size`: extents along x, y and z of the bounding box. `middle`: where its middle is. `volume`: cubic metres.
    `pieces`: convex parts that together are the body, where `kind` is "pieces". `surface`: what the camera sees.
    """

    name: str
    kind: Literal["box", "cylinder", "pieces"]
    size: Vector
    volume: float
    surface: trimesh.Trimesh
    center_of_mass: Vector = (0.0, 0.0, 0.0)
    pieces: tuple[trimesh.Trimesh, ...] = ()
    middle: Vector = (0.0, 0.0, 0.0)


def box(name: str, size: Vector) -> Solid:
    """A rectangular block of `size`."""
    return Solid(name, "box", size, float(np.prod(size)), trimesh.creation.box(size))


def cylinder(name: str, diameter: float, length: float) -> Solid:
    """A cylinder standing along z."""
    surface = trimesh.creation.cylinder(diameter / 2, length, sections=40)
    volume = np.pi * (diameter / 2) ** 2 * length
    return Solid(name, "cylinder", (diameter, diameter, length), float(volume), surface)


def arch() -> Solid:
    """The arch: a box with a half-round tunnel along y, open downwards, as convex pieces for contact."""
    pieces = _arch_pieces(TUNNEL_FACES, CROWN_INSET)
    volume, center = mass_properties(pieces)
    surface = _joined(_arch_pieces(SEEN_FACES, 0.0))
    return Solid("arch", "pieces", ARCH_SIZE, volume, surface, center, tuple(pieces))


def tunnel_ceiling(faces: int) -> NDArray[np.float64]:
    """Corners of the tunnel above its upright walls, (faces, 2) of x and z, from -x to +x."""
    angles = np.pi - (np.arange(faces) + 0.5) * np.pi / faces
    radius = TUNNEL_RADIUS / np.cos(np.pi / (2 * faces))
    return np.stack([radius * np.cos(angles), radius * np.sin(angles) - ARCH_SIZE[2] / 2], axis=1)


def mass_properties(pieces: list[trimesh.Trimesh]) -> tuple[float, Vector]:
    """Volume in cubic metres and centre of mass of convex pieces that do not overlap."""
    volumes = np.array([piece.volume for piece in pieces])
    x, y, z = volumes @ np.array([piece.center_mass for piece in pieces]) / volumes.sum()
    return float(volumes.sum()), (float(x), float(y), float(z))


def _arch_pieces(faces: int, inset: float) -> list[trimesh.Trimesh]:
    """Two legs, and the crown in slices above each face of the tunnel's ceiling, drawn in by `inset` along y."""
    half_x, half_y, half_z = (0.5 * side for side in ARCH_SIZE)
    ceiling = tunnel_ceiling(faces)
    legs = [
        [(low, -half_z), (high, -half_z), (high, half_z), (low, half_z)]
        for low, high in ((-half_x, -TUNNEL_RADIUS), (TUNNEL_RADIUS, half_x))
    ]
    crown = [[(x0, z0), (x1, z1), (x1, half_z), (x0, half_z)] for (x0, z0), (x1, z1) in itertools.pairwise(ceiling)]
    return [_along_y(outline, half_y) for outline in legs] + [_along_y(outline, half_y - inset) for outline in crown]


def _along_y(outline: list[tuple[float, float]], half_y: float) -> trimesh.Trimesh:
    """The convex prism over an outline in x and z, counter-clockwise seen from -y, from -half_y to half_y."""
    count = len(outline)
    vertices = [(x, y, z) for y in (-half_y, half_y) for x, z in outline]
    faces = [(0, i, i + 1) for i in range(1, count - 1)]
    faces += [(count, count + i + 1, count + i) for i in range(1, count - 1)]
    for i in range(count):
        j = (i + 1) % count
        faces += [(i, count + i, j), (j, count + i, count + j)]
    return trimesh.Trimesh(vertices, faces, process=False)


def _joined(pieces: list[trimesh.Trimesh]) -> trimesh.Trimesh:
    """All the faces of the pieces as one mesh."""
    corners = np.concatenate([piece.triangles.reshape(-1, 3) for piece in pieces])
    return trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=False)


BLOCKS: dict[str, Solid] = {
    solid.name: solid
    for solid in (
        box("cube", (0.050, 0.050, 0.050)),
        box("cuboid", (0.050, 0.050, 0.100)),
        box("plank", (0.100, 0.050, 0.025)),
        box("plate", (0.025, 0.050, 0.050)),
        arch(),
        cylinder("cylinder", CYLINDER_DIAMETER, CYLINDER_LENGTH),
    )
}
