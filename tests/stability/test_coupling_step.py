"""The coupling step: no length of it breaks the invariants; a step that fails says so and can be taken again."""

import numpy as np
import pytest
from measure import BODIES

from vesdyn.case import Case
from vesdyn.relaxation import RelaxationError
from vesdyn.spreading import Spreading


def typical(model, order=1, **solver):
    return Spreading(Case.model_validate({
        "name": "typical", "model": model, "mesh": {"front_edge": 0.05, "far_edge": 0.1},
        "time": {"end": 20.0, "step": 0.002, "order": order}, "solver": {"tolerance": 1e-5} | solver,
    }))  # fmt: skip


@pytest.mark.parametrize("dt", [2e-4, 2e-3, 2e-2, 0.2, 2.0])
@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("model", BODIES)
def test_invariants_at_any_step(model, order, dt):
    """0.002 is usual, 0.2 more than the whole scene; accuracy is another matter."""
    spreading = typical(model, order)
    for step in range(1, 8):
        spreading.advance(step * dt)
        row = spreading.history_row()
        assert abs(row["volume_error"]) <= 1e-10
        assert abs(row["receptor_number_error"]) <= 1e-12
        assert row["density_min"] > 0.0 and row["gap_min"] >= 0.0
        assert np.isfinite(row["pressure"]) and 0.0 <= row["binding_area"] < np.pi


@pytest.mark.parametrize("model", BODIES)
def test_a_failed_step_is_named_and_can_be_taken_again(model):
    spreading = typical(model, max_iterations=5000)
    spreading.advance(0.002)
    spreading.advance(0.004)
    before = spreading.state()
    spreading.advance(0.006)
    x, number = spreading.x.copy(), spreading.number.copy()
    spreading.restore(before)
    enough = spreading.controls
    spreading.controls = enough._replace(max_iterations=3)
    with pytest.raises(RelaxationError, match="t = 0.004, step 0.002: the relaxation stalled .* after 3 iterations"):
        spreading.advance(0.006)
    spreading.restore(before)
    spreading.controls = enough
    spreading.advance(0.006)
    assert np.array_equal(spreading.x, x) and np.array_equal(spreading.number, number)


@pytest.mark.parametrize("model", BODIES)
def test_receptors_without_a_density_are_named(model):
    spreading = typical(model)
    state = spreading.state()
    state["number"] = state["number"].copy()
    state["number"][3] = np.nan
    spreading.restore(state)
    with pytest.raises(RelaxationError, match="no receptor density was found; reduce time.step"):
        spreading.advance(0.002)


@pytest.mark.parametrize("growth", [1.0, 1.5])
@pytest.mark.parametrize("model", BODIES)
def test_second_order_falls_back_to_first_where_it_would_go_negative(model, growth):
    """The past of a node that lost most of its receptors is negative; the step is then backward Euler over dt."""
    first, second = typical(model, order=1), typical(model, order=2)
    for step in range(1, 6):
        first.advance(0.002 * step)
    state = first.state()
    state["x_before"] = state["x"].copy()  # at rest: both orders move the receptors on the same membrane
    state["number_before"] = state["number"].copy()
    state["number_before"][7] *= 10.0
    first.restore(state)
    second.restore(state)
    until = 0.01 + 0.002 * growth
    first.advance(until)
    second.advance(until)
    # both solve the same linear system, from the same start
    assert second.number == pytest.approx(first.number, rel=1e-10)
