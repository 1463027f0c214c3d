"""The maps that an explorational push is chosen from (paper, sections IV-B and VII-A)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.runtime.clutter import clutter_prior
from grasping_invisible.runtime.failures import failure_likelihood
from grasping_invisible.runtime.heightmap import Heightmaps

# The paper's explorer and its ablations: which factors make a method's posterior.
FACTORS: dict[str, tuple[str, ...]] = {
    "explorer": ("clutter", "agnostic", "failure"),
    "clutter+agnostic": ("clutter", "agnostic"),
    "clutter-prior": ("clutter",),
    "agnostic-push": ("agnostic",),
}


@dataclass(frozen=True)
class ExplorationMaps:
    """What an explorational push is chosen from, on the action grid, float32.

    `clutter`: C_p, (16, 112, 112). `agnostic`: A_p, without negative values, (2, 16, 112, 112). `failure`: F_p,
    (16, 112, 112). `posterior`: the product of the factors that the method uses,
    (2, 16, 112, 112).
    """

    clutter: NDArray[np.float32]
    agnostic: NDArray[np.float32]
    failure: NDArray[np.float32]
    posterior: NDArray[np.float32]


def exploration_maps(
    maps: Heightmaps,
    q_push: NDArray[np.float32],
    failed_pushes: tuple[tuple[float, float], ...],
    method: str = "explorer",
) -> ExplorationMaps:
    """The factors and their product.

    `q_push`: (2, 16, 112, 112), or (16, 112, 112) for one level alone, the critic's push maps under a mask of ones.
    `failed_pushes`: where they acted, (x, y) in the base frame. `method`: a name in `FACTORS`.
    """
    factors = {
        "clutter": clutter_prior(maps),
        "agnostic": np.maximum(q_push, 0.0),
        "failure": failure_likelihood(failed_pushes, maps.workspace),
    }
    posterior = np.ones(q_push.shape, np.float32)
    for name in FACTORS[method]:
        posterior = posterior * factors[name]
    return ExplorationMaps(**factors, posterior=posterior)
