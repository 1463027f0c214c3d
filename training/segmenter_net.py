"""The segmenter: a Light-Weight RefineNet (paper, appendix B) on a small residual encoder of our own.

The encoder gives features at 1/4, 1/8, 1/16 and 1/32 of the image. The decoder is RefineNet with 1 x 1
convolutions: reduce, chained residual pooling (CRP), fuse with the next finer level. Logits come out at full
resolution by moving channels to pixels from features at 1/2, which keeps block edges sharp at little cost.
"""

import torch
from torch import Tensor, nn
from torch.nn import functional

from grasping_invisible.data.classes import CLASSES

STRIDE = 32  # images are padded to a multiple of this
# Centres and scales 8-bit colour; part of the exported graph, so the runtime hands over raw pixels.
COLOR_MEAN = 118.0
COLOR_SCALE = 64.0


def conv_bn(inputs: int, outputs: int, kernel: int, stride: int = 1) -> nn.Sequential:
    """A convolution with batch normalisation, "same" padding and no bias."""
    conv = nn.Conv2d(inputs, outputs, kernel, stride, kernel // 2, bias=False)
    return nn.Sequential(conv, nn.BatchNorm2d(outputs))


class ResidualBlock(nn.Module):
    """Two 3 x 3 convolutions around a shortcut; a 1 x 1 one on the shortcut where the shape changes."""

    def __init__(self, inputs: int, outputs: int, stride: int) -> None:
        super().__init__()
        self.first = conv_bn(inputs, outputs, 3, stride)
        self.second = conv_bn(outputs, outputs, 3)
        same_shape = inputs == outputs and stride == 1
        self.shortcut = nn.Identity() if same_shape else conv_bn(inputs, outputs, 1, stride)

    def forward(self, x: Tensor) -> Tensor:
        """(B, inputs, H, W) to (B, outputs, H / stride, W / stride)."""
        return functional.relu(self.second(functional.relu(self.first(x))) + self.shortcut(x))


class ChainedResidualPooling(nn.Module):
    """Gathers context: a chain of 5 x 5 max pooling and 1 x 1 convolution, each link added to the sum."""

    def __init__(self, channels: int, links: int = 2) -> None:
        super().__init__()
        self.links = nn.ModuleList(nn.Conv2d(channels, channels, 1, bias=False) for _ in range(links))

    def forward(self, x: Tensor) -> Tensor:
        """(B, C, H, W) to the same shape."""
        x = functional.relu(x)
        link_input = x
        for conv in self.links:
            link_input = conv(functional.max_pool2d(link_input, 5, 1, 2))
            x = x + link_input
        return x


class SegmenterNet(nn.Module):
    """Colour images to logits per class.

    `stem_width` channels at 1/2, `widths` at 1/4, 1/8, 1/16, 1/32, `decoder_width` throughout the decoder.
    """

    def __init__(
        self,
        stem_width: int = 16,
        widths: tuple[int, int, int, int] = (24, 48, 96, 128),
        decoder_width: int = 48,
    ) -> None:
        super().__init__()
        self.stem = conv_bn(3, stem_width, 3, 2)
        inputs = (stem_width, *widths[:-1])
        self.stages = nn.ModuleList(ResidualBlock(a, b, 2) for a, b in zip(inputs, widths, strict=True))
        self.reduce = nn.ModuleList(nn.Conv2d(width, decoder_width, 1, bias=False) for width in widths)
        self.pool = nn.ModuleList(ChainedResidualPooling(decoder_width) for _ in widths)
        self.adapt = nn.ModuleList(nn.Conv2d(decoder_width, decoder_width, 1, bias=False) for _ in widths[1:])
        self.fine = nn.Conv2d(decoder_width, stem_width, 1, bias=False)
        self.sharpen = conv_bn(stem_width, stem_width, 3)
        self.classify = nn.Conv2d(stem_width, 4 * len(CLASSES), 1)

    def quarters(self, color: Tensor) -> Tensor:
        """Logits (B, 8 * 4, H / 2, W / 2): of each class, the four pixels of every 2 x 2 square."""
        stem = functional.relu(self.stem((color - COLOR_MEAN) / COLOR_SCALE))
        levels = []
        x = stem
        for stage in self.stages:
            x = stage(x)
            levels.append(x)

        x = self.pool[-1](self.reduce[-1](levels[-1]))
        for level in (2, 1, 0):
            coarse = _double(self.adapt[level](x))
            x = self.pool[level](self.reduce[level](levels[level]) + coarse)

        edges = functional.relu(stem + _double(self.fine(x)))
        return self.classify(functional.relu(self.sharpen(edges)) + edges)

    def forward(self, color: Tensor) -> Tensor:
        """Logits (B, 8, H, W) of images (B, 3, H, W), 0..255; H and W multiples of `STRIDE`."""
        return functional.pixel_shuffle(self.quarters(color), 2)


def _double(x: Tensor) -> Tensor:
    return functional.interpolate(x, scale_factor=2.0, mode="bilinear", align_corners=False)


class SegmenterGraph(nn.Module):
    """What is exported: one raw image in, its label map out."""

    def __init__(self, net: SegmenterNet) -> None:
        super().__init__()
        self.net = net

    def forward(self, color: Tensor) -> Tensor:
        """(H, W, 3) uint8 RGB to (H, W) uint8 class indices; H and W multiples of `STRIDE`."""
        height, width = color.shape[0] // 2, color.shape[1] // 2
        # Labels are chosen before channels become pixels: moving a byte is cheaper than moving 8 floats.
        # And by a running comparison: ONNX Runtime's ArgMax over strided planes takes longer.
        quarters = self.net.quarters(color.permute(2, 0, 1)[None].float())[0]
        best, *others = quarters.split(4)
        labels = torch.zeros_like(best, dtype=torch.uint8)
        for index, logits in enumerate(others, start=1):
            labels = torch.where(logits > best, torch.tensor(index, dtype=torch.uint8), labels)
            best = torch.maximum(best, logits)
        return labels.reshape(2, 2, height, width).permute(2, 0, 3, 1).reshape(2 * height, 2 * width)
