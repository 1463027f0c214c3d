import numpy as np
import pytest

from grasping_invisible.data.classes import CLASSES
from grasping_invisible.training.renders import Views
from grasping_invisible.training.segmenter_score import score_segmenter

RED, GREEN = CLASSES.index("red"), CLASSES.index("green")


def views(labels: np.ndarray, visible: dict[int, float]) -> Views:
    """One view whose blue channel is the truth, so that a labeller can look it up."""
    shares = np.full((1, len(CLASSES)), np.nan, np.float32)
    for index, share in visible.items():
        shares[0, index] = share
    color = np.zeros((1, *labels.shape, 3), np.uint8)
    color[0, :, :, 2] = labels
    return Views(color, labels[None], shares, np.array([True]))


@pytest.fixture
def piles() -> list[Views]:
    scene = np.zeros((20, 20), np.uint8)
    scene[:10, :10] = RED
    scene[15:, 12:] = GREEN
    return [views(scene, {RED: 0.9, GREEN: 0.2}), views(np.zeros((20, 20), np.uint8), {})]


def test_the_truth_scores_one(piles: list[Views]) -> None:
    scores = score_segmenter(lambda color: color[:, :, 2], piles)
    assert scores["miou"] == scores["miou_standard"] == scores["iou_occluded"] == 1.0
    assert scores["empty_false_pixels"] == 0
    assert "iou_blue" not in scores


def test_a_missed_half_halves_the_iou(piles: list[Views]) -> None:
    def label(color: np.ndarray) -> np.ndarray:
        labels = color[:, :, 2].copy()
        labels[:5][labels[:5] == RED] = 0
        return labels

    scores = score_segmenter(label, piles)
    assert scores["iou_red"] == pytest.approx(0.5)
    assert scores["iou_green"] == scores["iou_occluded"] == 1.0


def test_phantoms_in_empty_scenes_are_counted(piles: list[Views]) -> None:
    def label(color: np.ndarray) -> np.ndarray:
        labels = color[:, :, 2].copy()
        labels[19, :7] = RED
        return labels

    scores = score_segmenter(label, piles)
    assert scores["empty_false_pixels"] == scores["empty_false_worst"] == 7


def test_a_sliver_is_found_by_as_many_pixels_as_a_hint_needs() -> None:
    sliver, full = np.zeros((20, 20), np.uint8), np.zeros((20, 20), np.uint8)
    sliver[:2, :15] = RED
    full[:10, :12] = GREEN
    piles = [views(sliver, {RED: 0.05}), views(full, {GREEN: 0.2})]

    def label(shown: int):
        return lambda color: np.where(np.arange(20) < shown, color[:, :, 2], 0).astype(np.uint8)

    assert score_segmenter(label(2), piles)["slivers_found"] == 1.0
    assert score_segmenter(label(1), piles)["slivers_found"] == 0.0
