"""Training the segmenter on synthetic renders with domain randomisation (paper, appendix B)."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch
from numpy.typing import NDArray
from rich.console import Console
from torch.nn import functional

from grasping_invisible.data.progress import bar
from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.training.augment import draw_crop
from grasping_invisible.training.checkpoint import Checkpoint
from grasping_invisible.training.device import training_device
from grasping_invisible.training.fingerprint import data_fingerprint
from grasping_invisible.training.patches import patches
from grasping_invisible.training.renders import HELD_OUT_SEEDS, VIEWS, Views, load_pile, render_missing
from grasping_invisible.training.segmenter_net import SegmenterGraph, SegmenterNet
from grasping_invisible.training.segmenter_score import score_segmenter
from grasping_invisible.training.session import Session

FULL_PIXELS = 1000  # of a patch in a crop; with fewer each weighs more
SLIVER_WEIGHT = 6.0  # at most
AROUND = 7  # pixels, 3 to each side
WATCHED = 3  # held-out piles of which the curves during a training are drawn; the scores at its end are of all


@dataclass(frozen=True)
class SegmenterTraining:
    """What to train on and for how long. `piles` and `held_out`: numbers of piles, `VIEWS` renders of each."""

    renders: Path
    checkpoint: Path
    piles: int = 220
    held_out: int = 40
    steps: int = 3000
    batch: int = 10
    crop: int = 256  # pixels, square
    learning_rate: float = 4e-3
    seed: int = 0


def train_segmenter(settings: SegmenterTraining, console: Console) -> Checkpoint:
    """Render what is missing, train, score on held-out piles; resumes from the checkpoint where there is one."""
    seeds = range(settings.seed * settings.piles, (settings.seed + 1) * settings.piles)
    if seeds.stop > HELD_OUT_SEEDS:
        raise BadInput(
            f"seed {settings.seed} with {settings.piles} piles would train on those held out, which begin with number "
            f"{HELD_OUT_SEEDS}: take a smaller seed"
        )
    held_out = range(HELD_OUT_SEEDS, HELD_OUT_SEEDS + settings.held_out)
    torch.manual_seed(settings.seed)
    net = SegmenterNet().to(training_device())
    optimizer = torch.optim.AdamW(net.parameters(), settings.learning_rate, weight_decay=1e-4)
    data = data_fingerprint({str(seed): VIEWS for seed in (*seeds, *held_out)})
    numbers = {"batch": settings.batch, "crop": settings.crop, "seed": settings.seed}
    session = Session(
        "segmenter", settings.checkpoint, net, optimizer, settings.learning_rate, settings.steps, data, numbers
    )
    with bar("rendering", len(seeds) + len(held_out), console) as advance:
        for _ in render_missing(settings.renders, [*held_out, *seeds]):
            advance()

    if not session.finished:
        piles = [load_pile(settings.renders, seed) for seed in seeds]
        net.train()
        watched = list(_counted(settings.renders, held_out[:WATCHED], lambda: None))
        session.run(
            lambda step: _losses(net, piles, settings, step),
            console,
            measure=lambda: score_segmenter(labeller(net), watched),
        )

    label = labeller(net)
    with bar("scoring", settings.held_out, console) as advance:
        scores = score_segmenter(label, _counted(settings.renders, held_out, advance))
    return session.finish(
        scores,
        {
            "renders": len(seeds) * VIEWS,
            "held_out_renders": len(held_out) * VIEWS,
        },
    )


def labeller(net: SegmenterNet):
    """The network as a function from (H, W, 3) uint8 to (H, W) uint8 labels."""
    graph = SegmenterGraph(net).eval()
    device = training_device()

    def label(color: NDArray[np.uint8]) -> NDArray[np.uint8]:
        with torch.inference_mode():
            return graph(torch.from_numpy(color).to(device)).cpu().numpy()

    return label


def _losses(net: SegmenterNet, piles: list[Views], settings: SegmenterTraining, step: int) -> dict[str, torch.Tensor]:
    """Cross-entropy of one batch, slivers weighing more; the batch depends on seed and step alone."""
    rng = np.random.default_rng((settings.seed, step))
    crops = [draw_crop(rng, piles, settings.crop) for _ in range(settings.batch)]
    color = torch.from_numpy(np.stack([color for color, _ in crops])).permute(0, 3, 1, 2).float()
    labels = torch.from_numpy(np.stack([labels for _, labels in crops])).long()
    weights = torch.from_numpy(np.stack([_pixel_weights(labels) for _, labels in crops]))
    device = training_device()
    losses = functional.cross_entropy(net(color.to(device)), labels.to(device), reduction="none")
    return {"loss": (losses * weights.to(device)).mean()}


def _pixel_weights(labels: NDArray[np.uint8]) -> NDArray[np.float32]:
    """1, and up to `SLIVER_WEIGHT` in and around patches of few pixels: (S, S) uint8 labels to float32.

    Around them as well, or a sliver would be labelled broader than it is.
    """
    weights = np.ones(labels.shape, np.float32)
    for _, patch in patches(labels):
        weight = np.clip(np.sqrt(FULL_PIXELS / np.count_nonzero(patch)), 1.0, SLIVER_WEIGHT)
        around = cv2.dilate(patch.astype(np.uint8), np.ones((AROUND, AROUND), np.uint8)) > 0
        weights[around] = np.maximum(weights[around], weight)
    return weights


def _counted(folder: Path, seeds: range, advance):
    for seed in seeds:
        yield load_pile(folder, seed)
        advance()
