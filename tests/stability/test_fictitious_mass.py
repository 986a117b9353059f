"""The critical fictitious mass: central differences with a step of 1 are stable while w^2 = 4 bounds every mode.

With mass = bound/4 divided by f, the largest w^2 is 4 f k, k the largest eigenvalue of the stiffness relative
to the bound: the limit is f = 1/k, for any damping centred in time. k is measured by numerical differentiation.
"""

import numpy as np
import pytest
from measure import BODIES, balance_of, marched, relaxed, shaken, sphere, static_case, stiffness_ratio

from vesdyn.balance import CONVERGED, DIVERGED, STALLED
from vesdyn.spreading import Spreading

STRETCH = 1.2
PRESSURE = 4.0 * (1.0 / STRETCH - STRETCH**-7)


def floating_sphere(model, thickness=0.0):
    """A stretched sphere off the plane, its balance, a shaken start, and k."""
    x, body = sphere(model, 0.12, thickness=thickness)
    balance = balance_of(body, x, volume=STRETCH**3 * np.pi / 6.0)
    x = STRETCH * x
    x[:, -1] += 1.0
    return balance, shaken(x, 1e-3, 0), stiffness_ratio(body, x, PRESSURE)


@pytest.mark.parametrize("kinetic", [False, True], ids=["viscous", "kinetic"])
@pytest.mark.parametrize("thickness", [0.0, 0.1], ids=["membrane", "shell"])
@pytest.mark.parametrize("model", BODIES)
def test_just_inside_the_critical_mass(model, thickness, kinetic):
    balance, start, k = floating_sphere(model, thickness)
    _, outcome = relaxed(balance, start, 1e-8, kinetic, lighter=0.95 / k, pressure=PRESSURE)
    assert outcome.status == CONVERGED


@pytest.mark.parametrize("kinetic", [False, True], ids=["viscous", "kinetic"])
@pytest.mark.parametrize("thickness", [0.0, 0.1], ids=["membrane", "shell"])
@pytest.mark.parametrize("model", BODIES)
def test_just_outside_the_critical_mass(model, thickness, kinetic):
    balance, start, k = floating_sphere(model, thickness)
    _, outcome = relaxed(balance, start, 1e-8, kinetic, lighter=1.10 / k, pressure=PRESSURE)
    assert outcome.status == DIVERGED


@pytest.mark.parametrize("model", BODIES)
def test_one_iteration_too_few_is_a_stall(model):
    balance, start, _ = floating_sphere(model)
    needed = relaxed(balance, start, 1e-8)[1].iterations
    assert relaxed(balance, start, 1e-8, max_iterations=needed)[1].status == CONVERGED
    short = relaxed(balance, start, 1e-8, max_iterations=needed - 1)[1]
    assert short.status == STALLED and short.residual > 1e-8


def test_many_iterations_are_not_a_divergence():
    """A soft scene on a fine mesh (slack start, little drag) needs thousands of iterations and still arrives.

    It starts close to balance: its first residual is small, and is exceeded for long on the way.
    """
    moment = marched(Spreading(static_case("axisymmetric", 0.005, 1.0, drag=0.07)), 0.002 * 2.0 ** np.arange(7))
    assert moment["residual"] <= 1e-6
    assert moment["tension_min"] > -0.15  # the compression of the contact disc, no fold
