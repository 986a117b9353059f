"""Traction-separation laws: each law whole, their loads, Boltzmann exponents and work, and patterns of ligands."""

import numpy as np
import pytest
from scipy.integrate import quad

from vesdyn import adhesion
from vesdyn.adhesion import LAWS, Linear, TractionSeparation, adhesion_load, adhesion_traction, adhesion_work, piecewise
from vesdyn.case import Adhesion, Ligands

LAW = TractionSeparation(Linear(0.1), traction=2.0, ligand_ratio=8.0, frozen=False)
FROZEN = LAW._replace(frozen=True)
ROUND_OFF = 1e-14


# Every law


@pytest.mark.parametrize("name", LAWS)
class TestEveryLaw:
    """What the rest of the package relies on, whatever the law."""

    def law(self, name):
        return LAWS[name](Adhesion(law=name, cutoff=0.1))

    def test_shape_is_one_at_the_substrate_and_nothing_beyond_the_cutoff(self, name):
        law = self.law(name)
        assert adhesion.shape(law, 0.0) == adhesion.shape(law, -0.01) == 1.0
        assert [adhesion.shape(law, d) for d in (0.1, 0.2)] == [0.0, 0.0]
        assert [adhesion.integral(law, d) for d in (0.1, 0.2)] == [0.0, 0.0]

    def test_integral_is_that_of_the_shape(self, name):
        law = self.law(name)
        for d in np.linspace(0.0, 0.099, 37):
            knots = [k for k in getattr(law, "knot", []) if d < k < 0.1]
            exact = quad(lambda x: adhesion.shape(law, x), d, 0.1, points=knots or None, epsabs=1e-14)[0]
            assert adhesion.integral(law, d) == pytest.approx(exact, abs=1e-13)

    def test_no_slope_exceeds_the_bound_and_one_reaches_it(self, name):
        law = self.law(name)
        d = np.linspace(0.0, 0.1, 20_001)
        slope = np.diff([adhesion.shape(law, x) for x in d]) / np.diff(d)
        assert np.abs(slope).max() <= adhesion.steepest_slope(law) * (1 + 1e-9)
        assert np.abs(slope).max() >= 0.999 * adhesion.steepest_slope(law)

    def test_drift_is_the_slope_of_the_exponent(self, name):
        """-dphi/dz = L T(d, 1), the drift of (4); central differences, the kinks of the law left out."""
        law = LAW._replace(law=self.law(name))
        z = np.linspace(0.0, 0.15, 3001)
        phi = np.zeros(len(z))
        adhesion.set_boltzmann_exponents(17.5, law, np.ones(len(z)), np.stack([np.ones(len(z)), z], axis=1), phi)
        slope = (phi[2:] - phi[:-2]) / (z[2:] - z[:-2])
        drift = 17.5 * np.array([adhesion_traction(law, gap, 1.0, 1.0) for gap in z[1:-1]])
        kinks = np.append(getattr(law.law, "knot", []), 0.1)
        smooth = np.abs(z[1:-1, None] - kinks).min(axis=1) > 6e-5
        assert np.abs(slope + drift)[smooth].max() < 1e-10  # 1e-16 phi / dz

    def test_potential_is_that_of_the_load(self, name):
        law = LAW._replace(law=self.law(name))
        for d in (0.003, 0.021, 0.047, 0.0903):
            up, down = (adhesion.adhesion_potential(law, d + h, 0.7, 0.3, 0.9) for h in (1e-6, -1e-6))
            assert (up - down) / 2e-6 == pytest.approx(adhesion_load(law, d, 0.7, 0.3, 0.9), rel=1e-7, abs=1e-9)


def test_double_well_attracts_repels_and_attracts():
    law = LAWS["double_well"](Adhesion(law="double_well", cutoff=0.2, well=0.2, barrier=0.5, tail=0.1))
    assert [round(adhesion.shape(law, 0.2 * s), 12) for s in (0.1, 0.2, 0.4, 0.6, 0.8, 0.9)] == [
        0.5, 0.0, -0.5, 0.0, 0.1, 0.05,
    ]  # fmt: skip
    # areas of a half triangle and two triangles of base 0.4 cutoff
    assert adhesion.integral(law, 0.0) == pytest.approx(0.2 * (0.1 - 0.1 + 0.02), abs=1e-15)


def test_a_law_may_have_any_knots():
    law = piecewise([0.0, 0.02, 0.1], [1.0, 0.25, 0.0])
    assert adhesion.shape(law, 0.01) == pytest.approx(0.625)
    assert adhesion.integral(law, 0.0) == pytest.approx(0.0125 + 0.01)
    assert adhesion.steepest_slope(law) == pytest.approx(37.5)


# Loads


@pytest.mark.parametrize(
    "gap, density, traction",
    [(0.0, 1.0, 2.0), (0.05, 1.0, 1.0), (0.075, 2.0, 1.0), (0.1, 1.0, 0.0), (0.2, 5.0, 0.0),
     (0.0, 8.0, 16.0), (0.0, 9.0, 16.0), (0.05, 80.0, 8.0), (0.0, 0.0, 0.0), (-0.01, 1.0, 2.0)],
)
def test_traction_separation_law(gap, density, traction):
    assert adhesion_traction(LAW, gap, density, 1.0) == pytest.approx(traction, rel=ROUND_OFF, abs=ROUND_OFF)
    area = 0.3
    load = adhesion_load(LAW, gap, density * area, area, 1.0)
    assert load == pytest.approx(traction * area, rel=ROUND_OFF, abs=ROUND_OFF)


@pytest.mark.parametrize("density, ligands, traction", [(1.0, 0.5, 1.0), (3.0, 0.5, 3.0), (6.0, 0.5, 4.0), (6.0, 0.0, 0.0)])
def test_fewer_ligands_pull_less_and_saturate_earlier(density, ligands, traction):
    """T = T_max l min(c, q l) at gap 0."""
    assert adhesion_traction(LAW, 0.0, density, ligands) == pytest.approx(traction, rel=ROUND_OFF)


def test_frozen_receptors_pull_on_the_current_area_whatever_their_number():
    assert adhesion_load(FROZEN, 0.05, 123.0, 0.3, 1.0) == pytest.approx(0.3, rel=ROUND_OFF)


@pytest.mark.parametrize("columns", [2, 3])
def test_work_is_the_loss_of_potential_for_held_numbers(columns):
    """Potential N T_max (d_c/2) (1 - d/d_c)^2 below saturation: the mean of the end loads is exact."""
    rng = np.random.default_rng(1)
    x_old, x = rng.uniform(0.0, 0.1, (2, 20, columns))
    number, area_old, area = rng.uniform(0.1, 0.2, (3, 20))

    def potential(z):
        return 2.0 * 0.05 * (1.0 - z / 0.1) ** 2

    expected = np.sum(number * (potential(x[:, -1]) - potential(x_old[:, -1])))
    assert adhesion_work(LAW, number, np.ones(20), x_old, area_old, x, area) == pytest.approx(expected, rel=1e-13)


# Ligands


@pytest.mark.parametrize("pattern", adhesion.PATTERNS)
def test_patterns_lie_between_elsewhere_and_one_and_ignore_the_height(pattern):
    x = np.random.default_rng(0).uniform(-1.0, 1.0, (1000, 3))
    section = Ligands(pattern=pattern, width=0.3, period=0.7, elsewhere=0.2)
    density = adhesion.ligand_density(section, x)
    assert density.max() == 1.0 and density.min() == (1.0 if pattern == "even" else 0.2)
    assert np.array_equal(density, adhesion.ligand_density(section, x * [1.0, 1.0, 0.0]))


def test_where_the_ligands_are():
    x = np.array([[0.0, 0.0, 0.0], [0.14, 0.0, 0.0], [0.16, 0.0, 0.0], [0.0, 0.4, 0.0], [0.6, 0.0, 0.0], [-0.6, 0.6, 0.0]])
    wanted = {"disc": [1, 1, 0, 0, 0, 0], "stripe": [1, 1, 0, 1, 0, 0], "stripes": [1, 1, 0, 1, 1, 1], "squares": [1, 1, 0, 0, 1, 1]}
    for pattern, density in wanted.items():
        section = Ligands(pattern=pattern, width=0.3, period=0.6, blur=1e-3)
        assert adhesion.ligand_density(section, x).tolist() == density, pattern


def test_border_is_straight_across_the_blur():
    section = Ligands(pattern="disc", width=0.4, blur=0.1)
    r = np.array([0.14, 0.175, 0.2, 0.225, 0.26])
    assert adhesion.ligand_density(section, np.stack([r, 0.0 * r], axis=1)) == pytest.approx([1.0, 0.75, 0.5, 0.25, 0.0])


def test_the_drift_sees_the_ligands_and_is_stronger_where_they_are_denser():
    x, phi = np.array([[0.1, 0.02], [0.1, 0.02]]), np.zeros(2)
    adhesion.set_boltzmann_exponents(17.5, LAW, np.array([1.0, 0.25]), x, phi)
    assert phi == pytest.approx(17.5 * 2.0 * 0.05 * 0.8**2 * np.array([1.0, 0.25]), rel=1e-13)


def test_receptors_in_reach_count_by_the_share_of_the_traction_whatever_its_sign():
    """Linear: 1 and 1/4 of the range; double well: in the middle of the barrier, which repels by half the traction."""
    x, number = np.array([[0.1, 0.0], [0.1, 0.075], [0.1, 0.2]]), np.array([1.0, 2.0, 4.0])
    assert adhesion.bound_receptors(LAW, number, x) == pytest.approx(1.0 + 2.0 * 0.25, rel=1e-13)
    well = LAWS["double_well"](Adhesion(law="double_well", cutoff=0.2, well=0.2, barrier=0.5, tail=0.1))
    assert adhesion.bound_receptors(LAW._replace(law=well), np.ones(1), np.array([[0.1, 0.08]])) == pytest.approx(0.5, rel=1e-12)
