"""Receptors on a frozen membrane: number, sign, zero-flux states, saturation, and the linear solution."""

from decimal import Decimal, getcontext

import numpy as np
import pytest
import scipy.sparse
import scipy.sparse.linalg
from measure import BODIES, fitted_order, forces, sphere

from vesdyn import receptors
from vesdyn.adhesion import Linear, TractionSeparation, set_boltzmann_exponents
from vesdyn.body import edge_conductances

CUTOFF = 0.1
PLENTY = 1e9  # ligands: never saturated
# C_inf of the undeformed touching sphere, 1/(1 - d_c + d_c I), I = sqrt(pi) erfi(sqrt(phi0)) / (2 sqrt(phi0))
FAR_DENSITY = {0.5: 0.980877, 1.0: 0.955781, 2.0: 0.879937, 3.0: 0.756303, 5.0: 0.382085}


class FrozenMembrane:
    """Receptors on the touching sphere; ``depth`` phi0 is the Boltzmann exponent at the plane."""

    def __init__(self, model, front_edge, depth, ligand_ratio=PLENTY, layout="rings"):
        self.x, body = sphere(model, front_edge, 2.0 * front_edge, layout=layout)
        self.edges, self.ligand_ratio = body.edges, ligand_ratio
        self.area = forces(body, self.x)[2].copy()
        self.scratch = receptors.transport(len(self.x), len(body.edges))
        edge_conductances(body.topology, self.x, self.scratch.conductance)
        self.ligands = np.ones(len(self.x))
        adhesion = TractionSeparation(Linear(CUTOFF), 1.0, ligand_ratio, False)
        set_boltzmann_exponents(2.0 * depth / CUTOFF, adhesion, self.ligands, self.x, self.scratch.exponent)
        self.number = self.area.copy()  # c = 1

    @property
    def density(self):
        return self.number / self.area

    def step(self, dt):
        assert receptors.step_receptors(
            self.edges, self.area, self.ligand_ratio, self.ligands, dt, self.number, self.scratch
        )

    def settle(self):
        for dt in (1e-3, 1e-2, 0.1, 1.0, 10.0, 1e3, 1e3, 1e3):
            self.step(dt)

    def largest_drop(self):
        return np.abs(np.diff(self.scratch.exponent[self.edges], axis=1)).max()


# Bernoulli's function


@pytest.mark.parametrize("u", [-700.0, -30.0, -1.0, -2e-4, -1e-4, -9e-5, -1e-9, 1e-300, 1e-9, 9e-5, 1e-4, 2e-4, 1.0, 30.0, 700.0])
def test_bernoulli_against_forty_digits(u):
    getcontext().prec = 40
    exact = float(Decimal(u) / (Decimal(u).exp() - 1)) if abs(u) > 1e-30 else 1.0
    assert receptors.bernoulli(u) == pytest.approx(exact, rel=4e-16)


def test_bernoulli_limits():
    assert receptors.bernoulli(0.0) == 1.0
    assert receptors.bernoulli(800.0) == 0.0  # exp overflows: no flux uphill, no NaN
    assert receptors.bernoulli(-800.0) == 800.0


# Number and sign


@pytest.mark.parametrize("model", BODIES)
@pytest.mark.parametrize("ligand_ratio", [PLENTY, 1.2], ids=["unsaturated", "saturated"])
def test_number_is_conserved_to_round_off(model, ligand_ratio):
    membrane = FrozenMembrane(model, 0.06, 2.0, ligand_ratio)
    before = membrane.number.sum()
    for _ in range(50):
        membrane.step(2e-3)
    assert membrane.number.sum() == pytest.approx(before, rel=1e-13)


@pytest.mark.parametrize("peclet", [10.0, 100.0])
@pytest.mark.parametrize("dt", [1e-6, 1e-3, 1.0, 1e3])
@pytest.mark.parametrize("model", BODIES)
def test_density_stays_positive_at_any_cell_peclet_number_and_step(model, dt, peclet):
    """The cell Peclet number is the drop of the exponent along an edge."""
    depth = peclet / FrozenMembrane(model, 0.06, 1.0).largest_drop()
    membrane = FrozenMembrane(model, 0.06, depth)
    assert membrane.largest_drop() == pytest.approx(peclet, rel=1e-12)
    before = membrane.number.sum()
    for _ in range(20):
        membrane.step(dt)
        assert membrane.number.min() > 0.0
    assert membrane.number.sum() == pytest.approx(before, rel=1e-12)


# Zero-flux states


@pytest.mark.parametrize("depth", FAR_DENSITY)
@pytest.mark.parametrize("model", BODIES)
def test_zero_flux_state_is_nodally_exact(model, depth):
    """c = C exp(phi) at the nodes, C from the number, to the 1e-8 that the solver's 1e-12 leaves."""
    membrane = FrozenMembrane(model, 0.05, depth)
    membrane.settle()
    boltzmann = np.exp(membrane.scratch.exponent)
    exact = boltzmann * membrane.area.sum() / np.sum(membrane.area * boltzmann)
    assert np.abs(membrane.density / exact - 1.0).max() < 1e-8


@pytest.mark.parametrize("depth", [1.0, 3.0, 5.0])
@pytest.mark.parametrize("model", BODIES)
def test_far_density_converges_to_the_closed_form(model, depth):
    """Only the quadrature of exp(phi) over the sphere remains: second order in the edge."""
    edges = np.array([0.08, 0.056, 0.04, 0.028, 0.02, 0.014, 0.01])
    error = []
    for edge in edges:
        membrane = FrozenMembrane(model, edge, depth)
        # the state itself is nodally exact (above), so it need not be marched to
        boltzmann = np.exp(membrane.scratch.exponent)
        error.append(membrane.area.sum() / np.sum(membrane.area * boltzmann) / FAR_DENSITY[depth] - 1.0)
    assert np.all(np.abs(error) < (depth * edges) ** 2)
    if model == "axisymmetric":  # on triangles the errors below and above the curve cancel, with changing sign
        assert fitted_order(edges, error) == pytest.approx(2.0, abs=0.15)


@pytest.mark.parametrize("model", BODIES)
def test_saturated_zero_flux_state_has_the_slope_of_the_ligands(model):
    """Where c >= q: dc/dz = -2 phi0 q (1 - z/d_c)/d_c, so c = 1 - q phi0 d_c/3 + q phi on the sphere.

    (dA is uniform in z, so the mean of phi over the sphere is phi0 d_c / 3.)
    """
    depth, q = 2.0, 0.5
    edges, error = (0.08, 0.04, 0.02), []
    for edge in edges:
        membrane = FrozenMembrane(model, edge, depth, q)
        membrane.settle()
        exact = 1.0 - q * depth * CUTOFF / 3.0 + q * membrane.scratch.exponent
        assert membrane.density.min() > q
        error.append(np.abs(membrane.density - exact).max())
    assert fitted_order(edges, error) == pytest.approx(2.0, abs=0.3)


@pytest.mark.parametrize("model", BODIES)
def test_ligands_no_longer_matter_when_they_are_not_scarce(model):
    free, just_enough = FrozenMembrane(model, 0.06, 1.0), FrozenMembrane(model, 0.06, 1.0, 3.0)
    free.settle()
    just_enough.settle()
    assert free.density.max() < 3.0
    assert np.array_equal(free.number, just_enough.number)


# One implicit step


def assembled(membrane, dt):
    """A + dt L as a sparse matrix, each entry from F_ij = w_ij [B(u) c_i - B(-u) c_j]."""
    i, j = membrane.edges.astype(int).T
    u = membrane.scratch.exponent[i] - membrane.scratch.exponent[j]
    with np.errstate(invalid="ignore"):
        leaving = np.where(u == 0.0, 1.0, u / np.expm1(u))
        entering = np.where(u == 0.0, 1.0, -u / np.expm1(-u))
    w = dt * membrane.scratch.conductance
    n = len(membrane.area)
    rows = np.concatenate([i, i, j, j, np.arange(n)])
    columns = np.concatenate([i, j, i, j, np.arange(n)])
    entries = np.concatenate([w * leaving, -w * entering, -w * leaving, w * entering, membrane.area])
    return scipy.sparse.csc_array((entries, (rows, columns)), shape=(n, n))


@pytest.mark.parametrize("dt", [1e-4, 2e-3, 1.0])
@pytest.mark.parametrize("model", BODIES)
def test_one_step_agrees_with_a_sparse_direct_solution(model, dt):
    membrane = FrozenMembrane(model, 0.05, 3.0)
    rng = np.random.default_rng(4)
    membrane.number *= rng.uniform(0.5, 1.5, len(membrane.number))
    exact = scipy.sparse.linalg.spsolve(assembled(membrane, dt), membrane.number)
    membrane.step(dt)
    # the residual 1e-12, grown by the condition of the step
    assert np.abs(membrane.density - exact).max() < 1e-9 * exact.max()
    assert membrane.density.min() > 0.0


@pytest.mark.parametrize("model", BODIES)
def test_matrix_of_the_step_keeps_density_positive_and_the_number(model):
    """An M-matrix with columns that sum to the areas; from the compiled product, column by column."""
    membrane = FrozenMembrane(model, 0.15, 5.0)
    n = len(membrane.area)
    receptors.set_flux_coefficients(membrane.edges, PLENTY, membrane.ligands, 1.0, membrane.scratch)
    matrix = np.zeros((n, n))
    for i, unit in enumerate(np.eye(n)):
        column = np.zeros(n)
        receptors.apply(membrane.edges, membrane.area, membrane.scratch, unit, column)
        matrix[:, i] = column
    size = np.abs(matrix).max()
    assert matrix == pytest.approx(assembled(membrane, 1.0).toarray(), abs=1e-13 * size)
    assert matrix.sum(axis=0) == pytest.approx(membrane.area, abs=1e-13 * size)
    assert matrix.diagonal().min() > 0.0 and np.all(matrix - np.diag(matrix.diagonal()) <= 0.0)


def test_interpreted_kernel_gives_what_the_compiled_one_gives():
    membrane = FrozenMembrane("axisymmetric", 0.08, 3.0, 1.2)
    compiled, interpreted = membrane.number.copy(), membrane.number.copy()
    other = FrozenMembrane("axisymmetric", 0.08, 3.0, 1.2)
    arguments = (membrane.edges, membrane.area, 1.2, membrane.ligands, 0.01)
    receptors.step_receptors(*arguments, compiled, membrane.scratch)
    receptors.step_receptors.py_func(*arguments, interpreted, other.scratch)
    receptors.set_flux_coefficients.py_func(membrane.edges, 1.2, membrane.ligands, 0.01, other.scratch)
    receptors.set_flux_coefficients(membrane.edges, 1.2, membrane.ligands, 0.01, membrane.scratch)
    # contraction and reassociation in the compiled sums: round-off
    assert compiled == pytest.approx(interpreted, rel=1e-12)
    assert membrane.scratch.forth == pytest.approx(other.scratch.forth, rel=1e-12)
