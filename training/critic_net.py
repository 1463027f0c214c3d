"""What every critic is: a network from rotated heightmaps to push and grasp Q values (paper, section V-A).

Q values lie within 0 and 1, as every return does (a reward of 0.5 and half of 1 at most, or 1): without that bound the
greatest value of a map is one of an action never tried.
"""

from abc import ABC, abstractmethod

import torch
from torch import Tensor, nn


class CriticNet(nn.Module, ABC):
    """Q values of every cell for the one direction its input is turned to (+column).

    `planes`: how many of `runtime.rotation.critic_planes` it sees, one of the values of `CRITIC_INPUTS`.
    """

    def __init__(self, planes: int) -> None:
        super().__init__()
        self.planes = planes

    @abstractmethod
    def forward(self, planes: Tensor) -> tuple[Tensor, Tensor]:
        """Planes (B, P, H, W), H and W multiples of 16, to Q values of pushes, low and raised, and of grasps.

        (B, 2, H, W) and (B, H, W).
        """

    def maps_by_kind(self, planes: Tensor) -> Tensor:
        """As `forward`, of planes on any device: the maps of pushes, low and raised, and of grasps, (B, 3, H, W)."""
        push, grasp = self(planes.to(self.device, memory_format=torch.channels_last))
        return torch.cat([push, grasp[:, None]], 1)

    @property
    def device(self) -> torch.device:
        """Where its weights are."""
        return next(self.parameters()).device


def executed(q_map: Tensor, places: Tensor) -> Tensor:
    """Q values where motions were executed: (B,) of `q_map` (B, M, H, W) at `places` (B, 3), (map, row, column)."""
    return q_map[torch.arange(len(q_map)), places[:, 0], places[:, 1], places[:, 2]]
