"""The rigid plane: who is held."""

import pytest

from vesdyn.substrate import is_held


@pytest.mark.parametrize(
    "z, load, held",
    [(0.0, -1.0, True), (0.0, 0.0, True), (0.0, 1e-300, False), (1e-300, -1.0, False), (0.5, -1.0, False)],
)
def test_plane_pushes_what_touches_it_and_never_pulls(z, load, held):
    assert is_held(z, load) is held
