"""The traction-separation law, its loads, its Boltzmann exponent and its work."""

import numpy as np
import pytest

from vesdyn.adhesion import (
    Adhesion,
    adhesion_load,
    adhesion_traction,
    adhesion_work,
    proximity,
    set_boltzmann_exponents,
)

LAW = Adhesion(traction=2.0, cutoff=0.1, ligand_ratio=8.0, frozen=False)
FROZEN = LAW._replace(frozen=True)
ROUND_OFF = 1e-14


@pytest.mark.parametrize(
    "gap, density, traction",
    [(0.0, 1.0, 2.0), (0.05, 1.0, 1.0), (0.075, 2.0, 1.0), (0.1, 1.0, 0.0), (0.2, 5.0, 0.0),
     (0.0, 8.0, 16.0), (0.0, 9.0, 16.0), (0.05, 80.0, 8.0), (0.0, 0.0, 0.0), (-0.01, 1.0, 2.0)],
)
def test_traction_separation_law(gap, density, traction):
    assert adhesion_traction(LAW, gap, density) == pytest.approx(traction, rel=ROUND_OFF, abs=ROUND_OFF)
    area = 0.3
    assert adhesion_load(LAW, gap, density * area, area) == pytest.approx(traction * area, rel=ROUND_OFF, abs=ROUND_OFF)


def test_proximity_is_linear_and_ends_at_the_cutoff():
    assert [proximity(LAW, gap) for gap in (-1.0, 0.0, 0.025, 0.1, 0.3)] == [1.0, 1.0, 0.75, 0.0, 0.0]


def test_frozen_receptors_pull_on_the_current_area_whatever_their_number():
    assert adhesion_load(FROZEN, 0.05, 123.0, 0.3) == pytest.approx(0.3, rel=ROUND_OFF)


def test_exponent_falls_along_the_drift():
    """phi = L T_max (d_c/2) (1 - d/d_c)^2, and -dphi/dz = L T(d, 1), the drift of (4)."""
    z = np.linspace(0.0, 0.15, 301)
    phi = np.zeros(len(z))
    set_boltzmann_exponents(17.5, LAW, np.stack([np.ones(301), z], axis=1), phi)
    assert phi[0] == pytest.approx(17.5 * 2.0 * 0.05, rel=ROUND_OFF)
    assert np.all(phi[z >= 0.1] == 0.0)
    # central differences are exact for a parabola; the kink of the slope at the cutoff is left out
    slope = (phi[2:] - phi[:-2]) / (z[2:] - z[:-2])
    drift = 17.5 * np.array([adhesion_traction(LAW, gap, 1.0) for gap in z[1:-1]])
    smooth = np.abs(z[1:-1] - 0.1) > 6e-4
    assert np.abs(slope + drift)[smooth].max() < 1e-11  # 1e-16 phi / dz


@pytest.mark.parametrize("columns", [2, 3])
def test_work_is_the_loss_of_potential_for_held_numbers(columns):
    """Potential N T_max (d_c/2) (1 - d/d_c)^2 below saturation: the mean of the end loads is exact."""
    rng = np.random.default_rng(1)
    x_old, x = rng.uniform(0.0, 0.1, (2, 20, columns))
    number, area_old, area = rng.uniform(0.1, 0.2, (3, 20))

    def potential(z):
        return 2.0 * 0.05 * (1.0 - z / 0.1) ** 2

    expected = np.sum(number * (potential(x[:, -1]) - potential(x_old[:, -1])))
    assert adhesion_work(LAW, number, x_old, area_old, x, area) == pytest.approx(expected, rel=1e-13)
