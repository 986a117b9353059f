"""Ways to solve the balance: what they find does not depend on the way, and failures have names.

Each entry of METHODS is tried on each body that it can solve; what is of the relaxation alone stands at the end.
"""

import numpy as np
import pytest
from measure import BODIES, WAYS, balance_of, relaxed, solved, sphere
from numba.core.runtime import _nrt_python, rtsys

from vesdyn import newton, relaxation
from vesdyn.adhesion import TractionSeparation, adhesion_load, double_well, linear
from vesdyn.balance import CONVERGED, DIVERGED, STALLED, UNFINISHED, VOLUME_TOLERANCE, Limits, allocate, set_forces
from vesdyn.case import Adhesion, Case
from vesdyn.errors import CaseError
from vesdyn.spreading import METHODS, Spreading

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


@pytest.mark.parametrize("model, method", WAYS)
def test_result_does_not_depend_on_the_method_nor_on_the_start(model, method):
    balance, x = spreading_balance(model)
    ahead = x * [1.03, 0.97] if model == "axisymmetric" else x * [1.03, 1.03, 0.97]
    one = solved(balance, (x,), TOLERANCE)
    for starts in ((x,), (ahead,), (x, ahead)):
        stored = [start.copy() for start in starts]
        other = solved(balance, starts, TOLERANCE, method)
        assert other.status == CONVERGED and other.residual <= TOLERANCE
        assert np.abs(one.x - other.x).max() < TOLERANCE * (2.416 + 1.81) / DRAG * 100  # as above
        assert one.pressure == pytest.approx(other.pressure, abs=1e-5)
        assert all(map(np.array_equal, starts, stored))


@pytest.mark.fault("n7")
@pytest.mark.parametrize("kinetic", [False, True], ids=["viscous", "kinetic"])
def test_large_leap_of_the_volume_converges(kinetic):
    """A sphere that is to hold 1.73 times its volume: closed at once, the leap diverged after nine iterations."""
    x, body = sphere("axisymmetric", 0.0125, shear_modulus=1.7)
    balance = balance_of(body, x, volume=1.73 * np.pi / 6.0)
    outcome = relaxed(balance, x + [0.0, 1.0], 1e-6, kinetic=kinetic)[1]
    stretch = 1.73 ** (1.0 / 3.0)
    assert outcome.status == CONVERGED
    assert outcome.pressure == pytest.approx(4.0 * 1.7 * (1.0 / stretch - stretch**-7), rel=1e-4)  # cones: 0.2 edge^2


@pytest.mark.parametrize("viscosity", [DRAG, 0.0], ids=["drag", "static"])
@pytest.mark.parametrize("model, method", WAYS)
def test_contact_is_complementary_and_the_volume_exact(model, method, viscosity):
    balance, start = spreading_balance(model, viscosity=viscosity)
    outcome = solved(balance, (start,), 1e-6, method)
    x = outcome.x
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


@pytest.mark.parametrize("model, method", WAYS)
def test_what_cannot_be_balanced_is_a_stall_or_a_divergence(model, method):
    """Half the volume that the membrane can hold on to: nobody reaches it in a few iterations."""
    balance, x = spreading_balance(model)
    short = solved(balance._replace(volume=2.0 * balance.volume), (x,), 1e-14, method, max_iterations=5)
    assert short.status == STALLED and short.iterations == 5 and short.residual > 1e-14
    broken = x.copy()
    broken[len(x) // 2, -1] = np.nan
    assert solved(balance, (broken,), TOLERANCE, method, max_iterations=50).status == DIVERGED


# Newton's method -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("why", ["singular", "no step helps", "too few iterations"])
def test_newton_hands_over_to_the_relaxation_where_it_does_not_converge(why, monkeypatch):
    balance, x = spreading_balance("axisymmetric")
    expected = solved(balance, (x,), TOLERANCE)
    assert not np.array_equal(solved(balance, (x,), TOLERANCE, "newton").x, expected.x)  # alone it takes another way
    if why == "singular":
        monkeypatch.setattr(newton, "_step", lambda *arguments: None)
    elif why == "no step helps":
        monkeypatch.setattr(newton, "_step", lambda balance, x, *rest: (np.full_like(x, 1e-3), 0.0))
    else:
        monkeypatch.setattr(newton, "_ITERATIONS", 1)
        monkeypatch.setattr(newton, "_DESCENTS", 1)
    found = solved(balance, (x,), TOLERANCE, "newton")
    assert np.array_equal(found.x, expected.x) and found[1:] == expected[1:]


def test_newton_descends_where_its_own_steps_do_not_lead_to_a_balance(monkeypatch):
    """From the sphere that only touches, without Newton's own steps: the balance that the relaxation finds."""
    balance, x = spreading_balance("axisymmetric")
    expected = solved(balance, (x,), TOLERANCE)
    monkeypatch.setattr(newton, "_ITERATIONS", 0)
    monkeypatch.setattr(newton.relaxation, "viscous", None)  # would raise
    found = solved(balance, (x,), TOLERANCE, "newton")
    assert found.status == CONVERGED and found.iterations < 60
    assert np.allclose(found.x, expected.x, atol=1e-5)


def test_newton_needs_a_meridian():
    balance, x = spreading_balance("surface")
    with pytest.raises(CaseError, match="newton .* meridian"):
        solved(balance, (x,), TOLERANCE, "newton")
    for keys in ({"model": "surface"}, {"model": "auto", "ligands.pattern": "stripe"}):
        with pytest.raises(CaseError, match="solver.method: newton .* relaxation"):
            Case(name="a", **keys, **{"solver.method": "newton"})
    sim = Spreading(Case(name="a", model="axisymmetric", **{"solver.method": "newton", "mesh.front_edge": 0.1, "mesh.far_edge": 0.1}))
    assert sim.solve is METHODS["newton"]


# The relaxation ------------------------------------------------------------------------------------------


LAWS = {
    "linear": linear(Adhesion()),
    "double_well": double_well(Adhesion(law="double_well")),
}


@pytest.mark.parametrize("kinetic", [False, True], ids=["viscous", "kinetic"])
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("thickness", [0.0, 0.05], ids=["membrane", "shell"])
@pytest.mark.parametrize("model", BODIES)
def test_nothing_is_allocated_in_the_loop(model, thickness, law, kinetic):
    """What compiled code allocates for ten iterations it allocates for a thousand."""
    x, body = sphere(model, 0.12, 0.2, 1.81, 1.05, thickness=thickness)
    balance = balance_of(body, x, viscosity=DRAG)._replace(adhesion=TractionSeparation(LAWS[law], 2.416, 8.0, False))
    x, scratch = x.copy(), allocate(x)
    relaxation.set_fictitious_mass(balance, x, 0.0, scratch)
    limits = Limits(0.0, 10**6)  # so that it does not end

    def allocations(iterations):
        progress = relaxation.begin(0.0, scratch)
        before = rtsys.get_allocation_stats().alloc
        progress = relaxation.relax(balance, limits, x, progress, kinetic, iterations, scratch)
        assert progress.status == UNFINISHED and progress.iterations == iterations
        return rtsys.get_allocation_stats().alloc - before

    _nrt_python.memsys_enable_stats()
    try:
        allocations(1)  # compiles
        assert allocations(1000) == allocations(10)
    finally:
        _nrt_python.memsys_disable_stats()


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


@pytest.mark.parametrize("kinetic", [False, True], ids=["viscous", "kinetic"])
@pytest.mark.parametrize("model", BODIES)
def test_one_iteration_closes_the_volume_to_first_order(model, kinetic):
    """The pressure is what it takes: of a thousandth that is missing about its square is left by a move."""
    balance, x = spreading_balance(model, 0.12)
    x[:, -1] += 1.0  # nothing touches
    short = balance._replace(volume=1.001 * balance.volume, x_rest=x)
    moved, _ = relaxed(short, x, 0.0, kinetic, max_iterations=1)
    assert abs(set_forces(short, moved, allocate(x)) / short.volume - 1.0) < 1e-2 * 1e-3


@pytest.mark.parametrize("tolerance", [1e-3, 1.0])
def test_a_solution_has_its_volume_however_loose_the_tolerance(tolerance):
    """The residual is taken before the last move, and the volume after it."""
    balance, x = spreading_balance("axisymmetric")
    balance = balance._replace(volume=1.02 * balance.volume)
    found = solved(balance, (x,), tolerance)
    assert found.status == CONVERGED
    assert abs(set_forces(balance, found.x, allocate(x)) / balance.volume - 1.0) <= VOLUME_TOLERANCE


def test_a_relaxation_that_fails_is_tried_with_more_mass(monkeypatch):
    """As where the bound of the stiffness, taken at the start, does not hold on the way."""
    balance, x = spreading_balance("axisymmetric")
    expected, bound = solved(balance, (x,), 1e-6), relaxation.set_fictitious_mass

    def too_light(balance, x, pressure, scratch):
        bound(balance, x, pressure, scratch)
        scratch.mass[:] /= 10.0

    monkeypatch.setattr(relaxation, "set_fictitious_mass", too_light)
    found = solved(balance, (x,), 1e-6)
    assert found.status == CONVERGED and found.iterations > expected.iterations
    assert np.allclose(found.x, expected.x, atol=1e-5)


def test_mirror_symmetric_turns_of_the_mesh_give_turned_results():
    """The relaxation has no direction of its own: six-fold symmetry stays to round-off."""
    balance, x = spreading_balance("surface")
    y, outcome = relaxed(balance, x, 1e-6)
    c, s = 0.5, np.sqrt(0.75)
    turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    image = np.argmin(np.linalg.norm((x @ turn)[:, None] - x[None], axis=2), axis=1)
    assert outcome.status == CONVERGED
    assert np.abs(y @ turn - y[image]).max() < 1e-12  # a thousand iterations of 1e-16
