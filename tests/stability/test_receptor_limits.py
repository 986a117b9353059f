"""Limits of the receptors' step: cell Peclet number, negative weights, scarce ligands, and its failure's name."""

import numpy as np
import pytest
from measure import forces, sphere

from vesdyn import receptors

PLENTY = 1e9


def chain(n, peclet, conductance=1.0):
    """A line of equal nodes whose exponent falls by ``peclet`` along each edge."""
    edges = np.stack([np.arange(n - 1), np.arange(1, n)], axis=1)
    scratch = receptors.transport(n, n - 1)
    scratch.conductance[:] = conductance
    scratch.exponent[:] = -peclet * np.arange(n)
    return edges, np.ones(n), np.ones(n), scratch


def central_step(edges, area, number, scratch, dt):
    """The same implicit step with the mean density in the drift (Galerkin)."""
    matrix = np.diag(area)
    for (i, j), w in zip(edges, scratch.conductance):
        u = scratch.exponent[i] - scratch.exponent[j]
        flux = w * dt * np.array([1.0 - 0.5 * u, -(1.0 + 0.5 * u)])
        matrix[i, [i, j]] += flux
        matrix[j, [i, j]] -= flux
    return np.linalg.solve(matrix, number) * area


@pytest.mark.parametrize("peclet", [1.9, 2.1])
def test_exponential_fitting_stays_positive_where_the_central_scheme_fails(peclet):
    """Cell Peclet number 2 is the limit of central differences: beyond it an off-diagonal changes sign."""
    edges, area, number, scratch = chain(12, peclet)
    number[:] = 1e-6
    number[-1] = 1.0
    central = central_step(edges, area, number, scratch, 1e3)
    assert (central.min() < 0.0) == (peclet > 2.0)
    assert receptors.step_receptors(edges, area, PLENTY, np.ones(12), 1e3, number, scratch)
    assert number.min() > 0.0


@pytest.mark.parametrize("peclet", [1.0, 10.0, 100.0, 690.0, 1e4])
def test_no_cell_peclet_number_is_too_large(peclet):
    """exp(peclet) overflows beyond 709: nothing flows uphill, and the number is kept."""
    edges, area, number, scratch = chain(12, peclet)
    for _ in range(5):
        assert receptors.step_receptors(edges, area, PLENTY, np.ones(12), 1e-3, number, scratch)
        assert number.min() > 0.0
    assert number.sum() == pytest.approx(12.0, rel=1e-14)


def test_saturation_is_iterated_to_convergence_just_outside_of_it():
    """Slightly scarce and slightly plentiful ligands give nearly the same step; far outside it still ends."""
    results = []
    for ligand_ratio in (1.0001, 0.9999, 0.01):
        edges, area, number, scratch = chain(12, 0.5)
        assert receptors.step_receptors(edges, area, ligand_ratio, np.ones(12), 0.1, number, scratch)
        assert number.min() > 0.0 and number.sum() == pytest.approx(12.0, rel=1e-13)
        results.append(number.copy())
    assert np.abs(results[0] - results[1]).max() < 1e-3
    assert np.abs(results[2] - 1.0).max() < 0.01  # hardly any ligands, hardly any drift


def test_a_saturated_step_solves_the_equation_of_its_own_end():
    """The share of the receptors that drifts is that of the density at the end of the step, not of the one before."""
    edges, area, number, scratch = chain(12, 0.5)
    before = number.copy()
    assert receptors.step_receptors(edges, area, 1.0, np.ones(12), 1.0, number, scratch)
    assert 0.2 < np.mean(scratch.density > 1.0) < 1.0
    receptors.set_flux_coefficients(edges, 1.0, np.ones(12), 1.0, scratch)
    there = np.zeros(12)
    receptors.apply(edges, area, scratch, scratch.density, there)
    assert there == pytest.approx(before, rel=1e-9)


@pytest.mark.parametrize("bad", [np.nan])
def test_what_is_not_a_number_is_reported(bad):
    edges, area, number, scratch = chain(12, 1.0)
    number[5] = bad
    assert not receptors.step_receptors(edges, area, PLENTY, np.ones(12), 0.1, number, scratch)


def test_drop_of_the_exponent_in_the_typical_case_is_far_inside():
    """Drift number 17.5, T_max 2.416, d_c 0.1: front edges of 0.015 cannot see more than a cell Peclet number of 1."""
    x, body = sphere("axisymmetric", 0.015, 0.05)
    z = x[:, -1]
    phi = 17.5 * 2.416 * 0.05 * np.maximum(0.0, 1.0 - z / 0.1) ** 2
    assert np.abs(np.diff(phi)).max() < 1.0
    assert forces(body, x)[2].min() > 0.0
