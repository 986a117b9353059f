"""Bending law: trivial values, moments as derivatives, independence of the frame, the paper-thin plate."""

import numpy as np
import pytest

from vesdyn.koiter import bending_energy, bending_moments, bending_stiffness

RHO = (0.7, -0.4, 0.3)


def test_stiffness_is_that_of_a_plate_of_an_incompressible_material():
    """E h^3 / (12 (1 - nu^2)) with E = 3 G, nu = 1/2 and K = G h."""
    G, h = 2.3, 0.07
    assert bending_stiffness(G * h, h) == pytest.approx(3.0 * G * h**3 / (12.0 * (1.0 - 0.5**2)), rel=1e-14)
    assert bending_stiffness(1.7, 0.0) == 0.0


def test_trivial_values():
    assert bending_energy(1.3, 0.0, 0.0, 0.0) == 0.0
    assert bending_energy(1.3, 2.0, 0.0, 0.0) == pytest.approx(1.3 / 2 * 4)  # rolled to a cylinder
    assert bending_energy(1.3, 2.0, 2.0, 0.0) == pytest.approx(1.3 / 2 * 12)  # to a cap
    assert bending_energy(1.3, 2.0, -2.0, 0.0) == pytest.approx(1.3 / 2 * 4)  # to a saddle
    assert bending_moments(1.3, 2.0, 0.0, 0.0) == pytest.approx((2.6, 1.3, 0.0))  # nu = 1/2: it wants to be a saddle


def test_energy_is_koiters_in_any_frame():
    """B/2 [(1 - nu) tr(rho^2) + nu (tr rho)^2] with nu = 1/2, and the same after a turn of the axes."""
    rho = np.array([[RHO[0], RHO[2]], [RHO[2], RHO[1]]])
    expected = 0.65 * (0.5 * np.trace(rho @ rho) + 0.5 * np.trace(rho) ** 2)
    for angle in (0.0, 0.4, 2.0):
        Q = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        turned = Q @ rho @ Q.T
        assert bending_energy(1.3, turned[0, 0], turned[1, 1], turned[0, 1]) == pytest.approx(expected, rel=1e-14)


def test_moments_are_the_derivatives_of_the_energy():
    h = 0.1  # the energy is quadratic: central differences are exact
    for k, moment in enumerate(bending_moments(1.3, *RHO)):
        step = h * np.eye(3)[k]
        slope = (bending_energy(1.3, *(RHO + step)) - bending_energy(1.3, *(RHO - step))) / (2 * h)
        assert moment == pytest.approx(slope, rel=1e-13)


def test_energy_is_the_work_of_the_moments():
    assert 0.5 * np.dot(bending_moments(1.3, *RHO), RHO) == pytest.approx(bending_energy(1.3, *RHO), rel=1e-14)
    for rho in np.random.default_rng(0).normal(size=(50, 3)):
        assert bending_energy(1.3, *rho) > 0.0
