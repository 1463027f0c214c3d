"""The action classifier f_a (paper, section IV-B): three linear layers, batch normalisation, ReLU."""

import torch
from torch import Tensor, nn

from grasping_invisible.runtime.classifier import FEATURES

WIDTH = 32


class ClassifierNet(nn.Module):
    """Tells states in which a grasp will succeed from states that need a push first.

    The first batch normalisation brings the features, as they are measured, to one scale. The count of failed grasps,
    c_g, weighs nothing until some example has another one than the rest: normalised by what never varied, a first
    failure would otherwise count hundreds of times, by a weight that was drawn at random.
    """

    def __init__(self, width: int = WIDTH) -> None:
        super().__init__()
        self.layers = nn.Sequential(
            nn.BatchNorm1d(len(FEATURES)),
            nn.Linear(len(FEATURES), width),
            nn.BatchNorm1d(width),
            nn.ReLU(),
            nn.Linear(width, width),
            nn.BatchNorm1d(width),
            nn.ReLU(),
            nn.Linear(width, 1),
        )
        with torch.no_grad():
            first = self.layers[1]
            assert isinstance(first, nn.Linear)
            first.weight[:, FEATURES.index("c_g")] = 0.0

    def forward(self, features: Tensor) -> Tensor:
        """Features (B, 5) to the logit of "grasp now", (B,)."""
        return self.layers(features)[:, 0]


class ClassifierGraph(nn.Module):
    """What is exported: features to probability."""

    def __init__(self, net: ClassifierNet) -> None:
        super().__init__()
        self.net = net

    def forward(self, features: Tensor) -> Tensor:
        """Features (B, 5) to the probability that a grasp succeeds, (B,)."""
        return self.net(features).sigmoid()
