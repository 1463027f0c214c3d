"""How the robot acts while it collects experience: epsilon-greedy, with pushes that look for the target.

A behaviour stands in for the models of the loop, so that collection runs the same code as the robot. Greedy, it asks
the critic; exploring, it gives random Q maps, whose greatest allowed value is a random allowed action.
"""

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.action_grid import ACTION_CELLS, PUSH_LEVELS, ROTATIONS
from grasping_invisible.runtime.critic import QMaps
from grasping_invisible.runtime.heightmap import Heightmaps
from grasping_invisible.runtime.motion import pushes_towards
from grasping_invisible.runtime.situation import Models
from grasping_invisible.runtime.workspace import Workspace
from grasping_invisible.sim_robot.robot import SimRobot

NOISE = 0.02  # of greedy Q values, so that equal situations do not always bring the same action


def random_maps(mask: NDArray[np.bool_], workspace: Workspace, rng: np.random.Generator) -> QMaps:
    """Q maps whose greatest allowed value is a random allowed action.

    Every push towards the target under the mask (N, N) comes before every other one.
    """
    shape = (ROTATIONS, ACTION_CELLS, ACTION_CELLS)
    push_noise, grasp_noise = _noise((len(PUSH_LEVELS), *shape), rng), _noise(shape, rng)
    # Sums, not products, or the order among pushes would not be all of it.
    return QMaps(push=(push_noise + pushes_towards(mask, workspace)) / np.float32(2), grasp=grasp_noise)


def noisy(learned: QMaps, rng: np.random.Generator) -> QMaps:
    """A critic's Q maps with a little noise."""
    return QMaps(
        push=learned.push + _noise(learned.push.shape, rng, NOISE),
        grasp=learned.grasp + _noise(learned.grasp.shape, rng, NOISE),
    )


def _noise(shape: tuple[int, ...], rng: np.random.Generator, scale: float = 1.0) -> NDArray[np.float32]:
    return np.multiply(rng.random(shape, dtype=np.float32), scale, dtype=np.float32)


class Behaviour:
    """Acts greedily by `models` with probability 1 - `epsilon`, and at random otherwise, or always without models.

    Labels are the simulator's own, so that collecting does not wait for a segmenter. `on_policy` lets the classifier
    of `models` choose between push and grasp; otherwise a coin does. Depends on `seed` and the calls so far.
    """

    def __init__(self, robot: SimRobot, models: Models | None, epsilon: float, on_policy: bool, seed: int) -> None:
        self._robot = robot
        self._models = models
        self._epsilon = epsilon if models is not None else 1.0
        self._on_policy = on_policy and models is not None
        self._rng = np.random.default_rng(seed)

    def segment(self, color: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """The true labels of the frame that was observed last, (H, W) uint8."""
        return self._robot.truth_labels()

    def q_maps(self, maps: Heightmaps, mask: NDArray[np.bool_]) -> QMaps:
        """The critic's Q maps, slightly noisy, or random ones."""
        if self._models is None or self._rng.random() < self._epsilon:
            return random_maps(mask, maps.workspace, self._rng)
        return noisy(self._models.q_maps(maps, mask), self._rng)

    def grasp_probability(self, features: NDArray[np.float32]) -> float:
        """The classifier's probability on policy, a random number otherwise."""
        if self._models is not None and self._on_policy and self._rng.random() >= self._epsilon:
            return self._models.grasp_probability(features)
        return float(self._rng.random())
