"""The coupling step: no length of it breaks the invariants; a step that fails says so and can be taken again."""

import numpy as np
import pytest
from measure import BODIES, WAYS, marched

from vesdyn import newton
from vesdyn.case import Case
from vesdyn.balance import NoBalanceError
from vesdyn.diagnostics import Moment
from vesdyn.spreading import Spreading
from vesdyn.stepping import step as coupling_step


def typical(model, order=1, **solver):
    return Spreading(Case.model_validate({
        "name": "typical", "model": model, "mesh": {"front_edge": 0.05, "far_edge": 0.1},
        "time": {"end": 20.0, "step": 0.002, "order": order}, "solver": {"tolerance": 1e-5} | solver,
    }))  # fmt: skip


def keys_of(method):
    """The `solver` keys that ask for an entry of METHODS."""
    return {"method": "newton"} if method == "newton" else {"damping": method}


@pytest.mark.parametrize("dt", [2e-4, 2e-3, 2e-2, 0.2, 2.0])
@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("model, method", WAYS)
def test_invariants_at_any_step(model, method, order, dt):
    """0.002 is usual, 0.2 more than the whole scene; accuracy is another matter."""
    sim = typical(model, order, **keys_of(method))
    state = sim.start()
    for step in range(1, 8):
        state = sim.advance(state, step * dt)
        row = Moment(sim, state).row()
        assert abs(row["volume_error"]) <= 1e-10
        assert abs(row["receptor_number_error"]) <= 1e-12
        assert row["density_min"] > 0.0 and row["gap_min"] >= 0.0
        assert np.isfinite(row["pressure"]) and 0.0 <= row["binding_area"] < np.pi


@pytest.mark.parametrize("model, method", WAYS)
def test_a_failed_step_is_named_and_can_be_taken_again(model, method, monkeypatch):
    monkeypatch.setattr(newton, "_ITERATIONS", 0)  # the relaxation, at which it ends, is what stalls
    sim = typical(model, max_iterations=5000, **keys_of(method))
    before = marched(sim, (0.002, 0.004)).state
    stored = [np.copy(value) for value in before]
    after = sim.advance(before, 0.006)
    enough, sim.limits = sim.limits, sim.limits._replace(max_iterations=3)
    with pytest.raises(NoBalanceError, match="t = 0.004, step 0.002: the relaxation stalled .* after 3 iterations"):
        sim.advance(before, 0.006)
    with pytest.raises(NoBalanceError, match="reduce time.step, raise solver.max_iterations or solver.tolerance"):
        coupling_step(sim, before, 0.006)
    sim.limits = enough
    assert all(map(np.array_equal, before, stored))  # no array of a state is ever changed
    assert all(map(np.array_equal, sim.advance(before, 0.006), after))


@pytest.mark.parametrize("model", BODIES)
def test_receptors_without_a_density_are_named(model):
    sim = typical(model)
    number = sim.start().number.copy()
    number[3] = np.nan
    with pytest.raises(NoBalanceError, match="no receptor density was found; reduce time.step"):
        coupling_step(sim, sim.start()._replace(number=number), 0.002)


@pytest.mark.parametrize("growth", [1.0, 1.5])
@pytest.mark.parametrize("model", BODIES)
def test_second_order_falls_back_to_first_where_it_would_go_negative(model, growth):
    """The past of a node that lost most of its receptors is negative; the step is then backward Euler over dt."""
    first, second = typical(model, order=1), typical(model, order=2)
    state = marched(first, 0.002 * np.arange(1, 6)).state
    number_before = state.number.copy()
    number_before[7] *= 10.0
    # at rest: both orders move the receptors on the same membrane
    state = state._replace(x_before=state.x, number_before=number_before)
    until = 0.01 + 0.002 * growth
    # both solve the same linear system, from the same start
    assert second.advance(state, until).number == pytest.approx(first.advance(state, until).number, rel=1e-10)
