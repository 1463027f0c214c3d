import itertools

import numpy as np
import pybullet as p
import pytest

from grasping_invisible.sim_robot.blocks import ARCH_SIZE, BLOCKS, TUNNEL_RADIUS, tunnel_ceiling
from grasping_invisible.sim_robot.scene import Scene, SceneObject
from grasping_invisible.sim_robot.world import World


def test_volumes_are_those_of_the_shapes():
    tunnel = np.pi / 2 * TUNNEL_RADIUS**2 * ARCH_SIZE[1]
    assert BLOCKS["cube"].volume == pytest.approx(0.05**3)
    assert BLOCKS["arch"].volume == pytest.approx(np.prod(ARCH_SIZE) - tunnel, rel=0.02)
    for solid in BLOCKS.values():
        assert solid.surface.volume == pytest.approx(solid.volume, rel=0.02)
        assert solid.surface.extents == pytest.approx(solid.size, abs=2e-4)


def test_arch_is_heavier_at_the_top():
    x, y, z = BLOCKS["arch"].center_of_mass
    assert (x, y) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert 0.002 < z < 0.005


@pytest.mark.parametrize("faces", [4, 6, 32])
def test_nothing_juts_into_the_tunnel(faces):
    ceiling = tunnel_ceiling(faces)
    axis = np.array([0.0, -ARCH_SIZE[2] / 2])
    for start, end in itertools.pairwise(ceiling):
        points = start + np.linspace(0, 1, 20)[:, None] * (end - start)
        assert np.linalg.norm(points - axis, axis=1).min() >= TUNNEL_RADIUS - 1e-9


@pytest.mark.parametrize(("height", "passes"), [(0.0101, True), (0.045, False)])
def test_a_bar_goes_through_the_tunnel_and_not_through_the_crown(height, passes):
    world = World(
        Scene(name="arch", target="red", objects=(SceneObject(shape="arch", color="red", position=(0, 0, 0.0251)),)),
        None,
    )
    try:
        half = (0.012, 0.06, 0.010)
        bar = p.createMultiBody(
            0.05,
            p.createCollisionShape(p.GEOM_BOX, halfExtents=half, physicsClientId=world.client),
            -1,
            (world.workspace.center[0], -0.12, height),
            physicsClientId=world.client,
        )
        for _ in range(160):
            # Held on its line like a bar in a gripper that does not press.
            p.resetBaseVelocity(bar, (0.0, 0.4, 0.0), (0.0, 0.0, 0.0), physicsClientId=world.client)
            world.step()
        arch_y = world.object_states()[0].position[1]
        assert (abs(arch_y) < 0.001) == passes
    finally:
        world.close()
