"""The simulated RGB-D camera: fixed in the base frame, 640 x 480, with the intrinsics of a D435's colour camera."""

from dataclasses import dataclass, field

import numpy as np
import pybullet
from numpy.typing import NDArray

from grasping_invisible.runtime.frame import Camera

WIDTH, HEIGHT = 640, 480
FOCAL = 615.0  # pixels
NEAR, FAR = 0.15, 3.0  # metres

# Across the table from the robot, looking back at the workspace: the arm behind it hides nothing of it.
POSITION = (0.98, 0.0, 0.62)
LOOK_AT = (0.53, 0.0, 0.0)

DEPTH_NOISE = 0.0012  # standard deviation in metres at one metre, growing with its square


@dataclass(frozen=True)
class Lighting:
    """What a render is lit by. `direction` points to the light; the coefficients are PyBullet's, 0..1."""

    direction: tuple[float, float, float] = (0.6, 0.4, 2.0)
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    ambient: float = 0.6
    diffuse: float = 0.45
    specular: float = 0.05
    shadow: bool = False


@dataclass(frozen=True)
class Render:
    """One image: `color` (H, W, 3) uint8 RGB, `depth` (H, W) float32 metres (0: nothing), `bodies` (H, W) int32.

    `bodies` holds PyBullet body ids, -1 where there is none: ground truth, for labels only.
    """

    color: NDArray[np.uint8]
    depth: NDArray[np.float32]
    bodies: NDArray[np.int32]


def look_at(position: NDArray[np.float64], target: NDArray[np.float64]) -> NDArray[np.float64]:
    """The 4 x 4 `base_from_camera` of an optical frame (x right, y down, z forward) at `position`, facing `target`."""
    forward = (target - position) / np.linalg.norm(target - position)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([right, np.cross(forward, right), forward])
    pose[:3, 3] = position
    return pose


def default_camera() -> Camera:
    """The camera as it is mounted: see `docs/simulator.md` for its intrinsics and extrinsics."""
    intrinsics = np.array([[FOCAL, 0.0, (WIDTH - 1) / 2], [0.0, FOCAL, (HEIGHT - 1) / 2], [0.0, 0.0, 1.0]])
    return Camera(WIDTH, HEIGHT, intrinsics, look_at(np.array(POSITION), np.array(LOOK_AT)))


@dataclass
class DepthSensor:
    """Turns exact depth into a sensor's: noise that grows with the square of distance, whole millimetres."""

    seed: int
    _rng: np.random.Generator = field(init=False)

    def __post_init__(self) -> None:
        self._rng = np.random.default_rng(self.seed)

    def measure(self, depth: NDArray[np.float32]) -> NDArray[np.float32]:
        """Depth (H, W) in metres as a sensor reports it; 0 stays 0."""
        noise = self._rng.standard_normal(depth.shape, dtype=np.float32) * (DEPTH_NOISE * depth * depth)
        return (np.round((depth + noise) * 1000.0) / 1000.0).astype(np.float32)


def render(client: int, camera: Camera, lighting: Lighting | None = None) -> Render:
    """What `camera` sees of a PyBullet world, by its software renderer (no GPU, no window)."""
    light = lighting or Lighting()
    width, height, color, buffer, bodies = pybullet.getCameraImage(
        camera.width,
        camera.height,
        viewMatrix=_view_matrix(camera),
        projectionMatrix=_projection_matrix(camera),
        lightDirection=light.direction,
        lightColor=light.color,
        lightDistance=2.0,
        shadow=int(light.shadow),
        lightAmbientCoeff=light.ambient,
        lightDiffuseCoeff=light.diffuse,
        lightSpecularCoeff=light.specular,
        renderer=pybullet.ER_TINY_RENDERER,
        physicsClientId=client,
    )
    shape = (height, width)
    z = np.asarray(buffer, dtype=np.float64).reshape(shape)
    depth = FAR * NEAR / (FAR - (FAR - NEAR) * z)
    depth[z >= 1.0] = 0.0
    return Render(
        np.ascontiguousarray(np.asarray(color, dtype=np.uint8).reshape(*shape, 4)[:, :, :3]),
        depth.astype(np.float32),
        np.asarray(bodies, dtype=np.int32).reshape(shape),
    )


def _view_matrix(camera: Camera) -> list[float]:
    """OpenGL's camera frame has y up and z backwards; column-major."""
    flip = np.diag([1.0, -1.0, -1.0, 1.0])
    return (flip @ np.linalg.inv(camera.base_from_camera)).T.ravel().tolist()


def _projection_matrix(camera: Camera) -> list[float]:
    """OpenGL's, column-major. Its pixel centres lie at half integers, the camera's at integers."""
    (fx, _, cx), (_, fy, cy), _ = camera.intrinsics
    width, height = camera.width, camera.height
    cx, cy = cx + 0.5, cy + 0.5
    matrix = np.array(
        [
            [2 * fx / width, 0.0, 1.0 - 2 * cx / width, 0.0],
            [0.0, 2 * fy / height, 2 * cy / height - 1.0, 0.0],
            [0.0, 0.0, -(FAR + NEAR) / (FAR - NEAR), -2 * FAR * NEAR / (FAR - NEAR)],
            [0.0, 0.0, -1.0, 0.0],
        ]
    )
    return matrix.T.ravel().tolist()
