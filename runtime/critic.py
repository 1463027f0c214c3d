"""How good every push and grasp would be: the motion critic at 16 rotations (paper, section V-A)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import PUSH_LEVELS, ROTATIONS
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.onnx_model import OnnxModel
from grasping_invisible.runtime.rotation import ROTATED_CELLS, critic_planes, rotate_planes, unrotate


@dataclass(frozen=True)
class QMaps:
    """Q values on the action grid; map k is for yaw k * 22.5 degrees.

    `push`: (2, 16, 112, 112) float32, of low and of raised pushes. `grasp`: (16, 112, 112) float32. Row 0 lies at the
    largest y, column 0 at the smallest x.
    """

    push: NDArray[np.float32]
    grasp: NDArray[np.float32]


class Critic:
    """The critic network: planes of every rotation in, Q maps out."""

    def __init__(self, model: OnnxModel, planes: int) -> None:
        """`planes`: how many of `critic_planes` the model takes."""
        self._model = model
        self._planes = planes
        model(np.zeros((ROTATIONS, planes, ROTATED_CELLS, ROTATED_CELLS), np.float32))  # plans its memory

    def q_maps(self, maps: Heightmaps, mask: NDArray[np.bool_]) -> QMaps:
        """Push and grasp Q maps for the target under `mask`, (N, N) bool; all true stands for any object."""
        push, grasp = self._model(rotate_planes(critic_planes(maps, mask, self._planes)))
        return QMaps(np.stack([unrotate(push[:, level]) for level in PUSH_LEVELS]), unrotate(grasp))
