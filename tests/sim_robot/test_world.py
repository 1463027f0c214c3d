import math

import pybullet as p
import pytest
import trimesh

from grasping_invisible.runtime.errors import BadInput, RobotError
from grasping_invisible.runtime.workspace import Workspace
from grasping_invisible.sim_robot.scene import Scene, SceneObject, load_scene, scene_names
from grasping_invisible.sim_robot.world import ObjectState, World


def furthest(before: list[ObjectState], after: list[ObjectState]) -> float:
    return max(math.dist(a.position, b.position) for a, b in zip(before, after, strict=True))


def cubes(*positions: tuple[float, float, float]) -> Scene:
    items = tuple(SceneObject(shape="cube", color="red", position=position) for position in positions)
    return Scene(name="cubes", target="red", objects=items)


@pytest.mark.parametrize("name", scene_names())
def test_reference_scenes_stay_as_they_are(name):
    for seed in (None, 0, 1):
        world = World(load_scene(name), seed)
        try:
            start = world.object_states()
            assert world.settle()
            rest = world.object_states()
            assert furthest(start, rest) < 0.002
            assert world.deepest_overlap() < 0.0005
            world.wake()
            world.step(120)
            assert furthest(rest, world.object_states()) < 0.0005
            world.check()
        finally:
            world.close()


def test_two_worlds_of_one_seed_are_one():
    states = []
    for _ in range(2):
        world = World(load_scene("exploration-01"), 7)
        world.settle()
        world.step(50)
        states.append(world.object_states())
        world.close()
    assert states[0] == states[1]


def test_objects_stand_where_the_scene_says_in_the_base_frame():
    workspace = Workspace(center=(0.6, 0.1, 0.0))
    world = World(cubes((0.05, -0.05, 0.0251)), None, workspace)
    world.settle()
    (state,) = world.object_states()
    assert state.name == "00_red_cube"
    assert state.position == pytest.approx((0.65, 0.05, 0.025), abs=3e-4)
    assert state.mass == pytest.approx(0.075)
    assert world.target_names == ["00_red_cube"]
    assert list(world.bodies) == ["00_red_cube"]
    world.close()


def test_what_stood_on_a_removed_object_falls():
    world = World(cubes((0, 0, 0.0251), (0, 0, 0.0753)), None)
    world.settle()
    world.remove("00_red_cube")
    world.step(120)
    assert world.object_states()[0].position[2] == pytest.approx(0.025, abs=1e-3)
    world.close()


def test_a_slope_steeper_than_friction_lets_blocks_slide_and_a_flatter_one_does_not():
    slid = []
    for angle in (0.8, 1.25):  # of the coefficient's own angle
        world = World(cubes((0, 0, 0.0251)), None)
        tilt = angle * math.atan(world.object_states()[0].friction)
        start = world.object_states()
        p.setGravity(9.81 * math.sin(tilt), 0.0, -9.81 * math.cos(tilt), physicsClientId=world.client)
        world.step(120)
        slid.append(furthest(start, world.object_states()))
        world.close()
    assert slid[0] < 0.005
    assert slid[1] > 0.05


def test_a_broken_world_is_told():
    world = World(cubes((0, 0, 0.0251)), None)
    world.check()
    p.resetBaseVelocity(world.bodies["00_red_cube"], (500.0, 0.0, 0.0), physicsClientId=world.client)
    with pytest.raises(RobotError, match="00_red_cube"):
        world.check()
    world.place("00_red_cube", (math.nan, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    with pytest.raises(RobotError, match="00_red_cube"):
        world.check()
    world.close()


def test_objects_inside_each_other_are_refused():
    with pytest.raises(BadInput, match="00_red_cube and the table overlap by 15 mm"):
        World(cubes((0, 0, 0.010)), None)
    with pytest.raises(BadInput, match="01_red_cube and 00_red_cube overlap"):
        World(cubes((0, 0, 0.0251), (0.03, 0, 0.0251)), None)


@pytest.mark.parametrize("position", [(0.0, 0.0, 0.025), (-0.6, 0.0, 0.025), (-0.3, 0.0, -0.1)])
def test_a_mesh_outside_the_workspace_is_refused_wherever_its_frame_is(tmp_path, position):
    path = tmp_path / "far.stl"
    trimesh.creation.box((0.05, 0.05, 0.05)).apply_translation((0.3, 0.0, 0.0)).export(path)
    item = SceneObject(mesh=str(path), color="red", position=position)
    with pytest.raises(
        BadInput, match=r"00_red_far lies outside the workspace: the middle of mesh .*far\.stl is at \["
    ):
        World(Scene(name="far", target="red", objects=(item,)), 0)


def test_closing_twice_is_fine():
    world = World(cubes((0, 0, 0.0251)), None)
    world.close()
    world.close()
