"""Spreading with moving receptors against an independent axisymmetric computation (tests/data/README.md).

The reference is a pure membrane (thickness 0), extrapolated to vanishing step and good to about 0.5 %; the code's own
error comes on top.
"""

import csv
from pathlib import Path

import numpy as np
import pytest

from vesdyn.case import Case
from vesdyn.case_file import load_case
from vesdyn.diagnostics import Moment
from vesdyn.planning import plan
from vesdyn.spreading import Spreading
from vesdyn.stepping import march

ROOT = Path(__file__).parents[2]
with (ROOT / "tests" / "data" / "spreading_reference.csv").open() as file:
    ROWS = list(csv.DictReader(file))
EXTREMES = "drag=0.07", "receptors.mobility=2.1875"  # of the reference curves: configs/base/extremes.yaml
CASES = list(dict.fromkeys(row["case"] for row in ROWS))


def reference(name):
    rows = [row for row in ROWS if row["case"] == name]
    return {key: np.array([float(row[key]) for row in rows]) for key in rows[0] if key != "case"}


def case_of(known, **changes):
    """The case of a reference curve, its frames at the listed times."""
    times = known["time"]
    return Case(
        name="reference",
        membrane={"shear_modulus": known["shear_modulus"][0], "thickness": 0.0},
        adhesion={key: known[key][0] for key in ("traction", "cutoff", "ligand_ratio")},
        receptors={"drift_number": known["drift_number"][0]},
        drag=known["drag"][0],
        output={"frames": tuple(times[:-1])},
        **{"time": {"end": times[-1], "step": "auto"}} | changes,
    )


def curves(case):
    """History rows of ``case`` at its marks."""
    sim = Spreading(case)
    rows = [Moment(sim, state).row() for state in march(sim) if state.time in case.marks]
    return {key: np.array([row[key] for row in rows]) for key in rows[0]}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("wish", [0.01, pytest.param(0.003, marks=pytest.mark.verify)])
def test_axisymmetric_area_at_an_accuracy_wish(name, wish):
    known = reference(name)
    case = plan(case_of(known, model="auto", mesh={"front_edge": "auto", "far_edge": "auto"}, accuracy=wish)).case
    found = curves(case)
    error = np.abs(found["binding_area"] / known["binding_area"] - 1.0)
    wished_for = known["time"] >= 0.01
    assert np.all(error[wished_for] < wish + 0.005)  # the wish and the reference's own error
    assert np.all(error[~wished_for] < wish + 0.01)
    assert np.allclose(found["pressure"], known["pressure"], atol=0.015)
    # the largest density sits in single rings, frozen as each one landed, and scatters with where the nodes happen to be:
    # 2.5 to 5.3 % on five meshes about that of 1 %; so the root mean square over three
    others = [case.changed(**{"mesh.front_edge": factor * case.mesh.front_edge}) for factor in (0.85, 1.15)]
    density = np.array([found["density_max"], *(curves(other)["density_max"] for other in others)])
    assert np.sqrt(np.mean(np.max(np.abs(density / known["density_max"] - 1.0), axis=1) ** 2)) < 0.05


@pytest.mark.verify
@pytest.mark.parametrize("name, meridian", [
    ("typical-auto", []), ("fig9-base", ["model=axisymmetric", "mesh=auto", "time.step=auto"]),
])  # fmt: skip
def test_shipped_cases_keep_their_wish(name, meridian):
    """At the shipped drag and mobility, where receptors outnumber the ligands below, against a run at a wish of 0.07 %."""
    times = [0.004, 0.008, 0.02, 0.044, 0.08, 0.128, 0.25, 0.56, 1.0]

    def areas(wish):
        changes = [*meridian, f"accuracy={wish}", "time.end=1.2", f"output.frames={times}"]
        found = curves(plan(load_case(ROOT / "configs" / f"{name}.yaml", changes)).case)
        return found["binding_area"][: len(times)]

    fine = areas(0.0007)
    for wish in (0.01, 0.003):
        assert np.max(np.abs(areas(wish) / fine - 1.0)) < wish


@pytest.mark.verify
@pytest.mark.parametrize("name", ["typical", "fig9"])
def test_surface_area_as_shipped(name):
    """`configs/` as they are but for thickness, drag and mobility: within 2 % at every listed time, 3 % before t = 0.02."""
    known = reference(name)
    shipped = load_case(
        ROOT / "configs" / {"typical": "typical.yaml", "fig9": "fig9-base.yaml"}[name],
        ["membrane.thickness=0", *EXTREMES, f"time.end={known['time'][-1]}", f"output.frames={known['time'][:-1].tolist()}"],
    )
    found = curves(shipped)
    error = np.abs(found["binding_area"] / known["binding_area"] - 1.0)
    assert np.all(error < np.where(known["time"] < 0.02, 0.03, 0.02))
    assert np.max(np.abs(found["volume_error"])) < 1e-10
    assert np.max(np.abs(found["receptor_number_error"])) < 1e-12
    assert np.all(found["gap_min"] >= 0.0)


@pytest.mark.verify
def test_surface_and_meridian_agree_where_the_membrane_is_taut():
    """With a prestretch of 1.05 nothing is in compression, and A, p and c agree within the summed wishes.

    Without prestretch a surface without bending wrinkles early on, and its pressure is higher: README.
    """
    known = reference("typical")
    auto = {"front_edge": "auto", "far_edge": "auto"}
    taut = {"shear_modulus": 1.81, "prestretch": 1.05, "thickness": 0.0}
    both = [
        curves(plan(case_of(known, model=model, mesh=auto, accuracy=wish).model_copy(
            update={"membrane": case_of(known).membrane.model_copy(update=taut)})).case)
        for model, wish in (("axisymmetric", 0.003), ("surface", 0.02))
    ]  # fmt: skip
    for column in ("binding_area", "pressure", "density_min", "density_max"):
        assert np.allclose(both[1][column], both[0][column], rtol=0.023), column


@pytest.mark.verify
@pytest.mark.parametrize("thickness", [0.01, 0.02])
def test_surface_and_meridian_agree_where_bending_resists_the_compression(thickness):
    """The typical case at its start, slack and in compression to -0.06 K, which a pure membrane answers by wrinkles.

    Without bending the pressures at t = 0.008 are 0.010 on the meridian and 0.146 on a surface of edge 0.02; a thickness of
    0.01 leaves 0.0007 on both. The area of the surface comes down to the meridian's as the bent front is resolved.
    """
    known = reference("typical")
    known = {key: column[known["time"] < 0.13] for key, column in known.items()}

    def found(model, edge, far_edge):
        case = case_of(known, model=model, mesh={"front_edge": edge, "far_edge": far_edge}, accuracy=0.01)
        membrane = case.membrane.model_copy(update={"thickness": thickness})
        return curves(plan(case.model_copy(update={"membrane": membrane})).case)

    fine = found("axisymmetric", 0.005, 0.01)
    errors = []
    for edge in (0.03, 0.02):
        surface = found("surface", edge, 0.05)
        errors.append(np.max(np.abs(surface["binding_area"] / fine["binding_area"] - 1.0)))
        print(f"h = {thickness}, edge {edge}: pressures {surface['pressure']} and {fine['pressure']}, areas to {errors[-1]:.1%}")
        assert np.allclose(surface["pressure"], fine["pressure"], rtol=0.005, atol=0.0015)
    assert errors[1] < 0.75 * errors[0] and errors[1] < 0.035
