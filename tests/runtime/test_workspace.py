import numpy as np
import pytest

from grasping_invisible.runtime.workspace import Workspace

WORKSPACE = Workspace()


def test_the_middles_of_all_cells_are_those_of_each():
    x, y = WORKSPACE.cell_centers()
    for row, column in ((0, 0), (0, 223), (223, 0), (100, 37)):
        assert (x[column], y[row, 0]) == WORKSPACE.cell_center(row, column)


def test_the_middle_of_some_cells_lies_between_them():
    cells = np.zeros((224, 224), np.bool_)
    cells[10:14, 20:30] = True
    assert WORKSPACE.middle_of(cells) == pytest.approx(WORKSPACE.cell_center(11.5, 24.5))
