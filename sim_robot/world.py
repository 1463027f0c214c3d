"""The simulated table: a PyBullet client of its own, with a scene's objects in it and gravity on.

Everything is in the base frame `panda_link0`, metres, z up; the table top is z = 0.
"""

import math
from dataclasses import dataclass

import pybullet as p

from grasping_invisible.runtime.errors import BadInput, RobotError
from grasping_invisible.runtime.workspace import Workspace
from grasping_invisible.sim_robot.bodies import (
    FRICTION,
    Position,
    Quaternion,
    frame_with,
    spawn,
    surface_friction,
)
from grasping_invisible.sim_robot.scene import Scene
from grasping_invisible.sim_robot.variation import vary

TIME_STEP = 1.0 / 240.0  # seconds
SOLVER_ITERATIONS = 50
# Metres at which a contact enters the solver; Bullet's 0.02 makes rows for neighbours that do not touch.
CONTACT_REACH = 0.002
GRAVITY = 9.81  # m / s^2
TABLE_SIZE = 1.6  # metres, square
TABLE_THICKNESS = 0.4
TABLE_RGB = (224, 220, 213)
MAX_START_OVERLAP = 0.01  # metres two objects of a scene file may overlap; contact pushes them apart
STILL_SPEED, STILL_TURN = 0.002, 0.05  # metres and radians a second
STILL_TIME = 0.1  # seconds without faster motion
MAX_SPEED, MAX_DISTANCE = 20.0, 5.0  # metres a second and metres: beyond, the physics is broken


class ObjectsOverlap(BadInput):
    """A scene whose objects start inside each other, or inside the table."""


@dataclass(frozen=True)
class ObjectState:
    """Where an object is: its own frame in the base frame, metres and quaternion (x, y, z, w)."""

    name: str
    shape: str
    color: str
    position: Position
    quaternion: Quaternion
    mass: float
    friction: float


class World:
    """A scene under physics.

    `seed` chooses a variation of the scene (poses, masses, friction, see `vary`); None takes it as written.
    Raises `BadInput` for a mesh that cannot be used, `ObjectsOverlap` for objects in each other. Not for several
    threads.
    """

    def __init__(self, scene: Scene, seed: int | None, workspace: Workspace | None = None, gui: bool = False) -> None:
        self.workspace = workspace or Workspace()
        self.scene = scene if seed is None else vary(scene, seed)
        self.time = 0.0  # seconds simulated so far
        self.client = p.connect(p.GUI if gui else p.DIRECT)
        if self.client < 0:
            raise RobotError("the simulator's window cannot be opened; is there a display?")
        try:
            self._set_up_physics()
            self.table = self._make_table()
            self._objects = spawn(self.scene, self.workspace, self.client)
            self._refuse_overlaps()
        except BaseException:
            self.close()
            raise

    @property
    def bodies(self) -> dict[str, int]:
        """PyBullet body ids of the objects that are left, by name."""
        return {name: body.id for name, body in self._objects.items()}

    @property
    def target_names(self) -> list[str]:
        """Names of the objects of the target colour that are left."""
        return [name for name, body in self._objects.items() if body.item.color == self.scene.target]

    def step(self, n: int = 1) -> None:
        """Advance by `n` time steps of 1/240 s."""
        for _ in range(n):
            p.stepSimulation(physicsClientId=self.client)
            self.time += TIME_STEP

    def settle(self, max_seconds: float = 3.0) -> bool:
        """Step until every object has been still for a moment; False if some move after `max_seconds`."""
        still = 0
        for _ in range(round(max_seconds / TIME_STEP)):
            self.step()
            still = still + 1 if self._is_still() else 0
            if still * TIME_STEP >= STILL_TIME:
                for body in self._objects.values():
                    body.sleep()
                return True
        return False

    def object_states(self) -> list[ObjectState]:
        """Where every object that is left really is, also those that fell off the table."""
        return [
            ObjectState(name, body.item.kind, body.item.color, *body.pose(), body.mass, body.friction)
            for name, body in self._objects.items()
        ]

    def deepest_overlap(self) -> float:
        """The deepest overlap of two objects, or one and the table, metres; 0 where none touch."""
        return max((depth for _, _, depth in self._overlaps()), default=0.0)

    def middles(self) -> dict[str, Position]:
        """Where the middle of every object's bounding box is, metres, base frame, by name."""
        return {name: body.middle() for name, body in self._objects.items()}

    def place(self, name: str, position: Position, quaternion: Quaternion) -> None:
        """Put an object's own frame at a pose of the base frame, at rest: to set scenes up."""
        self._objects[name].place(position, quaternion)
        self.wake()

    def place_middle(self, name: str, middle: Position, quaternion: Quaternion) -> None:
        """Put the middle of an object's bounding box at a pose of the base frame, at rest."""
        self.place(name, frame_with(self._objects[name].solid.middle, middle, quaternion), quaternion)

    def remove(self, name: str) -> None:
        """Take an object out of the world."""
        p.removeBody(self._objects.pop(name).id, physicsClientId=self.client)
        self.wake()

    def save(self) -> int:
        """Keep the state of a world that has come to rest; a number to `restore` it by, until it is `forget`-ed."""
        return p.saveState(physicsClientId=self.client)

    def restore(self, state: int) -> None:
        """Everything is where it was when `state` was saved, at rest. Nothing may have been removed since.

        Bullet keeps more between steps than it restores: the same motion from here comes out a little differently each
        time, by some millimetres of what it moves.
        """
        p.restoreState(state, physicsClientId=self.client)
        # Bullet looks for contacts where a sleeping object last was awake: it has to be seen awake where it is now.
        self.wake()
        p.performCollisionDetection(physicsClientId=self.client)
        for body in self._objects.values():
            body.sleep()

    def forget(self, state: int) -> None:
        """Free the memory of a saved state."""
        p.removeState(state, physicsClientId=self.client)

    def highest_top(self) -> float:
        """Metres above the table that the highest object reaches."""
        boxes = (p.getAABB(body.id, physicsClientId=self.client) for body in self._objects.values())
        return max((float(box[1][2]) for box in boxes), default=0.0)

    def wake(self) -> None:
        """Let gravity and contact act on objects that lie still again.

        `settle` puts a pile that has come to rest to sleep, which makes it nearly free to simulate, and a touch wakes
        it. Call this after changing the world in any other way, such as restoring a saved state.
        """
        for body in self._objects.values():
            p.changeDynamics(body.id, -1, activationState=p.ACTIVATION_STATE_WAKE_UP, physicsClientId=self.client)

    def check(self) -> None:
        """Raise `RobotError` where the physics has broken down: an object is nowhere, or impossibly fast."""
        for name, body in self._objects.items():
            position, _ = body.pose()
            speed, _ = body.speed()
            distance = math.dist(position, self.workspace.center)
            # Negated, so that NaN fails too.
            if not (speed < MAX_SPEED and distance < MAX_DISTANCE):
                raise RobotError(
                    f"the simulation broke down: {name} is {distance:.3g} m away, moving at {speed:.3g} m/s"
                )

    def close(self) -> None:
        """End the client. May be called twice."""
        if p.isConnected(self.client):
            p.disconnect(self.client)

    def _set_up_physics(self) -> None:
        p.setGravity(0.0, 0.0, -GRAVITY, physicsClientId=self.client)
        p.setPhysicsEngineParameter(
            fixedTimeStep=TIME_STEP,
            numSolverIterations=SOLVER_ITERATIONS,
            contactBreakingThreshold=CONTACT_REACH,
            deterministicOverlappingPairs=1,
            physicsClientId=self.client,
        )

    def _make_table(self) -> int:
        half = (TABLE_SIZE / 2, TABLE_SIZE / 2, TABLE_THICKNESS / 2)
        red, green, blue = (value / 255.0 for value in TABLE_RGB)
        table = p.createMultiBody(
            0.0,
            p.createCollisionShape(p.GEOM_BOX, halfExtents=half, physicsClientId=self.client),
            p.createVisualShape(
                p.GEOM_BOX,
                halfExtents=half,
                rgbaColor=(red, green, blue, 1.0),
                specularColor=(0.0, 0.0, 0.0),
                physicsClientId=self.client,
            ),
            (self.workspace.center[0], self.workspace.center[1], -TABLE_THICKNESS / 2),
            physicsClientId=self.client,
        )
        floor = p.createMultiBody(
            0.0,
            p.createCollisionShape(p.GEOM_PLANE, physicsClientId=self.client),
            -1,
            (0.0, 0.0, -TABLE_THICKNESS),
            physicsClientId=self.client,
        )
        for body in (table, floor):
            p.changeDynamics(
                body,
                -1,
                lateralFriction=surface_friction(FRICTION),
                restitution=0.0,
                physicsClientId=self.client,
            )
        return table

    def _is_still(self) -> bool:
        return all(
            speed < STILL_SPEED and turn < STILL_TURN
            for speed, turn in (body.speed() for body in self._objects.values())
        )

    def _overlaps(self) -> list[tuple[str, str, float]]:
        """Pairs that overlap, the table as "the table", and by how many metres."""
        found = []
        bodies = list(self._objects.values())
        for index, body in enumerate(bodies):
            others = [("the table", self.table), *((other.name, other.id) for other in bodies[:index])]
            for name, other in others:
                distance = body.distance(other, within=0.0)
                if distance < 0.0:
                    found.append((body.name, name, -distance))
        return found

    def _refuse_overlaps(self) -> None:
        for first, second, depth in self._overlaps():
            if depth > MAX_START_OVERLAP:
                raise ObjectsOverlap(f"scene {self.scene.name}: {first} and {second} overlap by {1000 * depth:.0f} mm")
