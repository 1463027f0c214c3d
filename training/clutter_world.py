"""Random clutter for the segmenter to learn from, sometimes with the arm in view.

Half of it is blocks dropped one after another, which lie open; half the generator's covered scenes, knocked about as
pushes do, where blocks show as slivers.
"""

from dataclasses import dataclass

import numpy as np
import pybullet

from grasping_invisible.sim_robot.bin import add_bin
from grasping_invisible.sim_robot.blocks import BLOCKS
from grasping_invisible.sim_robot.generate import generate_scene
from grasping_invisible.sim_robot.kinematics import HOME_JOINTS, Kinematics, tool_down
from grasping_invisible.sim_robot.panda import ARM_JOINTS, FINGER_JOINTS, Panda
from grasping_invisible.sim_robot.scene import Scene, SceneObject
from grasping_invisible.sim_robot.world import World

MOST_OBJECTS = 14
FALL_STEPS = 50  # physics steps after each block, then SETTLE_STEPS at the end
SETTLE_STEPS = 120
ARM_SHARE = 0.3  # of worlds that hold an arm; it costs more than everything else to draw
COVERED_SHARE = 0.5  # of worlds that are covered scenes
COVERED_BASICS = (8, 18)  # blocks beside the target in those, least and most
KNOCK_SPEED = (0.3, 1.2)  # m/s along the table, of a block knocked by something
KNOCK_STEPS = 60  # physics steps after it


@dataclass
class ClutterWorld:
    """Blocks on the table, at rest or nearly so, and perhaps an arm. Close it after use."""

    world: World
    panda: Panda | None

    @property
    def client(self) -> int:
        """The PyBullet client."""
        return self.world.client

    def close(self) -> None:
        """Free the world."""
        self.world.close()


def make_clutter(rng: np.random.Generator) -> ClutterWorld:
    """Blocks dropped around one or two places of the workspace, or a covered scene."""
    world = _covered(rng) if rng.random() < COVERED_SHARE else _dropped(rng)
    try:
        panda = Panda(world.client, world.step) if rng.random() < ARM_SHARE else None
    except BaseException:
        world.close()
        raise
    return ClutterWorld(world, panda)


def knock(world: World, rng: np.random.Generator) -> None:
    """Give a block a speed along the table, as a push does, and let physics act a while."""
    if not world.bodies:
        return
    heading, speed = rng.uniform(0, 2 * np.pi), rng.uniform(*KNOCK_SPEED)
    velocity = [speed * np.cos(heading), speed * np.sin(heading), 0.0]
    body = int(rng.choice(list(world.bodies.values())))
    pybullet.resetBaseVelocity(body, velocity, physicsClientId=world.client)
    world.step(KNOCK_STEPS)


def _covered(rng: np.random.Generator) -> World:
    basics = int(rng.integers(*COVERED_BASICS, endpoint=True))
    world = World(generate_scene(int(rng.integers(2**31)), "covered", basics=basics), None)
    add_bin(world.client)
    return world


def _dropped(rng: np.random.Generator) -> World:
    """0 to 14 random blocks."""
    count = 0 if rng.random() < 0.03 else int(rng.integers(2, MOST_OBJECTS + 1))
    world = World(_parked_blocks(rng, max(count, 1)), None)
    try:
        add_bin(world.client)
        places = rng.uniform(-0.12, 0.12, (int(rng.integers(1, 3)), 2))
        spread = rng.uniform(0.02, 0.12)
        for name in world.bodies:
            x, y = np.clip(places[rng.integers(len(places))] + rng.normal(0.0, spread, 2), -0.2, 0.2)
            height = 0.08 + (0.1 if rng.random() < 0.5 else 0.0)
            center = world.workspace.center
            world.place(name, (center[0] + x, center[1] + y, height), _orientation(rng))
            world.step(FALL_STEPS)
        world.step(SETTLE_STEPS)
        if count == 0:
            world.remove(next(iter(world.bodies)))
    except BaseException:
        world.close()
        raise
    return world


def pose_arm(clutter: ClutterWorld, kinematics: Kinematics, rng: np.random.Generator) -> None:
    """Put the arm at home, or as in mid motion: the hand over the workspace, perhaps holding a block."""
    if clutter.panda is None:
        return
    joints, width = HOME_JOINTS, rng.uniform(0.0, 0.08)
    center = clutter.world.workspace.center
    position = np.array(center) + rng.uniform((-0.2, -0.2, 0.08), (0.2, 0.2, 0.4))
    if rng.random() < 0.7:
        found = kinematics.inverse(position, tool_down(rng.uniform(-np.pi, np.pi)), HOME_JOINTS)
        if found is not None:
            joints = found
            if rng.random() < 0.4 and clutter.world.bodies:
                name = str(rng.choice(list(clutter.world.bodies)))
                x, y, z = (float(value) for value in position)
                clutter.world.place(name, (x, y, z), _orientation(rng))
                width = 0.05
    for joint, angle in zip(ARM_JOINTS, joints, strict=True):
        pybullet.resetJointState(clutter.panda.body, joint, float(angle), physicsClientId=clutter.client)
    for joint in FINGER_JOINTS:
        pybullet.resetJointState(clutter.panda.body, joint, width / 2, physicsClientId=clutter.client)


def _parked_blocks(rng: np.random.Generator, count: int) -> Scene:
    """A scene whose blocks wait far enough apart, from where they are dropped one by one."""
    shapes = rng.choice(list(BLOCKS), count)
    corners = [(-0.18 + 0.12 * (i % 4), -0.18 + 0.12 * (i // 4)) for i in range(count)]
    objects = tuple(
        SceneObject(shape=str(shape), color="red", position=(x, y, 0.06))
        for shape, (x, y) in zip(shapes, corners, strict=True)
    )
    return Scene(name="clutter", target="red", objects=objects)


def _orientation(rng: np.random.Generator) -> tuple[float, float, float, float]:
    """Mostly on one of its faces, turned about the vertical; sometimes anyhow."""
    if rng.random() < 0.25:
        quaternion = rng.normal(size=4)
        x, y, z, w = quaternion / np.linalg.norm(quaternion)
        return (float(x), float(y), float(z), float(w))
    roll, pitch = rng.choice([0.0, np.pi / 2], 2)
    return pybullet.getQuaternionFromEuler([roll, pitch, rng.uniform(-np.pi, np.pi)])
