"""The membrane law against equation (1): exact values, and derivatives by complex steps."""

import numpy as np
import pytest

from vesdyn.neo_hookean import (
    principal_tension,
    strain_energy,
    strain_energy_I1,
    strain_energy_J,
    strain_energy_JJ,
)

ROUND_OFF = 1e-14
STRETCHES = [(1.0, 1.0), (1.3, 1.3), (1.5, 0.8), (0.7, 1.1), (3.0, 0.4)]


def energy(K, l1, l2):
    """K/2 (tr C + 1/det C - 3)."""
    return 0.5 * K * (l1**2 + l2**2 + 1.0 / (l1 * l2) ** 2 - 3.0)


def test_rest_state_has_neither_energy_nor_tension():
    assert strain_energy(2.0, 2.0, 1.0) == 0.0
    assert principal_tension(2.0, 1.0, 1.0) == 0.0


def test_small_uniaxial_tension_has_three_times_the_shear_modulus():
    # plane stress, incompressible: l2 = l1^(-1/2) keeps T_2 = 0 and T_1 = 3 K strain
    strain = 1e-6
    l1 = 1.0 + strain
    l2 = l1**-0.5
    assert principal_tension(1.0, l2, 1.0 / (l1 * l2)) == pytest.approx(0.0, abs=1e-15)
    assert principal_tension(1.0, l1, 1.0 / (l1 * l2)) == pytest.approx(3.0 * strain, rel=10 * strain)


@pytest.mark.parametrize("l1, l2", STRETCHES)
def test_energy_and_tension_of_the_stretches(l1, l2):
    K, h = 1.7, 1e-30
    assert strain_energy(K, l1**2 + l2**2, 1.0 / (l1 * l2)) == pytest.approx(energy(K, l1, l2), abs=ROUND_OFF * 10)
    dW_dl1 = np.imag(energy(K, l1 + 1j * h, l2)) / h  # complex step: no truncation, no cancellation
    assert principal_tension(K, l1, 1.0 / (l1 * l2)) == pytest.approx(dW_dl1 / l2, abs=ROUND_OFF * 100)


@pytest.mark.parametrize("J", [0.5, 1.0, 1.7])
def test_derivatives_by_the_invariants(J):
    K, I1, h = 1.3, 2.4, 1e-30
    dW_dI1 = np.imag(strain_energy.py_func(K, I1 + 1j * h, 1.0 / J)) / h
    dW_dJ = np.imag(strain_energy.py_func(K, I1, 1.0 / (J + 1j * h))) / h
    d2W_dJ2 = np.imag(strain_energy_J.py_func(K, 1.0 / (J + 1j * h))) / h
    assert strain_energy_I1(K) == pytest.approx(dW_dI1, rel=ROUND_OFF)
    assert strain_energy_J(K, 1.0 / J) == pytest.approx(dW_dJ, rel=ROUND_OFF)
    assert strain_energy_JJ(K, 1.0 / J) == pytest.approx(d2W_dJ2, rel=ROUND_OFF)
