"""Dynamic relaxation: the balance it finds does not depend on the way, and failures have names."""

import numpy as np
import pytest
from measure import BODIES, balance_of, relaxed, sphere

from vesdyn.adhesion import adhesion_load
from vesdyn.balance import CONVERGED, DIVERGED, STALLED, allocate, set_forces

TOLERANCE = 1e-8
DRAG = 0.07 / 0.002  # of the typical case, over its coupling step


def spreading_balance(model, front_edge=0.06, viscosity=DRAG, layout="rings"):
    """One coupling step from the touching sphere, K = 1.81, T_max = 2.416, prestretch 1.05."""
    x, body = sphere(model, front_edge, 2.0 * front_edge, 1.81, 1.05, layout)
    return balance_of(body, x, viscosity=viscosity, traction=2.416, frozen=False), x


@pytest.mark.parametrize("model", BODIES)
def test_result_does_not_depend_on_the_damping(model):
    balance, x = spreading_balance(model)
    viscous, one = relaxed(balance, x, TOLERANCE)
    kinetic, other = relaxed(balance, x, TOLERANCE, kinetic=True)
    heavy, third = relaxed(balance, x, TOLERANCE, lighter=0.25)
    assert one.status == other.status == third.status == CONVERGED
    # displacement = residual / stiffness; the softest modes are held by the drag alone
    close = TOLERANCE * (2.416 + 1.81) / DRAG * 100
    assert np.abs(viscous - kinetic).max() < close
    assert np.abs(viscous - heavy).max() < close
    assert one.pressure == pytest.approx(other.pressure, abs=1e-5)


@pytest.mark.parametrize("model", BODIES)
def test_result_does_not_depend_on_the_start(model):
    balance, x = spreading_balance(model)
    ahead = x * [1.03, 0.97] if model == "axisymmetric" else x * [1.03, 1.03, 0.97]
    one, other = relaxed(balance, x, TOLERANCE)[0], relaxed(balance, ahead, TOLERANCE)[0]
    assert np.abs(one - other).max() < TOLERANCE * (2.416 + 1.81) / DRAG * 100


@pytest.mark.parametrize("kinetic", [False, True], ids=["viscous", "kinetic"])
@pytest.mark.parametrize("viscosity", [DRAG, 0.0], ids=["drag", "static"])
@pytest.mark.parametrize("model", BODIES)
def test_contact_is_complementary_and_the_volume_exact(model, viscosity, kinetic):
    balance, start = spreading_balance(model, viscosity=viscosity)
    x, outcome = relaxed(balance, start, 1e-6, kinetic)
    assert outcome.status == CONVERGED
    scratch = allocate(x)
    volume = set_forces(balance, x, scratch)
    d = x.shape[1]
    load = scratch.nodal[:, :d] + outcome.pressure * scratch.nodal[:, d : 2 * d]
    assert abs(volume / balance.volume - 1.0) <= 1e-10
    touching = x[:, -1] == 0.0
    assert x[:, -1].min() == 0.0 and 1 < touching.sum() < len(x)
    # reaction = -load where it touches, at least 0 but for the tolerance; elsewhere there is balance without it
    scale = 1e-6 * (2.416 + 1.81) * balance.body.reference_area * 1.01
    assert np.all(-load[touching, -1] >= -2.0 * scale[touching])
    assert np.mean(-load[touching, -1] > 0.0) > 0.9
    # the last step of the iteration moves the nodes once more after the residual was taken
    assert np.all(np.linalg.norm(load[~touching], axis=1) <= 2.0 * scale[~touching])
    assert np.all(np.linalg.norm(load[touching, :-1], axis=1) <= 2.0 * scale[touching])
    # so the plane carries the adhesion less what little is out of balance
    reaction = -load[touching, -1].sum()
    adhesion = sum(
        adhesion_load(balance.adhesion, x[i, -1], balance.number[i], scratch.area[i], 1.0) for i in range(len(x))
    )
    drag = np.sum(viscosity * balance.body.reference_area * (x - start)[:, -1])
    assert reaction == pytest.approx(adhesion + drag, rel=1e-4)


@pytest.mark.parametrize("model", BODIES)
def test_too_few_iterations_are_a_stall(model):
    balance, x = spreading_balance(model)
    _, outcome = relaxed(balance, x, TOLERANCE, max_iterations=20)
    assert outcome.status == STALLED and outcome.iterations == 20


@pytest.mark.parametrize("model", BODIES)
def test_too_light_a_membrane_is_a_divergence(model):
    balance, x = spreading_balance(model)
    _, outcome = relaxed(balance, x, TOLERANCE, lighter=10.0)
    assert outcome.status == DIVERGED


@pytest.mark.parametrize("model", BODIES)
def test_not_a_number_is_a_divergence_at_once(model):
    balance, x = spreading_balance(model)
    broken = x.copy()
    broken[len(x) // 2, -1] = np.nan
    _, outcome = relaxed(balance, broken, TOLERANCE, max_iterations=50)
    assert outcome.status == DIVERGED and outcome.iterations < 50


def test_mirror_symmetric_turns_of_the_mesh_give_turned_results():
    """The relaxation has no direction of its own: six-fold symmetry stays to round-off."""
    balance, x = spreading_balance("surface")
    y, outcome = relaxed(balance, x, 1e-6)
    c, s = 0.5, np.sqrt(0.75)
    turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    image = np.argmin(np.linalg.norm((x @ turn)[:, None] - x[None], axis=2), axis=1)
    assert outcome.status == CONVERGED
    assert np.abs(y @ turn - y[image]).max() < 1e-12  # a thousand iterations of 1e-16
