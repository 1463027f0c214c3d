"""The critic that runs on the edge: a small U-Net that answers for all 16 rotations within 20 ms on two CPU cores.

One trunk feeds two heads, one for each primitive, as in the paper (section V-A), whose trunk is DenseNet-121.
"""

from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn import functional

from grasping_invisible.data.action_grid import PUSH_LEVELS
from grasping_invisible.training.critic_net import CriticNet

WIDTHS = (16, 32, 64, 96)


def conv_bn_relu(inputs: int, outputs: int, stride: int = 1) -> nn.Sequential:
    """A 3 x 3 convolution, batch normalisation and ReLU."""
    conv = nn.Conv2d(inputs, outputs, 3, stride, 1, bias=False)
    return nn.Sequential(conv, nn.BatchNorm2d(outputs), nn.ReLU())


def separable(channels: int) -> nn.Sequential:
    """A 3 x 3 convolution of each channel and a 1 x 1 across them, at a fraction of a full one's cost."""
    return nn.Sequential(
        nn.Conv2d(channels, channels, 3, 1, 1, groups=channels, bias=False),
        nn.BatchNorm2d(channels),
        nn.ReLU(),
        nn.Conv2d(channels, channels, 1, bias=False),
        nn.BatchNorm2d(channels),
        nn.ReLU(),
    )


class Head(nn.Module):
    """Trunk features at half resolution to Q maps at full resolution."""

    def __init__(self, width: int, maps: int) -> None:
        super().__init__()
        self.mix = separable(width)
        self.quarters = nn.Conv2d(width, 4 * maps, 1)

    def forward(self, features: Tensor) -> Tensor:
        """(B, width, H / 2, W / 2) to (B, maps, H, W), values within 0 and 1."""
        full = functional.pixel_shuffle(self.quarters(self.mix(features)), 2)
        # An arm is a few millimetres off: a cell is worth what its surroundings are.
        return torch.sigmoid(functional.avg_pool2d(full, 3, 1, 1, count_include_pad=False))


class LightCritic(CriticNet):
    """See the module."""

    def __init__(self, planes: int, widths: tuple[int, int, int, int] = WIDTHS) -> None:
        super().__init__(planes)
        inputs = (planes, *widths[:-1])
        mixes = [*(separable(width) for width in widths[:-1]), conv_bn_relu(widths[-1], widths[-1])]
        self.down = nn.ModuleList(
            nn.Sequential(conv_bn_relu(a, b, 2), mix) for a, b, mix in zip(inputs, widths, mixes, strict=True)
        )
        fine_to_coarse = list(pairwise(widths))
        self.narrow = nn.ModuleList(nn.Conv2d(coarse, fine, 1, bias=False) for fine, coarse in fine_to_coarse)
        self.up = nn.ModuleList(separable(fine) for fine, _ in fine_to_coarse)
        self.push = Head(widths[0], len(PUSH_LEVELS))
        self.grasp = Head(widths[0], 1)

    def forward(self, planes: Tensor) -> tuple[Tensor, Tensor]:
        """See `CriticNet`."""
        levels = []
        x = planes
        for stage in self.down:
            x = stage(x)
            levels.append(x)
        for level in (2, 1, 0):
            x = functional.interpolate(self.narrow[level](x), scale_factor=2.0, mode="bilinear")
            x = self.up[level](x + levels[level])
        return self.push(x), self.grasp(x)[:, 0]
