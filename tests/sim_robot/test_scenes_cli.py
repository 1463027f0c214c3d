from pathlib import Path

import pybullet as p
import pytest
import trimesh

from grasping_invisible.runtime.errors import RobotError
from grasping_invisible.sim_robot import scenes_cli
from grasping_invisible.sim_robot.generate import REACH, generate_scene
from grasping_invisible.sim_robot.scene import load_scene
from grasping_invisible.sim_robot.scenes_cli import main
from grasping_invisible.sim_robot.world import World


@pytest.fixture
def lid(tmp_path: Path) -> Path:
    """A disc with a knob, in millimetres, its frame at the middle of its underside."""
    disc = trimesh.creation.cylinder(40.0, 12.0).apply_translation((0, 0, 6))
    knob = trimesh.creation.cylinder(12.0, 30.0).apply_translation((0, 0, 27))
    path = tmp_path / "lid.stl"
    trimesh.util.concatenate([disc, knob]).export(path)
    return path


@pytest.mark.parametrize("style", ["packed", "scattered", "stacked"])
def test_scenes_hold_the_mesh_as_their_target_at_rest(tmp_path: Path, lid: Path, style: str):
    out = tmp_path / "scenes"
    arguments = ["generate", "--out", str(out), "--count", "1", "--seed", "3", "--style", style, "--blocks", "3"]
    assert main([*arguments, "--mesh", str(lid), "--scale", "0.001"]) == 0
    scene = load_scene(out / f"{style}-3.toml")
    (target,) = [item for item in scene.objects if item.color == scene.target]
    assert target.kind == "lid"
    assert [item.kind for item in scene.objects].count("lid") == 1
    world = World(scene, None)
    before = [state.position for state in world.object_states()]
    world.settle()
    for was, state in zip(before, world.object_states(), strict=True):
        assert state.position == pytest.approx(was, abs=0.004)
    world.close()


@pytest.mark.parametrize("style", ["packed", "scattered", "covered"])
@pytest.mark.parametrize("middle", [(0.0, 0.0, 0.0275), (0.0, 0.0, 0.055), (0.0, 0.0, -0.3), (0.1, 0.0, 0.025)])
def test_a_mesh_lies_where_it_came_to_rest_wherever_its_frame_is(tmp_path: Path, style: str, middle: tuple):
    mesh = tmp_path / "far.stl"
    trimesh.creation.box((0.05, 0.05, 0.05)).apply_translation(middle).export(mesh)
    arguments = ["generate", "--out", str(tmp_path), "--count", "2", "--style", style, "--blocks", "5"]
    assert main([*arguments, "--mesh", str(mesh)]) == 0
    for path in tmp_path.glob("*.toml"):
        scene = load_scene(path)
        world = World(scene, None)
        before = world.middles()
        world.settle()
        for name, at in world.middles().items():
            assert at == pytest.approx(before[name], abs=0.004)
            assert max(abs(at[0] - world.workspace.center[0]), abs(at[1])) <= REACH
        low, _ = p.getAABB(world.bodies["00_" + scene.target + "_far"], physicsClientId=world.client)
        touching = p.getContactPoints(world.bodies["00_" + scene.target + "_far"], physicsClientId=world.client)
        assert touching, f"it floats at {low[2]:.3f} m"
        world.close()


def test_a_mesh_far_from_its_frame_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    mesh = tmp_path / "far.stl"
    trimesh.creation.box((0.05, 0.05, 0.05)).apply_translation((1.0, 0.0, 0.0)).export(mesh)
    assert main(["generate", "--out", str(tmp_path), "--count", "1", "--mesh", str(mesh)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert f"the frame of mesh {mesh} is 1 m from the middle of the mesh: move its origin to within 0.4 m" in line


def test_a_mesh_that_no_block_covers_is_hidden_under_two(tmp_path: Path):
    mesh = tmp_path / "tray.stl"
    trimesh.creation.box((0.062, 0.058, 0.03)).apply_translation((0, 0, 0.015)).export(mesh)
    arguments = ["generate", "--out", str(tmp_path), "--count", "1", "--style", "covered", "--blocks", "6"]
    assert main([*arguments, "--mesh", str(mesh)]) == 0
    assert [len(load_scene(path).objects) for path in tmp_path.glob("*.toml")] == [7]


def test_what_is_there_already_stays(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    arguments = ["generate", "--out", str(tmp_path), "--seed", "7", "--blocks", "2"]
    assert main([*arguments, "--count", "1"]) == 0
    (first,) = tmp_path.iterdir()
    first.write_text("kept")
    assert main([*arguments, "--count", "2"]) == 0
    assert first.read_text() == "kept"
    assert len(list(tmp_path.iterdir())) == 2
    assert "2 scenes" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (("--mesh", "nowhere.stl"), "nowhere.stl does not exist"),
        (("--count", "0"), "--count must be at least 1"),
        (("--targets", "9"), "targets must lie within 1 and 7"),
        (("--out", __file__), "test_scenes_cli.py cannot be made a folder: File exists"),
        (("--out", f"{__file__}/scenes"), "cannot be made a folder: Not a directory"),
        (("--scale", "0.001"), "--scale is for a --mesh"),
        (("--mesh", "lid.stl", "--scale", "-1"), "--scale must lie within 1e-06 and 1000, not -1"),
        (("--mesh", "lid.stl", "--scale", "0"), "--scale must lie within 1e-06 and 1000, not 0"),
        (("--mesh", "lid.stl", "--scale", "nan"), "--scale must lie within 1e-06 and 1000, not nan"),
    ],
)
def test_bad_input_is_one_line(tmp_path: Path, wrong: tuple[str, ...], said: str, capsys: pytest.CaptureFixture[str]):
    assert main(["generate", "--out", str(tmp_path), *wrong]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("gi-scenes:")
    assert said in line


def test_a_seed_that_fails_does_not_lose_the_others(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    def generate_two(seed: int, *arguments):
        if seed % 2:
            raise RobotError("it never came to rest")
        return generate_scene(seed, *arguments)

    monkeypatch.setattr(scenes_cli, "generate_scene", generate_two)
    assert main(["generate", "--out", str(tmp_path), "--count", "4", "--blocks", "1"]) == 3
    assert sorted(path.name for path in tmp_path.iterdir()) == ["packed-0.toml", "packed-2.toml"]
    captured = capsys.readouterr()
    assert f"2 scenes in {tmp_path}" in captured.out
    (line,) = [line for line in captured.err.splitlines() if line.startswith("gi-scenes:")]
    assert line == "gi-scenes: 2 of 4 scenes failed, of seed 1, 3: it never came to rest"


def test_the_shipped_scenes_are_listed(capsys: pytest.CaptureFixture[str]):
    assert main(["list"]) == 0
    assert "exploration-03" in capsys.readouterr().out.splitlines()
