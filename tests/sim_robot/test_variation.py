import math

import pytest
import trimesh

from grasping_invisible.sim_robot.blocks import BLOCKS
from grasping_invisible.sim_robot.bodies import DENSITY, FRICTION
from grasping_invisible.sim_robot.scene import FRICTION_LIMITS, MASS_LIMITS, Scene, SceneObject, load_scene
from grasping_invisible.sim_robot.variation import FRICTION_RANGE, MASS_RANGE, SHIFT, TURN, vary
from grasping_invisible.sim_robot.world import World


def turn_between(a: tuple[float, ...], b: tuple[float, ...]) -> float:
    return 2 * math.acos(min(1.0, abs(sum(x * y for x, y in zip(a, b, strict=True)))))


def test_same_seed_same_variation():
    scene = load_scene("coordination-02")
    assert vary(scene, 5) == vary(scene, 5)
    assert vary(scene, 5) != vary(scene, 6)
    assert vary(scene, 0) != scene


@pytest.mark.parametrize("name", ["coordination-00", "coordination-04", "exploration-02"])
def test_variation_is_small_and_not_nothing(name):
    scene = load_scene(name)
    shifts = []
    for seed in range(3):
        varied = vary(scene, seed)
        for before, after in zip(scene.objects, varied.objects, strict=True):
            assert (before.shape, before.color) == (after.shape, after.color)
            shifts.append(math.dist(before.position, after.position))
            # A pile turns about its middle, which shifts what lies at its rim.
            assert shifts[-1] < SHIFT * math.sqrt(2) + 0.5 * TURN * 0.2
            assert turn_between(before.quaternion, after.quaternion) <= TURN + 1e-6
            mass = DENSITY * BLOCKS[before.shape or ""].volume
            assert after.mass == pytest.approx(mass, rel=MASS_RANGE + 1e-9)
            assert after.friction == pytest.approx(FRICTION, rel=FRICTION_RANGE + 1e-9)
    assert sum(shift > 0.0002 for shift in shifts) > len(shifts) / 2


@pytest.mark.parametrize("name", ["coordination-04", "coordination-05", "exploration-03"])
def test_variation_does_not_push_objects_into_each_other(name):
    scene = load_scene(name)
    plain = World(scene, None)
    overlap = plain.deepest_overlap()
    plain.close()
    for seed in range(4):
        world = World(scene, seed)
        assert world.deepest_overlap() < overlap + 0.0005
        world.close()


@pytest.mark.parametrize("end", [0, 1])
def test_mass_and_friction_at_their_limits_stay_within_them(end):
    item = SceneObject(
        shape="cube", color="red", position=(0.0, 0.0, 0.025), mass=MASS_LIMITS[end], friction=FRICTION_LIMITS[end]
    )
    scene = Scene(name="limits", target="red", objects=(item,))
    for seed in range(8):
        (varied,) = vary(scene, seed).objects
        assert varied.mass == pytest.approx(MASS_LIMITS[end], rel=MASS_RANGE)
        assert varied.friction == pytest.approx(FRICTION_LIMITS[end], rel=FRICTION_RANGE)


def test_a_large_mesh_of_no_given_mass_can_be_varied(tmp_path):
    path = tmp_path / "crate.stl"
    trimesh.creation.box((0.3, 0.3, 0.3)).export(path)  # 16 kg by its volume
    item = SceneObject(mesh=str(path), color="red", position=(0.0, 0.0, 0.15))
    (varied,) = vary(Scene(name="crate", target="red", objects=(item,)), 0).objects
    assert varied.mass == pytest.approx(MASS_LIMITS[1], rel=MASS_RANGE)


def test_a_mesh_turns_about_itself_and_not_about_its_frame(tmp_path):
    path = tmp_path / "far.stl"
    trimesh.creation.box((0.05, 0.05, 0.05)).apply_translation((0.4, 0.0, 0.0)).export(path)
    item = SceneObject(mesh=str(path), color="red", position=(-0.4, 0.0, 0.025))
    scene = Scene(name="far", target="red", objects=(item,))
    for seed in range(8):
        world = World(scene, seed)
        x, y, z = world.middles()["00_red_far"]
        assert math.dist((x, y, z), (world.workspace.center[0], 0.0, 0.025)) < SHIFT * math.sqrt(2) + 1e-6
        world.close()
