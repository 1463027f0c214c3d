"""The exploration policy: where to push while the target is not seen (paper, sections IV-B and VII-A)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.runtime.choice import Choice, best_action
from grasping_invisible.runtime.clutter import clutter_prior
from grasping_invisible.runtime.failures import failure_likelihood
from grasping_invisible.runtime.heightmap import Heightmaps

# The paper's explorer and its ablations: which factors make a method's posterior.
EXPLORERS: dict[str, tuple[str, ...]] = {
    "explorer": ("clutter", "agnostic", "failure"),
    "clutter+agnostic": ("clutter", "agnostic"),
    "clutter-prior": ("clutter",),
    "agnostic-push": ("agnostic",),
}


@dataclass(frozen=True)
class ExplorationMaps:
    """What an explorational push is chosen from, on the action grid, (16, 112, 112) float32 each.

    `clutter`: C_p. `agnostic`: A_p, without negative values. `failure`: F_p, the same for every rotation.
    `posterior`: the product of the factors that the method uses.
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

    `q_push`: (16, 112, 112), the critic's push maps under a mask of ones. `failed_pushes`: (x, y) in the base
    frame. `method`: a name in `EXPLORERS`.
    """
    factors = {
        "clutter": clutter_prior(maps),
        "agnostic": np.maximum(q_push, 0.0),
        "failure": np.broadcast_to(failure_likelihood(failed_pushes, maps.workspace), q_push.shape),
    }
    posterior = np.ones(q_push.shape, np.float32)
    for name in EXPLORERS[method]:
        posterior = posterior * factors[name]
    return ExplorationMaps(**factors, posterior=posterior)


def explore(maps: ExplorationMaps, allowed: NDArray[np.bool_], rng: np.random.Generator) -> tuple[Choice, str]:
    """The push of the greatest posterior, and what it was chosen by.

    `allowed`: (16, 112, 112) bool, not all false. Where the posterior is 0 everywhere, as on a heap without
    edges, the failure likelihood together with either of the other factors decides, and at last the failure
    likelihood alone.
    """
    for values, by in (
        (maps.posterior, "posterior"),
        (maps.clutter * maps.failure, "clutter and failures"),
        (maps.agnostic * maps.failure, "agnostic push and failures"),
        (maps.failure, "failures alone"),
    ):
        choice = best_action(values, allowed, rng)
        if choice is not None and choice.value > 0.0:
            return choice, by
    raise ValueError("no push is allowed")
