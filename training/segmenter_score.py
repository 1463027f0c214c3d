"""How well labels match the truth: intersection over union, in clutter, under heavy occlusion, in empty scenes."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from grasping_invisible.data.classes import CLASSES
from grasping_invisible.runtime.perception import MIN_HINT_PIXELS
from grasping_invisible.training.patches import patches
from grasping_invisible.training.renders import Views

HEAVY_OCCLUSION = 0.35  # of a class's blocks at most this share is in view
FEWEST_SEEN = 30  # pixels; with fewer in view a class counts as hidden, not as occluded
SLIVER = (20, 100)  # pixels of a patch, from so many to fewer than a target needs to count as seen


@dataclass
class Overlap:
    """Pixels of intersection and union, by class."""

    both: NDArray[np.int64] = field(default_factory=lambda: np.zeros(len(CLASSES), np.int64))
    either: NDArray[np.int64] = field(default_factory=lambda: np.zeros(len(CLASSES), np.int64))

    def add(self, confusion: NDArray[np.int64], classes: Iterable[int] = range(len(CLASSES))) -> None:
        """Count some classes of a confusion matrix (true class by labelled class)."""
        for index in classes:
            both = confusion[index, index]
            self.both[index] += both
            self.either[index] += confusion[index].sum() + confusion[:, index].sum() - both

    @property
    def iou(self) -> NDArray[np.float64]:
        """Intersection over union, (8,); NaN for a class that never occurred."""
        with np.errstate(invalid="ignore"):
            return self.both / self.either


def score_segmenter(
    label: Callable[[NDArray[np.uint8]], NDArray[np.uint8]], piles: Iterable[Views]
) -> dict[str, float]:
    """Scores of a labelling function, (H, W, 3) uint8 to (H, W) uint8, on held-out renders.

    `miou`: mean over the 8 classes, all views. `miou_standard`: of views as the simulator's camera takes them.
    `iou_occluded`: mean over the target colours where at most `HEAVY_OCCLUSION` of a class is in view.
    `slivers_found`: the share of patches as small as a `SLIVER` of which enough pixels for a hint are right.
    `empty_false_pixels`: mean number of pixels given a target class in a view without any; `empty_false_worst`: the
    most in one view. What the renders have no example of is left out.
    """
    every, standard, occluded = Overlap(), Overlap(), Overlap()
    false_pixels, slivers = [], []
    for pile in piles:
        for color, truth, visible, is_standard in zip(
            pile.color, pile.labels, pile.visible, pile.standard, strict=True
        ):
            labels = label(color)
            confusion = _confusion(truth, labels)
            every.add(confusion)
            if is_standard:
                standard.add(confusion)
            seen = confusion.sum(axis=1)
            hidden = np.flatnonzero((visible <= HEAVY_OCCLUSION) & (seen >= FEWEST_SEEN))
            occluded.add(confusion, hidden.tolist())
            slivers += _slivers_found(truth, labels)
            if not truth.any():
                false_pixels.append(int(np.count_nonzero(labels)))
    scores = {
        "miou": _mean(every.iou),
        "miou_standard": _mean(standard.iou),
        "iou_occluded": _mean(occluded.iou[1:]),
        "slivers_found": _mean(np.array(slivers, float)),
        "empty_false_pixels": _mean(np.array(false_pixels, float)),
        "empty_false_worst": float(max(false_pixels, default=np.nan)),
    }
    scores |= {f"iou_{name}": float(value) for name, value in zip(CLASSES, every.iou, strict=True)}
    return {name: value for name, value in scores.items() if np.isfinite(value)}


def _slivers_found(truth: NDArray[np.uint8], labels: NDArray[np.uint8]) -> list[bool]:
    """Of each sliver in the (H, W) truth, whether enough of it for a hint is labelled so."""
    fewest, most = SLIVER
    return [
        bool(np.count_nonzero(labels[patch] == index) >= MIN_HINT_PIXELS)
        for index, patch in patches(truth)
        if fewest <= np.count_nonzero(patch) < most
    ]


def _mean(values: NDArray[np.float64]) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else float("nan")


def _confusion(truth: NDArray[np.uint8], labels: NDArray[np.uint8]) -> NDArray[np.int64]:
    count = len(CLASSES)
    pairs = truth.astype(np.int64) * count + labels
    return np.bincount(pairs.ravel(), minlength=count * count).reshape(count, count)
