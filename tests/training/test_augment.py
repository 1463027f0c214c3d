import numpy as np

from grasping_invisible.data.classes import CLASSES
from grasping_invisible.training.augment import draw_crop
from grasping_invisible.training.renders import Views

RED, GREEN = CLASSES.index("red"), CLASSES.index("green")
SIZE = 64


def test_crops_often_show_small_patches():
    labels = np.zeros((480, 640), np.uint8)
    labels[100:300, 100:300] = RED
    labels[400:404, 500:512] = GREEN
    color = np.zeros((1, 480, 640, 3), np.uint8)
    pile = Views(color, labels[None], np.full((1, len(CLASSES)), np.nan, np.float32), np.array([True]))
    rng = np.random.default_rng(0)

    shown = [np.unique(draw_crop(rng, [pile], SIZE)[1]) for _ in range(300)]

    share = {index: np.mean([index in seen for seen in shown]) for index in (RED, GREEN)}
    assert share[GREEN] > 0.25  # one in three is drawn around it, among crops of which it would be in hardly any
    assert share[RED] > 0.25


def test_a_view_without_any_block_gives_crops_too():
    pile = Views(
        np.full((1, 480, 640, 3), 90, np.uint8),
        np.zeros((1, 480, 640), np.uint8),
        np.full((1, len(CLASSES)), np.nan, np.float32),
        np.array([True]),
    )
    rng = np.random.default_rng(0)
    for _ in range(20):
        color, labels = draw_crop(rng, [pile], SIZE)
        assert color.shape == (SIZE, SIZE, 3)
        assert not labels.any()
