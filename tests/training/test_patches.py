import numpy as np

from grasping_invisible.training.patches import patches


def test_each_connected_part_of_a_class_is_a_patch():
    labels = np.zeros((8, 8), np.uint8)
    labels[:2, :2] = 3
    labels[2, 2] = 3  # touches by a corner
    labels[6:, 6:] = 3
    labels[:2, 2:4] = 5  # another class beside it
    found = sorted((index, int(mask.sum())) for index, mask in patches(labels))
    assert found == [(3, 4), (3, 5), (5, 4)]


def test_an_empty_image_has_none():
    assert list(patches(np.zeros((4, 4), np.uint8))) == []
