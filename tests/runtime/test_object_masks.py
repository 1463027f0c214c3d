import numpy as np

from grasping_invisible.runtime.object_masks import object_masks


def test_objects_are_told_apart_by_height_and_class_the_largest_first(table_with) -> None:
    maps = table_with(
        (0.45, 0.1, 0.05, 0.05, "grey"),
        (0.50, 0.1, 0.05, 0.09, "grey"),  # beside it and higher
        (0.62, -0.1, 0.08, 0.05, "grey"),
        (0.38, -0.1, 0.04, 0.05, "red"),
        (0.42, -0.1, 0.04, 0.05, "blue"),  # beside it, as high, of another class
        (0.70, 0.15, 0.008, 0.05, "grey"),  # a speck
    )
    sizes = [np.count_nonzero(mask) * maps.workspace.resolution**2 for mask in object_masks(maps)]
    assert len(sizes) == 5
    assert sizes == sorted(sizes, reverse=True)
    for size, side in zip(sizes, (0.08, 0.05, 0.05, 0.04, 0.04), strict=True):
        assert abs(size - side**2) < 0.3 * side**2


def test_an_empty_table_holds_nothing(table_with) -> None:
    assert object_masks(table_with()) == []
