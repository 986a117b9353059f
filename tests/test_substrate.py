"""The rigid plane: who is held, where a move ends, and who stays on it."""

import numpy as np
import pytest

from vesdyn.substrate import is_held, kept_landed, land


@pytest.mark.parametrize(
    "z, load, held",
    [(0.0, -1.0, True), (0.0, 0.0, True), (0.0, 1e-300, False), (1e-300, -1.0, False), (0.5, -1.0, False)],
)
def test_plane_pushes_what_touches_it_and_never_pulls(z, load, held):
    assert is_held(z, load) is held


@pytest.mark.parametrize(
    "gap, move, after, moved", [(0.5, -0.2, 0.3, -0.2), (0.1, -0.3, 0.0, -0.1), (0.0, -1.0, 0.0, 0.0), (0.0, 0.2, 0.2, 0.2)]
)
def test_a_move_ends_on_the_plane(gap, move, after, moved):
    assert land(gap, move) == pytest.approx((after, moved), abs=1e-16)


@pytest.mark.parametrize("columns", [2, 3])
def test_nodes_on_the_plane_stay_there_when_the_motion_is_continued(columns):
    x, moved = np.ones((3, columns)), np.full((3, columns), 2.0)
    x[:, -1], moved[:, -1] = (0.0, 0.1, 0.1), (0.3, -0.1, 0.2)
    assert kept_landed(x, moved)[:, -1].tolist() == [0.0, 0.0, 0.2]
    assert np.all(moved[:, :-1] == 2.0)
