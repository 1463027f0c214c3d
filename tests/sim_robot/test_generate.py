import math

import pytest
import trimesh

from grasping_invisible.data.classes import GREY
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.sim_robot.camera import default_camera, render
from grasping_invisible.sim_robot.generate import REACH, STYLES, generate_scene
from grasping_invisible.sim_robot.piles import mesh_kind
from grasping_invisible.sim_robot.scene import load_scene, save_scene
from grasping_invisible.sim_robot.world import World


@pytest.mark.parametrize("style", STYLES)
def test_generated_scenes_are_whole_settled_and_inside(style, tmp_path):
    for seed in range(2):
        scene = generate_scene(seed, style, targets=2, basics=6)
        colors = [item.color for item in scene.objects]
        assert colors.count(GREY) == 6
        assert colors[0] == scene.target
        assert len({color for color in colors if color != GREY}) == 2
        assert all(max(abs(item.position[0]), abs(item.position[1])) <= REACH for item in scene.objects)
        save_scene(scene, tmp_path / "scene.toml")
        world = World(load_scene(tmp_path / "scene.toml"), None)
        before = world.object_states()
        world.settle()
        after = world.object_states()
        assert max(math.dist(a.position, b.position) for a, b in zip(before, after, strict=True)) < 0.003
        assert world.deepest_overlap() < 0.001
        world.close()


@pytest.mark.parametrize("style", STYLES)
def test_a_seed_says_all(style):
    assert generate_scene(3, style, basics=6) == generate_scene(3, style, basics=6)
    assert generate_scene(3, style, basics=6).objects != generate_scene(4, style, basics=6).objects


@pytest.mark.parametrize("seed", [1, 4])
def test_as_many_as_are_allowed_can_be_scattered(seed):
    scene = generate_scene(seed, "scattered", targets=7, basics=30)
    assert len(scene.objects) == 37
    assert all(max(abs(item.position[0]), abs(item.position[1])) <= REACH for item in scene.objects)


@pytest.mark.parametrize("basics", [0, 8, 30])
def test_a_mesh_too_wide_for_a_column_is_scattered_too(basics, tmp_path):
    path = tmp_path / "tray.stl"
    trimesh.creation.box((0.2, 0.15, 0.02)).export(path)
    scene = generate_scene(0, "scattered", basics=basics, target_kind=mesh_kind(str(path), 1.0))
    assert [item.kind for item in scene.objects].count("tray") == 1


def test_a_mesh_that_its_own_frame_lifts_out_of_a_scene_is_dropped_from_elsewhere(tmp_path):
    path = tmp_path / "far.stl"
    trimesh.creation.box((0.12, 0.05, 0.05)).apply_translation((0.38, 0.0, 0.0)).export(path)
    for seed in (0, 22, 46):
        scene = generate_scene(seed, "scattered", basics=30, target_kind=mesh_kind(str(path), 1.0))
        assert [item.kind for item in scene.objects].count("far") == 1


def test_covered_targets_cannot_be_seen():
    for seed in range(2):
        scene = generate_scene(seed, "covered", basics=7)
        assert scene.task == "exploration"
        world = World(scene, None)
        seen = render(world.client, default_camera()).bodies
        assert (seen == world.bodies[world.target_names[0]]).sum() < 60
        assert (seen == world.bodies["01_grey_" + scene.objects[1].kind]).sum() > 60
        world.close()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"style": "heaped"}, "unknown style 'heaped'; known: scattered, packed, stacked, covered"),
        ({"targets": 0}, "targets must lie within 1 and 7"),
        ({"targets": 8}, "targets must lie within 1 and 7"),
        ({"basics": -1}, "basics"),
        ({"style": "covered", "basics": 2}, "basics of a covered scene must lie within 5"),
    ],
)
def test_counts_that_make_no_sense(arguments, says):
    with pytest.raises(BadInput, match=says):
        generate_scene(0, **arguments)
