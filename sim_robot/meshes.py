"""Meshes that people bring: an OBJ or STL file becomes a solid whose contact geometry is sound.

A convex mesh is its own contact geometry. Any other is cut into convex pieces by V-HACD once, and the pieces
are kept in a cache folder under the mesh's content hash.
"""

import hashlib
import os
import subprocess
import sys
import tempfile
from functools import lru_cache
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.sim_robot.blocks import Solid, mass_properties

ENDINGS = (".obj", ".stl")
SMALLEST, LARGEST = 0.005, 0.4  # metres, of a mesh's longest side
THINNEST = 0.001  # metres, of its shortest side
MAX_FACES = 200_000
CONVEX_TOLERANCE = 0.005  # of the longest side: how far a vertex may lie outside a face's plane
# Bullet rounds a convex hull outwards by this many metres, so its hull is made that much smaller.
HULL_MARGIN = 0.001
VHACD_TIMEOUT = 120  # seconds

# In a process of its own, because V-HACD writes pages of progress to stdout.
_VHACD = """
import pybullet, sys
pybullet.vhacd(*sys.argv[1:], resolution=200000, concavity=0.0005, maxNumVerticesPerCH=48)
"""


def load_solid(path: str, scale: float) -> Solid:
    """The solid of a mesh file whose lengths times `scale` are metres, in the file's own frame.

    Raises `BadInput` where there is no such file, or it is no mesh, not solid, or of no size for a table top.
    """
    try:
        changed = os.stat(path).st_mtime_ns
    except (OSError, ValueError):
        raise BadInput(f"mesh {path} does not exist") from None
    return _load_solid(path, scale, changed)


def cache_folder() -> Path:
    """Where geometry made from meshes is kept between runs: below the home, or a temporary folder."""
    home = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    folder = Path(home) / "grasping-invisible" / "meshes"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if os.access(folder, os.W_OK):
            return folder
    except OSError:
        pass
    folder = Path(tempfile.gettempdir()) / f"grasping-invisible-meshes-{os.getuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    return folder


@lru_cache(maxsize=256)
def contact_file(solid: Solid) -> str:
    """Path of an OBJ whose groups are the convex pieces, its origin at the centre of mass."""
    groups = [(drawn_in(piece, HULL_MARGIN), piece.faces) for piece in solid.pieces]
    return _write_obj("contact", groups, solid.center_of_mass)


def drawn_in(piece: trimesh.Trimesh, depth: float) -> NDArray[np.float64]:
    """Vertices of a convex piece after moving every face inwards by `depth`, or by less where it is too thin."""
    depth = min(depth, 0.25 * float(piece.extents.min()))
    moved = np.array(piece.vertices)
    for vertex in range(len(moved)):
        normals = piece.face_normals[(piece.faces == vertex).any(axis=1)]
        step = np.linalg.lstsq(normals, np.full(len(normals), -depth), rcond=0.05)[0]
        # At a needle's tip the faces' common point would lie far inside.
        moved[vertex] += step * min(1.0, 3 * depth / max(float(np.linalg.norm(step)), 1e-12))
    return moved


@lru_cache(maxsize=256)
def surface_file(solid: Solid) -> str:
    """Path of an OBJ of what the camera sees, flat-shaded, its origin at the centre of mass."""
    corners = solid.surface.triangles.reshape(-1, 3)
    faces = np.arange(len(corners)).reshape(-1, 3)
    return _write_obj("surface", [(corners, faces)], solid.center_of_mass, solid.surface.face_normals)


@lru_cache(maxsize=64)
def _load_solid(path: str, scale: float, changed: int) -> Solid:
    mesh = _load_mesh(path, scale)
    if mesh.is_watertight and mesh.volume < 0:
        mesh.invert()
    pieces = (mesh,) if mesh.is_watertight and _is_convex(mesh) else _convex_pieces(path, mesh)
    # V-HACD's pieces are rounded outwards by a voxel, so where the mesh itself has a volume, that one counts.
    volume, center = mass_properties([mesh] if mesh.is_watertight else list(pieces))
    if volume < 1e-9:
        raise BadInput(f"mesh {path} encloses no volume")
    width, depth, height = (float(extent) for extent in mesh.extents)
    x, y, z = (float(value) for value in mesh.bounds.mean(axis=0))
    return Solid(Path(path).stem, "pieces", (width, depth, height), volume, mesh, center, pieces, (x, y, z))


def _load_mesh(path: str, scale: float) -> trimesh.Trimesh:
    if Path(path).suffix.lower() not in ENDINGS:
        raise BadInput(f"mesh {path} must be one of {', '.join(ENDINGS)}")
    try:
        mesh = trimesh.load_mesh(path, process=True)
    except Exception as error:  # the parsers raise whatever they trip over
        raise BadInput(f"mesh {path} cannot be read: {error or type(error).__name__}") from None
    if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) < 4:
        raise BadInput(f"mesh {path} holds no surface")
    if len(mesh.faces) > MAX_FACES:
        raise BadInput(f"mesh {path} has {len(mesh.faces)} faces; at most {MAX_FACES} are supported")
    # STL stores every triangle's corners anew, and OBJ may split them for texture.
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    mesh.apply_scale(scale)
    longest = float(mesh.extents.max())
    if not SMALLEST <= longest <= LARGEST:
        raise BadInput(
            f"mesh {path} is {longest:.4g} m long, not {SMALLEST} to {LARGEST} m: set scale in the scene file"
        )
    if float(mesh.extents.min()) < THINNEST:
        raise BadInput(f"mesh {path} is flat: it must be a closed surface at least {THINNEST} m thick")
    return mesh


def _is_convex(mesh: trimesh.Trimesh) -> bool:
    """Whether every vertex lies behind, or hardly before, the plane of every face."""
    tolerance = CONVEX_TOLERANCE * float(mesh.extents.max())
    offsets = np.einsum("ij,ij->i", mesh.face_normals, mesh.triangles[:, 0])
    for start in range(0, len(mesh.faces), 1024):
        normals = mesh.face_normals[start : start + 1024]
        if (normals @ mesh.vertices.T - offsets[start : start + 1024, None]).max() > tolerance:
            return False
    return True


def _convex_pieces(path: str, mesh: trimesh.Trimesh) -> tuple[trimesh.Trimesh, ...]:
    digest = hashlib.sha256(
        mesh.vertices.tobytes() + np.asarray(mesh.faces, np.int64).tobytes() + _VHACD.encode()
    ).hexdigest()
    cached = cache_folder() / f"pieces-{digest[:32]}.obj"
    if not cached.exists():
        _run_vhacd(path, mesh, cached)
    pieces = _read_groups(cached)
    if not pieces:
        raise BadInput(f"mesh {path} could not be cut into convex pieces")
    return pieces


def _read_groups(path: Path) -> tuple[trimesh.Trimesh, ...]:
    """The groups of V-HACD's OBJ file, whose faces count vertices through the whole file."""
    vertices: list[list[float]] = []
    groups: list[list[list[int]]] = []
    for line in path.read_text(encoding="ascii").splitlines():
        match line.split():
            case ["o", *_]:
                groups.append([])
            case ["v", *values]:
                vertices.append([float(value) for value in values])
            case ["f", *corners]:
                groups[-1].append([int(corner) - 1 for corner in corners])
    pieces = []
    for faces in groups:
        used, corners = np.unique(faces, return_inverse=True)
        pieces.append(trimesh.Trimesh(np.array(vertices)[used], corners.reshape(-1, 3), process=False))
    return tuple(pieces)


def _run_vhacd(path: str, mesh: trimesh.Trimesh, result: Path) -> None:
    with tempfile.TemporaryDirectory(dir=result.parent) as folder:
        whole, pieces, log = (str(Path(folder) / name) for name in ("whole.obj", "pieces.obj", "log.txt"))
        mesh.export(whole)
        try:
            subprocess.run(
                [sys.executable, "-c", _VHACD, whole, pieces, log],
                check=True,
                capture_output=True,
                timeout=VHACD_TIMEOUT,
            )
            # In one go, so that another process never reads half a file.
            os.replace(pieces, result)
        except (subprocess.SubprocessError, OSError) as error:
            raise BadInput(f"mesh {path} could not be cut into convex pieces: {error}") from None


def _write_obj(kind: str, groups: list, origin: tuple[float, float, float], normals=None) -> str:
    """Write groups of (vertices, faces), moved so that `origin` is at zero, unless it is there already.

    `normals`: one for each face, of a single group whose faces share no vertices.
    """
    lines = []
    first = 1
    for index, (vertices, faces) in enumerate(groups):
        lines.append(f"o {kind}_{index}")
        lines += [f"v {x:.7f} {y:.7f} {z:.7f}" for x, y, z in np.asarray(vertices) - origin]
        if normals is None:
            lines += [f"f {a + first} {b + first} {c + first}" for a, b, c in faces]
        else:
            lines += [f"vn {x:.6f} {y:.6f} {z:.6f}" for x, y, z in normals]
            lines += [f"f {a + 1}//{n} {b + 1}//{n} {c + 1}//{n}" for n, (a, b, c) in enumerate(faces, start=1)]
        first += len(vertices)
    text = "\n".join(lines) + "\n"
    path = cache_folder() / f"{kind}-{hashlib.sha256(text.encode()).hexdigest()[:32]}.obj"
    if not path.exists():
        handle, temporary = tempfile.mkstemp(dir=path.parent)
        with os.fdopen(handle, "w", encoding="ascii") as file:
            file.write(text)
        os.replace(temporary, path)
    return str(path)
