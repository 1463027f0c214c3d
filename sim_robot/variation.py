"""Per-run variation: the same scene with slightly other poses, masses and friction, chosen by a seed.

Poses move without making objects overlap: first every object by itself, where its neighbours leave it room,
then every pile as a whole.
"""

import math

import msgspec
import numpy as np
import pybullet as p

from grasping_invisible.runtime.workspace import Workspace
from grasping_invisible.sim_robot.bodies import Body, Position, Quaternion, spawn
from grasping_invisible.sim_robot.scene import FRICTION_LIMITS, MASS_LIMITS, Scene, SceneObject, position_limits

SHIFT = 0.002  # metres along x and y
TURN = math.radians(1.5)
MASS_RANGE = 0.10
FRICTION_RANGE = 0.15
TOUCHING = 0.004  # metres: objects nearer than this move as one pile
# Resting contacts overlap by a hair; a move may not add more than this.
TOLERANCE = 0.0001


def vary(scene: Scene, seed: int) -> Scene:
    """The scene with poses jittered by some 2 mm and up to 1.5 degrees, masses by 10 % and friction by 15 %.

    Heights and tilts stay; only x, y and yaw change. Mass and friction stay within what a scene file may say.
    The same scene and seed give the same result.
    """
    rng = np.random.default_rng(seed)
    client = p.connect(p.DIRECT)
    try:
        # A workspace centred on the base frame's origin makes base and workspace frame the same.
        bodies = list(spawn(scene, Workspace(center=(0.0, 0.0, 0.0)), client).values())
        for body in bodies:
            _move_if_free([body], bodies, rng, 0.5)
        for pile in _piles(bodies):
            _move_if_free(pile, bodies, rng, 0.5)
        objects = tuple(_varied(body, rng) for body in bodies)
    finally:
        p.disconnect(client)
    return msgspec.structs.replace(scene, objects=objects)


def _varied(body: Body, rng: np.random.Generator) -> SceneObject:
    position, quaternion = body.pose()
    x, y, z = (float(value) for value in np.clip(position, *position_limits(body.item)))
    return msgspec.structs.replace(
        body.item,
        position=(x, y, z),
        quaternion_xyzw=quaternion,
        yaw=None,
        mass=_varied_within(MASS_LIMITS, body.mass, MASS_RANGE, rng),
        friction=_varied_within(FRICTION_LIMITS, body.friction, FRICTION_RANGE, rng),
    )


def _varied_within(limits: tuple[float, float], value: float, share: float, rng: np.random.Generator) -> float:
    """The value, more or less by up to its `share`, and never beyond the limits."""
    low, high = limits
    return min(max(value * rng.uniform(1 - share, 1 + share), low), high)


def _move_if_free(moved: list[Body], bodies: list[Body], rng: np.random.Generator, share: float) -> None:
    """Shift and turn bodies together about their common middle, unless that would push into others."""
    dx, dy = rng.uniform(-share * SHIFT, share * SHIFT, 2)
    turn = rng.uniform(-share * TURN, share * TURN)
    others = [body for body in bodies if body not in moved]
    before = [body.pose() for body in moved]
    gaps = _gaps(moved, others)
    middle = np.mean([body.middle()[:2] for body in moved], axis=0)
    for body, pose in zip(moved, before, strict=True):
        body.place(*_moved(pose, middle, dx, dy, turn))
    after = _gaps(moved, others)
    if any(new < min(old, 0.0) - TOLERANCE for old, new in zip(gaps, after, strict=True)):
        for body, pose in zip(moved, before, strict=True):
            body.place(*pose)


def _moved(pose: tuple[Position, Quaternion], middle: np.ndarray, dx: float, dy: float, turn: float):
    (x, y, z), quaternion = pose
    c, s = math.cos(turn), math.sin(turn)
    x, y = x - middle[0], y - middle[1]
    position = (middle[0] + c * x - s * y + dx, middle[1] + s * x + c * y + dy, z)
    about_z = (0.0, 0.0, math.sin(turn / 2), math.cos(turn / 2))
    _, rotation = p.multiplyTransforms((0, 0, 0), about_z, (0, 0, 0), quaternion)
    return position, rotation


def _gaps(moved: list[Body], others: list[Body]) -> list[float]:
    return [body.distance(other.id, within=0.01) for body in moved for other in others]


def _piles(bodies: list[Body]) -> list[list[Body]]:
    """Groups of bodies that touch, directly or through others."""
    waiting = list(bodies)
    piles = []
    while waiting:
        pile = [waiting.pop(0)]
        for member in pile:  # grows while it is walked
            near = [body for body in waiting if member.distance(body.id, within=2 * TOUCHING) < TOUCHING]
            pile += near
            waiting = [body for body in waiting if body not in near]
        piles.append(pile)
    return piles
