from pathlib import Path

import numpy as np
import pytest
import trimesh

from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.sim_robot.meshes import drawn_in, load_solid
from grasping_invisible.sim_robot.scene import Scene, SceneObject
from grasping_invisible.sim_robot.world import World


@pytest.fixture(autouse=True)
def _own_cache(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def trough() -> trimesh.Trimesh:
    """A U-shaped block 60 x 60 x 40 mm in millimetres, its notch 30 mm wide and 45 mm deep, open at +y."""
    outline = [(-30, -30), (30, -30), (30, 30), (15, 30), (15, -15), (-15, -15), (-15, 30), (-30, 30)]
    triangles = [(0, 5, 6), (0, 6, 7), (0, 1, 4), (0, 4, 5), (1, 2, 3), (1, 3, 4)]
    return trimesh.creation.extrude_triangulation(np.array(outline, float), np.array(triangles), 40.0)


def resting(objects: tuple[SceneObject, ...]) -> list[np.ndarray]:
    """Positions in the workspace frame."""
    world = World(Scene(name="meshes", target="red", objects=objects), None)
    try:
        assert world.settle()
        middle = np.array(world.workspace.center)
        return [np.array(state.position) - middle for state in world.object_states()]
    finally:
        world.close()


@pytest.mark.parametrize("ending", [".stl", ".obj"])
def test_convex_mesh_rests_on_its_side_and_has_its_volume(tmp_path, ending):
    path = tmp_path / f"brick{ending}"
    # Its origin in a corner: a mesh keeps the frame of its file.
    trimesh.creation.box((40.0, 50.0, 30.0)).apply_translation((20.0, 25.0, 15.0)).export(path)
    solid = load_solid(str(path), 0.001)
    assert len(solid.pieces) == 1
    assert solid.volume == pytest.approx(0.04 * 0.05 * 0.03, rel=1e-6)
    assert solid.center_of_mass == pytest.approx((0.02, 0.025, 0.015))
    brick = SceneObject(mesh=str(path), scale=0.001, color="red", position=(0.01, 0.02, 0.002))
    assert resting((brick,))[0] == pytest.approx((0.01, 0.02, 0.0), abs=5e-4)


def test_notch_of_a_concave_mesh_is_open_to_contact(tmp_path, monkeypatch):
    path = tmp_path / "trough.stl"
    trough().export(path)
    solid = load_solid(str(path), 0.001)
    assert len(solid.pieces) > 1
    assert solid.volume == pytest.approx(9e-5, rel=1e-6)
    # The same mesh in another file is not cut again.
    monkeypatch.setattr("subprocess.run", lambda *_, **__: pytest.fail("cut again"))
    path = path.rename(tmp_path / "copy.stl")
    ball = tmp_path / "ball.stl"
    trimesh.creation.box((20.0, 20.0, 20.0)).export(ball)
    upright = (np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5))  # the notch opens upwards
    _, (_, _, z) = resting(
        (
            SceneObject(mesh=str(path), scale=0.001, position=(0, 0.02, 0.031), quaternion_xyzw=upright),
            SceneObject(mesh=str(ball), scale=0.001, color="red", position=(0, 0, 0.07)),
        )
    )
    assert z == pytest.approx(0.015 + 0.01, abs=0.002)


def test_drawing_in_moves_every_face_by_the_depth():
    box = trimesh.creation.box((0.04, 0.05, 0.03))
    assert np.ptp(drawn_in(box, 0.001), axis=0) == pytest.approx((0.038, 0.048, 0.028))


SHEET = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 4 3\nf 1 3 2\nf 2 3 4\n"


def _write(path: Path, content: bytes) -> str:
    path.write_bytes(content)
    return str(path)


@pytest.mark.parametrize(
    ("make", "scale", "says"),
    [
        (lambda d: str(d / "none.stl"), 1.0, "does not exist"),
        (lambda d: str(d), 1.0, "must be one of"),
        (lambda d: _write(d / "a.ply", b"ply"), 1.0, "must be one of .obj, .stl"),
        (lambda d: _write(d / "a.obj", b"not a mesh"), 1.0, "a.obj"),
        (lambda d: _write(d / "a.stl", b"\x00\xff" * 50), 1.0, "a.stl"),
        (lambda d: _write(d / "a.stl", b""), 1.0, "a.stl"),
        (lambda d: trough().export(d / "a.stl") and str(d / "a.stl"), 1.0, "set scale"),
        (lambda d: _write(d / "a.obj", SHEET), 0.05, "is flat"),
    ],
)
def test_bad_meshes_are_told_in_one_line(tmp_path, make, scale, says):
    with pytest.raises(BadInput, match=says) as caught:
        load_solid(make(tmp_path), scale)
    assert "\n" not in str(caught.value)
