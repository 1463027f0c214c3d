"""DenseNet-121 without its classifier (Huang et al., 2017), with the parameter names that torchvision gives it.

Written here because torchvision's wheels from the package registry are built for one torch, CUDA included, and fail
beside a CPU build of torch.
"""

from collections import OrderedDict

import torch
from torch import Tensor, nn
from torch.nn import functional

LAYERS_121 = (6, 12, 24, 16)  # of each block
GROWTH = 32  # channels that each layer adds
STEM = 64  # channels of the first convolution
BOTTLENECK = 4 * GROWTH


class DenseLayer(nn.Module):
    """Adds `GROWTH` channels to those it is given."""

    def __init__(self, inputs: int) -> None:
        super().__init__()
        self.norm1 = nn.BatchNorm2d(inputs)
        self.conv1 = nn.Conv2d(inputs, BOTTLENECK, 1, bias=False)
        self.norm2 = nn.BatchNorm2d(BOTTLENECK)
        self.conv2 = nn.Conv2d(BOTTLENECK, GROWTH, 3, padding=1, bias=False)

    def forward(self, features: Tensor) -> Tensor:
        """(B, C, H, W) to (B, C + GROWTH, H, W)."""
        narrow = self.conv1(functional.relu(self.norm1(features)))
        return torch.cat([features, self.conv2(functional.relu(self.norm2(narrow)))], 1)


class DenseNet(nn.Module):
    """Images (B, `inputs`, H, W) to features (B, `channels`, H / 32, W / 32)."""

    def __init__(self, inputs: int, layers: tuple[int, ...] = LAYERS_121) -> None:
        super().__init__()
        self.features = nn.Sequential(
            OrderedDict[str, nn.Module](
                conv0=nn.Conv2d(inputs, STEM, 7, 2, 3, bias=False),
                norm0=nn.BatchNorm2d(STEM),
                relu0=nn.ReLU(),
                pool0=nn.MaxPool2d(3, 2, 1),
            )
        )
        channels = STEM
        for block, count in enumerate(layers, 1):
            dense = OrderedDict[str, nn.Module](
                (f"denselayer{i + 1}", DenseLayer(channels + i * GROWTH)) for i in range(count)
            )
            self.features.add_module(f"denseblock{block}", nn.Sequential(dense))
            channels += count * GROWTH
            if block < len(layers):
                self.features.add_module(f"transition{block}", _transition(channels))
                channels //= 2
        self.features.add_module("norm5", nn.BatchNorm2d(channels))
        self.channels = channels

    def forward(self, images: Tensor) -> Tensor:
        """See the class."""
        return functional.relu(self.features(images))


def _transition(channels: int) -> nn.Sequential:
    """Half the channels at half the size."""
    return nn.Sequential(
        OrderedDict[str, nn.Module](
            norm=nn.BatchNorm2d(channels),
            relu=nn.ReLU(),
            conv=nn.Conv2d(channels, channels // 2, 1, bias=False),
            pool=nn.AvgPool2d(2, 2),
        )
    )
