"""Scene objects as PyBullet bodies.

PyBullet places a body by its centre of mass; a scene places an object by its own origin. `Body` knows both.
"""

import math
from dataclasses import dataclass

import pybullet as p

from grasping_invisible.data.classes import RGB
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.runtime.workspace import Workspace
from grasping_invisible.sim_robot.blocks import BLOCKS, Solid
from grasping_invisible.sim_robot.meshes import contact_file, load_solid, surface_file
from grasping_invisible.sim_robot.scene import MASS_LIMITS, Scene, SceneObject

Position = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

DENSITY = 600.0  # kg / m^3, of beech and pine blocks: a cube weighs 75 g
MIN_MASS = 0.01  # kg; lighter bodies make a solver that also carries a robot arm jitter
FRICTION = 0.55  # coefficient of wood on wood, and of wood on the table
OUTSIDE = 0.01  # metres that a mesh's middle may lie outside the workspace, or in the table: variation moves it
IDENTITY: Quaternion = (0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Body:
    """One object in one PyBullet client. `mass` kg; `friction`: coefficient against its own kind."""

    name: str
    id: int
    client: int
    item: SceneObject
    solid: Solid
    mass: float
    friction: float

    def pose(self) -> tuple[Position, Quaternion]:
        """Where the object's own frame is: position in metres and quaternion (x, y, z, w), base frame."""
        position, quaternion = p.getBasePositionAndOrientation(self.id, physicsClientId=self.client)
        to_origin = tuple(-value for value in self.solid.center_of_mass)
        return p.multiplyTransforms(position, quaternion, to_origin, IDENTITY)

    def middle(self) -> Position:
        """Where the middle of its bounding box is, metres, base frame."""
        middle, _ = p.multiplyTransforms(*self.pose(), self.solid.middle, IDENTITY)
        return middle

    def place(self, position: Position, quaternion: Quaternion) -> None:
        """Put the object's own frame at a pose of the base frame, at rest."""
        center, rotation = _center_of_mass_pose(self.solid, position, quaternion)
        p.resetBasePositionAndOrientation(self.id, center, rotation, physicsClientId=self.client)
        p.resetBaseVelocity(self.id, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), physicsClientId=self.client)

    def sleep(self) -> None:
        """Let it lie without being simulated until something touches it."""
        p.changeDynamics(self.id, -1, activationState=p.ACTIVATION_STATE_SLEEP, physicsClientId=self.client)

    def speed(self) -> tuple[float, float]:
        """How fast it moves: metres a second, radians a second."""
        linear, angular = p.getBaseVelocity(self.id, physicsClientId=self.client)
        return math.hypot(*linear), math.hypot(*angular)

    def distance(self, other: int, within: float) -> float:
        """Distance to another body of this client, metres: negative where they overlap, at most `within`."""
        points = p.getClosestPoints(self.id, other, within, physicsClientId=self.client)
        return min((point[8] for point in points), default=within)


def frame_with(point: Position, place: Position, quaternion: Quaternion) -> Position:
    """Where the own frame of an object turned by `quaternion` is, when a `point` of that frame is at `place`."""
    x, y, z = point
    position, _ = p.multiplyTransforms(place, quaternion, (-x, -y, -z), IDENTITY)
    return position


def solid_of(item: SceneObject) -> Solid:
    """The geometry of an object. Raises `BadInput` for a mesh that cannot be used."""
    if item.mesh is not None:
        return load_solid(item.mesh, item.scale)
    return BLOCKS[item.shape or ""]


def body_name(index: int, item: SceneObject) -> str:
    """Name of a scene's object, such as `03_grey_arch`."""
    return f"{index:02d}_{item.color}_{item.kind}"


def spawn(scene: Scene, workspace: Workspace, client: int) -> dict[str, Body]:
    """Make a body of every object of a scene, by name, in the scene's order.

    Raises `BadInput` for a mesh that cannot be used, or that lies outside the workspace although its frame may.
    """
    bodies = [_spawn_one(body_name(index, item), item, workspace, client) for index, item in enumerate(scene.objects)]
    for body in bodies:
        _refuse_outside(body, workspace)
    return {body.name: body for body in bodies}


def surface_friction(coefficient: float) -> float:
    """What to give PyBullet so that two surfaces of one `coefficient` have that friction between them.

    Bullet multiplies the values of two bodies in contact: a pair's coefficient is their geometric mean.
    """
    return math.sqrt(coefficient)


def _spawn_one(name: str, item: SceneObject, workspace: Workspace, client: int) -> Body:
    solid = solid_of(item)
    by_volume = min(max(DENSITY * solid.volume, MIN_MASS), MASS_LIMITS[1])
    mass = item.mass if item.mass is not None else by_volume
    friction = item.friction if item.friction is not None else FRICTION
    x, y, z = (center + offset for center, offset in zip(workspace.center, item.position, strict=True))
    center, rotation = _center_of_mass_pose(solid, (x, y, z), item.quaternion)
    red, green, blue = (value / 255.0 for value in RGB[item.color])
    body = p.createMultiBody(
        mass,
        _contact_shape(solid, client),
        p.createVisualShape(
            p.GEOM_MESH,
            fileName=surface_file(solid),
            rgbaColor=(red, green, blue, 1.0),
            specularColor=(0.0, 0.0, 0.0),
            physicsClientId=client,
        ),
        center,
        rotation,
        # A rigid body proper: a multibody without joints costs the solver three times as much.
        useMaximalCoordinates=True,
        physicsClientId=client,
    )
    p.changeDynamics(
        body,
        -1,
        lateralFriction=surface_friction(friction),
        # Lever arms in metres: what ends the rolling of a cylinder and the pivoting of a block on the spot.
        rollingFriction=1e-3,
        spinningFriction=1e-3,
        restitution=0.0,
        # What lies still costs nothing until something touches it.
        activationState=p.ACTIVATION_STATE_ENABLE_SLEEPING,
        physicsClientId=client,
    )
    return Body(name, body, client, item, solid, mass, friction)


def _refuse_outside(body: Body, workspace: Workspace) -> None:
    if body.item.mesh is None:
        return  # its position says where it is, and the scene has seen to that
    x, y, z = (value - center for value, center in zip(body.middle(), workspace.center, strict=True))
    height = p.getBasePositionAndOrientation(body.id, physicsClientId=body.client)[0][2] - workspace.center[2]
    half = workspace.size / 2
    if max(abs(x), abs(y)) > half + OUTSIDE or height < -OUTSIDE:
        raise BadInput(
            f"{body.name} lies outside the workspace: the middle of mesh {body.item.mesh} is at "
            f"[{x:.3f}, {y:.3f}, {z:.3f}], not above the table with x and y within {half:g} m of its centre"
        )


def _contact_shape(solid: Solid, client: int) -> int:
    if solid.kind == "box":
        half = [side / 2 for side in solid.size]
        return p.createCollisionShape(p.GEOM_BOX, halfExtents=half, physicsClientId=client)
    if solid.kind == "cylinder":
        return p.createCollisionShape(
            p.GEOM_CYLINDER, radius=solid.size[0] / 2, height=solid.size[2], physicsClientId=client
        )
    return p.createCollisionShape(p.GEOM_MESH, fileName=contact_file(solid), physicsClientId=client)


def _center_of_mass_pose(solid: Solid, position: Position, quaternion: Quaternion) -> tuple[Position, Quaternion]:
    return p.multiplyTransforms(position, quaternion, solid.center_of_mass, IDENTITY)
