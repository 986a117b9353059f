"""The coupling step: its rates, its energy ledger, what it hands to whom, and what it refuses."""

import numpy as np
import pytest
from measure import BODIES, marched
from test_folding import pressed

from vesdyn import spreading
from vesdyn.balance import CONVERGED, NoBalanceError, Solution
from vesdyn.case import Case
from vesdyn.spreading import Spreading, bdf2, euler

TIMES = 0.02 * np.linspace(0.0, 1.0, 33) ** 2  # the front runs as the root of time


def scene(model="axisymmetric", order=2, **keys):
    return Spreading(Case(
        name="a", model=model, mesh={"front_edge": 0.05, "far_edge": 0.1}, time={"end": 1.0, "step": 0.01, "order": order},
        solver={"tolerance": 1e-6}, **keys,
    ))  # fmt: skip


@pytest.mark.parametrize("dt, dt_before", [(0.1, 0.1), (0.1, 0.07), (0.1, 0.3)])
def test_backward_differences_are_exact_for_polynomials_of_their_order(dt, dt_before):
    """Steps of different length: v = t for backward Euler, v = t^2 for the difference over two steps, at t = 1."""
    t_new, t, t_before = 1.0, 1.0 - dt, 1.0 - dt - dt_before
    rate = euler(dt)
    assert (t_new - rate.past(t, t_before)) / rate.step == pytest.approx(1.0, rel=1e-14)
    rate = bdf2(dt, dt_before)
    for power, slope in ((1, 1.0), (2, 2.0)):
        past = rate.past(t**power, t_before**power)
        assert (t_new**power - past) / rate.step == pytest.approx(slope, rel=1e-13)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("frozen", [False, True])
def test_energy_is_balanced(frozen, order):
    """The work of the adhesion is stored or dissipated, but for an error of first order in the step.

    Work and dissipation of a step are those of the mean and of the last of its loads, whatever the order of the scheme.
    """
    lost = []
    for every in (2, 1):
        sim = scene(order=order, receptors={"frozen": frozen})
        moment = marched(sim, TIMES[every::every])
        stored = moment["elastic_energy"] - sim.elastic_energy_0
        assert stored > 0.1 * moment["adhesion_work"] and moment["dissipation"] > 0.5 * moment["adhesion_work"]
        lost.append((moment["adhesion_work"] - moment["dissipation"] - stored) / moment["adhesion_work"])
    assert abs(lost[1]) < 0.05
    assert 1.5 < lost[0] / lost[1] < 2.5


def test_second_order_is_nearer_to_short_steps():
    """From a state of short steps on, over the same steps: with as many as these first order is far from its end."""
    state = marched(scene(receptors={"frozen": True}), TIMES[1:]).state

    def end(order, steps):
        sim = scene(order=order, receptors={"frozen": True})
        return marched(sim, 0.02 + 0.02 * np.arange(1, steps + 1) / steps, state)

    exact = end(2, 128)
    first, second = (exact.sim.distance(end(order, 32).x, exact.x) for order in (1, 2))
    assert second < 0.4 * first


@pytest.mark.parametrize("order", [1, 2])
def test_receptors_of_order_2_move_on_the_membrane_seen_ahead(order, monkeypatch):
    sim = scene(order=order)
    state = marched(sim, TIMES[1:]).state
    given, stepped = [], sim._step_receptors
    monkeypatch.setattr(sim, "_step_receptors", lambda state, x, *rest: (given.append(x), stepped(state, x, *rest))[1])
    sim.advance(state, 0.021)
    ahead = state.x + (state.x - state.x_before) * 0.001 / state.dt_before
    ahead[:, -1] = np.where(state.x[:, -1] == 0.0, 0.0, np.maximum(ahead[:, -1], 0.0))
    assert given[0] == pytest.approx(ahead if order == 2 else state.x, abs=1e-15)


@pytest.mark.parametrize("model", BODIES)
def test_frozen_receptors_keep_their_density(model):
    moment = marched(scene(model, receptors={"frozen": True}), TIMES[4::4])
    assert np.all(moment.density == 1.0) and moment["receptor_number_error"] == 0.0
    assert moment.state.number.sum() != pytest.approx(moment.sim.number_0, rel=1e-3)


def test_uneven_density_has_its_mode():
    sim = scene("surface", perturbation={"amplitude": 0.1, "mode": 3})
    x = sim.x_start
    off_axis = np.hypot(x[:, 0], x[:, 1]) > 1e-9
    expected = 1.0 + 0.1 * np.cos(3.0 * np.arctan2(x[:, 1], x[:, 0]))
    assert sim.start().density[off_axis] == pytest.approx(expected[off_axis], abs=1e-13)
    assert sim.start().density[~off_axis] == pytest.approx(1.0, abs=1e-13)


@pytest.mark.parametrize("model", BODIES)
def test_a_landing_with_the_inner_side_down_is_no_balance(model):
    """As where an element swings past the vertical and its node lands inside."""
    sim = scene(model)
    for turned_from, refused in ((0.5, True), (np.inf, False)):
        landed = pressed(sim.x_start * 1.0, turned_from)[0]
        sim.solve = lambda *_: Solution(landed, CONVERGED, 1, 0.0, 0.0)
        if refused:
            with pytest.raises(NoBalanceError, match=r"t = 0.001, step 0.001: membrane landed .* inner side down"):
                sim.advance(sim.start(), 0.001)
        else:
            assert sim.advance(sim.start(), 0.001).steps == 1


@pytest.mark.parametrize("height, folded", [(0.0, True), (0.001, True), (0.003, False)])
def test_folded_membrane_is_what_is_bound_upside_down(height, folded):
    """Bound is what is closer than 0.02 d_c = 0.002."""
    sim = scene()
    x = pressed(sim.x_start, 0.5)[0]
    x[x[:, -1] == 0.0, -1] = height
    assert (sim.folded_area(sim.start()._replace(x=x)) > 0.0) == folded


def test_the_step_is_controlled_by_the_receptors_in_reach():
    """Half of the receptors where twice as many were seen ahead, on a membrane at rest: off by 1."""
    sim = scene()
    state = marched(sim, TIMES[1:]).state
    rest = state._replace(x_before=state.x, number_before=state.number)
    ahead = rest.x
    assert sim._step_error(rest, ahead, rest.number, rest.x, 0.001) == pytest.approx(0.0, abs=1e-14)
    assert sim._step_error(rest, ahead, 0.5 * rest.number, rest.x, 0.001) == pytest.approx(1.0, rel=1e-12)


def test_clipped_conductances_are_told(monkeypatch):
    def clipping(topology, x, conductance):
        conductance[:] = 0.0
        return 3

    monkeypatch.setattr(spreading, "edge_conductances", clipping)
    sim = scene()
    moment = marched(sim, [0.001])
    assert moment["clipped_edges"] == 3
    assert moment.state.number == pytest.approx(sim.number_start, rel=1e-14)  # nothing is conducted
