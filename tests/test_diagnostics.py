"""The columns of the history: units, ledgers that see what is lost, and what counts as bound or free."""

import numpy as np
import pytest
from measure import BODIES, marched
from test_folding import pressed

from vesdyn.body import principal_tensions
from vesdyn.budget import TOLERANCE_ERROR
from vesdyn.case import Case
from vesdyn.diagnostics import COLUMNS, Moment, believed_error
from vesdyn.spreading import Spreading

UNITS = {
    "a0^2/D": "time", "a0": "contact_radius height gap_min centre_gap free_tension_min_height",
    "a0^2": "binding_area membrane_area folded_area near_area", "kT/a0^3": "pressure", "kT/a0^2": "tension_min free_tension_min",
    "kT": "elastic_energy adhesion_work dissipation", "c_r0": "density_min density_max",
    "1": "volume_error receptor_number_error iterations residual clipped_edges step_error area_error",
}  # fmt: skip


def scene(model="axisymmetric", **keys):
    return Spreading(Case(name="a", model=model, mesh={"front_edge": 0.05, "far_edge": 0.1}, time={"step": 0.01}, **keys))


@pytest.fixture(scope="module")
def spread():
    """A `Moment` with contact, tension and compression."""
    return marched(scene(), 0.02 * np.linspace(0.0, 1.0, 9)[1:] ** 2)


def test_units():
    expected = {name: unit for unit, names in UNITS.items() for name in names.split()}
    assert {column.name: column.unit for column in COLUMNS} == expected


@pytest.mark.parametrize("model", BODIES)
def test_ledgers_see_what_is_lost(model):
    sim = scene(model)
    state = sim.start()
    assert Moment(sim, state)["volume_error"] == Moment(sim, state)["receptor_number_error"] == 0.0
    lossy = Moment(sim, state._replace(volume=0.99 * state.volume, number=0.98 * state.number))
    assert lossy["volume_error"] == pytest.approx(-0.01, rel=1e-12)
    assert lossy["receptor_number_error"] == pytest.approx(-0.02, rel=1e-12)
    assert Moment(scene(model, receptors={"frozen": True}), lossy.state)["receptor_number_error"] == 0.0


def test_what_a_state_holds_is_recorded_as_it_is(spread):
    state = spread.state
    assert (spread["density_min"], spread["density_max"]) == (min(state.number / state.area), max(state.number / state.area))
    assert spread["density_min"] < 0.95 < 1.05 < spread["density_max"]
    heights = state.x[:, 1]
    assert (spread["gap_min"], spread["height"]) == (min(heights), max(heights)) and spread["gap_min"] < 0.1 * spread["height"]
    for name in ("time", "pressure", "adhesion_work", "dissipation", "iterations", "residual", "step_error", "clipped_edges"):
        assert Moment(spread.sim, state._replace(**{name: 7.25}))[name] == 7.25
    assert spread["membrane_area"] == pytest.approx(sum(state.area), rel=1e-14)


@pytest.mark.parametrize("height, bound", [(0.0, True), (0.0019, True), (0.0021, False)])
@pytest.mark.parametrize("model", BODIES)
def test_bound_is_what_is_closer_than_a_fiftieth_of_the_cutoff(model, height, bound):
    sim = scene(model)
    x, rim = pressed(sim.x_start)
    x[x[:, -1] == 0.0, -1] = height
    assert (Moment(sim, sim.start()._replace(x=x))["binding_area"] > 0.9 * np.pi * rim**2) == bound


def test_membrane_that_is_folded_is_not_bound():
    """A ring turned over between half and all of the rim: the bound membrane less that which lies upside down on it."""
    sim = scene()
    moment = Moment(sim, sim.start()._replace(x=pressed(sim.x_start, 0.5)[0]))
    folded = sim.folded_area(moment.state)
    assert folded > 0.0 and moment["folded_area"] == folded
    assert moment["binding_area"] == pytest.approx(moment.front(0.002)[0] - folded, rel=1e-14)


def test_free_membrane_is_what_does_not_touch(spread):
    tension = np.zeros((len(spread.sim.body.elements), 2))
    principal_tensions(spread.sim.body, spread.x, tension)
    touching = (spread.x[spread.sim.body.elements, 1] == 0.0).any(axis=1)
    assert spread["tension_min"] == tension.min() and 0 < touching.sum() < len(touching)
    assert spread["free_tension_min"] == tension[~touching].min()
    slack = spread.sim.start()  # a state whose slackest element lies on the plane
    x = slack.x.copy()
    x[:3, 1] = 0.0
    x[1:3, 0] *= 0.5
    moment = Moment(spread.sim, slack._replace(x=x))
    assert moment["tension_min"] < 2.0 * moment["free_tension_min"] < 0.0
    assert moment["free_tension_min_height"] > 0.0


def test_a_frame_has_the_tensions_in_their_order(spread):
    tension = np.zeros((len(spread.sim.body.elements), 2))
    principal_tensions(spread.sim.body, spread.x, tension)
    elements, nodal, cells = spread.frame()
    assert np.array_equal(cells["tension_1"], tension[:, 0]) and np.array_equal(cells["tension_2"], tension[:, 1])
    assert np.array_equal(elements, spread.sim.body.elements) and np.array_equal(nodal["gap"], spread.x[:, 1])
    law = spread.sim.case.adhesion
    share = np.maximum(0.0, 1.0 - nodal["gap"] / law.cutoff)
    assert nodal["traction"] == pytest.approx(law.traction * nodal["density"] * share, rel=1e-13)


def test_the_believed_error_adds_mesh_step_and_tolerance():
    case = Case(name="a", model="axisymmetric", mesh={"front_edge": 0.01, "far_edge": 0.05}, membrane={"thickness": 0.0})
    error = believed_error(case, 0.2)
    assert error == pytest.approx(1.1 * 0.05**1.5 + 0.5 * case.accuracy + TOLERANCE_ERROR * case.tolerance, rel=1e-12)
    harder = case.changed(**{"mesh.difficulty": 3.0})
    assert believed_error(harder, 0.2) == pytest.approx(error + 2.0 * 1.1 * 0.05**1.5, rel=1e-12)
    fixed = case.changed(**{"time.step": 0.001})
    assert believed_error(fixed, 0.2) == pytest.approx(error - 0.5 * case.accuracy + 9.0 * 0.001, rel=1e-12)
    assert np.isnan(believed_error(case, 0.0))
