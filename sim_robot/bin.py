"""The discard bin beside the robot: an open box that keeps what is put down out of the workspace."""

import pybullet

from grasping_invisible.sim_robot.motions import BIN

INSIDE = 0.24  # metres, square
WALL_HEIGHT = 0.12
WALL = 0.01


def add_bin(client: int) -> int:
    """Put the bin on the table of a PyBullet world, below where the arm lets go; returns its body id."""
    half, rise = INSIDE / 2 + WALL / 2, WALL_HEIGHT / 2
    long, thin = INSIDE / 2 + WALL, WALL / 2
    extents = [[thin, long, rise], [thin, long, rise], [long, thin, rise], [long, thin, rise]]
    offsets = [[half, 0, rise], [-half, 0, rise], [0, half, rise], [0, -half, rise]]
    boxes = [pybullet.GEOM_BOX] * 4
    collision = pybullet.createCollisionShapeArray(
        shapeTypes=boxes, halfExtents=extents, collisionFramePositions=offsets, physicsClientId=client
    )
    visual = pybullet.createVisualShapeArray(
        shapeTypes=boxes,
        halfExtents=extents,
        visualFramePositions=offsets,
        rgbaColors=[[0.35, 0.38, 0.42, 1.0]] * 4,
        physicsClientId=client,
    )
    x, y, _ = BIN.position
    return pybullet.createMultiBody(0.0, collision, visual, [x, y, 0.0], physicsClientId=client)
