"""Azimuthal modes: the block-circulant stiffness against a full one, wrinkles of the right length."""

import numpy as np
import pytest
import scipy.linalg

from vesdyn.case import Case
from vesdyn.diagnostics import Moment
from vesdyn.koiter import bending_stiffness
from vesdyn.modes import Modes
from vesdyn.spreading import Spreading
from vesdyn.stepping import march


def soft(thickness, edge, end):
    """The soft case of Fig. 9 and its `Moment` at ``end``."""
    sim = Spreading(Case(
        name="soft", model="axisymmetric", membrane={"shear_modulus": 0.302, "thickness": thickness},
        adhesion={"traction": 1.51}, mesh={"front_edge": edge, "far_edge": edge},
        time={"end": end, "step": "auto"}, output={"frames": ()},
    ))  # fmt: skip
    *_, state = march(sim)
    return sim, Moment(sim, state)


@pytest.mark.parametrize("thickness", [0.0, 0.05])
def test_rates_are_those_of_the_full_stiffness(thickness):
    """All eigenvalues of all modes together are those of the whole surface with its poles fixed."""
    sim, moment = soft(thickness, 0.15, 0.01)
    n = 8
    modes = Modes(sim, moment.state, n)
    x, force = modes._x, modes._forces
    full = np.empty((3 * n * modes.rings,) * 2)
    for i, k in np.ndindex(n * modes.rings, 3):
        sides = []
        for sign in (1.0, -1.0):
            y = x.copy()
            y[1 + i] += sign * 1e-6 * modes._frame.reshape(-1, 3, 3)[i, k]
            sides.append(force(y).ravel())
        full[:, 3 * i + k] = (sides[1] - sides[0]) / 2e-6
    area = np.repeat(modes.area, 3 * n)
    free = np.tile([True, True, False], n * modes.rings) | np.repeat(~modes.held, 3 * n)
    scaled = (full / np.sqrt(area[:, None] * area))[np.ix_(free, free)]
    lowest = scipy.linalg.eigvalsh(0.5 * (scaled + scaled.T))[0]
    assert max(modes.growth_rates(range(n))) == pytest.approx(-lowest / sim.case.drag, rel=1e-6)


def test_the_fastest_wrinkle_has_the_wavelength_of_a_compressed_sheet():
    """k^2 = |T_2| / (2 B) within 15 %: the shell is curved, and compressed over a band of finite width."""
    sim, moment = soft(0.01, 0.03, 0.03)
    modes = np.arange(2, 40)
    rates = Modes(sim, moment.state, 94).growth_rates(modes)
    hoop, height = moment.tensions[:, 1], moment.x[sim.body.elements, 1].min(axis=1)
    slackest = np.argmin(np.where(height > 0.1, hoop, np.inf))
    k = np.sqrt(-hoop[slackest] / (2 * bending_stiffness(0.302, 0.01)))
    assert rates.max() > 0.0
    assert modes[np.argmax(rates)] == pytest.approx(k * moment.x[slackest, 0], rel=0.15)


def test_a_thick_shell_does_not_wrinkle():
    sim, moment = soft(0.03, 0.04, 0.03)
    assert np.all(Modes(sim, moment.state, 70).growth_rates(range(2, 30)) < 0.0)
