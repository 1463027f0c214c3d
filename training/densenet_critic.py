"""The paper's own critic (section V-A): residual extractors, a DenseNet-121 trunk, residual heads, bilinear upsampling.

Colour, depth and mask each pass an extractor of two residual layers; their features together are what the trunk sees;
a head of three residual layers for each primitive gives its Q map. A layer is read here as a residual block of two
convolutions. It is far too slow for an edge computer and is here to compare with.
"""

from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn import functional

from grasping_invisible.data.action_grid import PUSH_LEVELS
from grasping_invisible.runtime.rotation import PLANES
from grasping_invisible.training.critic_net import CriticNet
from grasping_invisible.training.densenet import LAYERS_121, DenseNet

ENLARGED = 4  # times; the paper's rotated heightmaps have 640 x 640 pixels, and the trunk's features a 32nd of that
EXTRACTED = 3  # channels of each extractor: as many as the trunk's first convolution has for a picture on ImageNet
COLOR_PLANES = 3
HEAD_WIDTHS = (128, 64, 32)


class ResidualLayer(nn.Module):
    """Two 3 x 3 convolutions with batch normalisation beside a shortcut (He et al., 2016)."""

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.convolutions = nn.Sequential(
            nn.Conv2d(inputs, outputs, 3, padding=1, bias=False),
            nn.BatchNorm2d(outputs),
            nn.ReLU(),
            nn.Conv2d(outputs, outputs, 3, padding=1, bias=False),
            nn.BatchNorm2d(outputs),
        )
        widened = nn.Sequential(nn.Conv2d(inputs, outputs, 1, bias=False), nn.BatchNorm2d(outputs))
        self.shortcut = nn.Identity() if inputs == outputs else widened

    def forward(self, features: Tensor) -> Tensor:
        """(B, inputs, H, W) to (B, outputs, H, W)."""
        return functional.relu(self.convolutions(features) + self.shortcut(features))


class DenseNetCritic(CriticNet):
    """See the module."""

    def __init__(self, planes: int, trunk_layers: tuple[int, ...] = LAYERS_121) -> None:
        super().__init__(planes)
        # Colour, depth, mask; or depth and mask where it sees no colour.
        self.parts = [COLOR_PLANES, 1, 1] if planes == PLANES else [1, 1]
        self.extractors = nn.ModuleList(
            nn.Sequential(ResidualLayer(part, EXTRACTED), ResidualLayer(EXTRACTED, EXTRACTED)) for part in self.parts
        )
        self.trunk = DenseNet(EXTRACTED * len(self.parts), trunk_layers)
        self.push = _head(self.trunk.channels, len(PUSH_LEVELS))
        self.grasp = _head(self.trunk.channels, 1)

    def forward(self, planes: Tensor) -> tuple[Tensor, Tensor]:
        """See `CriticNet`."""
        enlarged = functional.interpolate(planes, scale_factor=float(ENLARGED), mode="bilinear")
        parts = enlarged.split(self.parts, 1)
        extracted = [extractor(part) for extractor, part in zip(self.extractors, parts, strict=True)]
        features = self.trunk(torch.cat(extracted, 1))
        push, grasp = (
            functional.interpolate(head(features), size=planes.shape[-2:], mode="bilinear")
            for head in (self.push, self.grasp)
        )
        return torch.sigmoid(push), torch.sigmoid(grasp)[:, 0]


def _head(channels: int, maps: int) -> nn.Sequential:
    widths = (channels, *HEAD_WIDTHS)
    layers = [ResidualLayer(inputs, outputs) for inputs, outputs in pairwise(widths)]
    return nn.Sequential(*layers, nn.Conv2d(widths[-1], maps, 1))
