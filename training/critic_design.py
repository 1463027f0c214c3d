"""Which network a critic is and what it sees, by name."""

from collections.abc import Callable
from pathlib import Path

import msgspec

from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.runtime.rotation import CRITIC_INPUTS
from grasping_invisible.training.checkpoint import Checkpoint, finished_checkpoint, load_weights
from grasping_invisible.training.critic_net import CriticNet
from grasping_invisible.training.densenet_critic import DenseNetCritic
from grasping_invisible.training.light_critic import LightCritic

NETWORKS: dict[str, Callable[[int], CriticNet]] = {"light": LightCritic, "densenet": DenseNetCritic}


class CriticDesign(msgspec.Struct, frozen=True):
    """`network`: a name in `NETWORKS`. `inputs`: one in `CRITIC_INPUTS` (paper, appendix on additional training)."""

    network: str = "light"
    inputs: str = "depth+mask"

    def __str__(self) -> str:
        return f"{self.network}, {self.inputs}"

    def build(self) -> CriticNet:
        """An untrained critic. Raises `BadInput` for unknown names."""
        for what, name, known in (("network", self.network, NETWORKS), ("inputs", self.inputs, CRITIC_INPUTS)):
            if name not in known:
                raise BadInput(f"unknown critic {what} {name!r}; known: {', '.join(known)}")
        return NETWORKS[self.network](CRITIC_INPUTS[self.inputs])


def design_of(checkpoint: Checkpoint) -> CriticDesign:
    """What a critic's checkpoint says of its design."""
    return msgspec.convert(checkpoint.design, CriticDesign)


def critic_of(checkpoint: Checkpoint, source: Path) -> CriticNet:
    """The critic of a checkpoint that was read from `source`, of whatever design; raises `BadInput`."""
    net = design_of(checkpoint).build()
    load_weights(net, checkpoint, source)
    return net


def load_critic(path: Path) -> CriticNet:
    """The finished critic in a checkpoint's file; raises `BadInput`."""
    return critic_of(finished_checkpoint(path, "critic"), path)
