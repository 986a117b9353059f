"""Scale invariance: modulus, traction and drag times s, drift number over s, is the same motion (equations 1 to 6).

Stresses grow by s, and the drift, which is the drift number times a stress, stays. No tolerance, floor or cap may notice;
the digits differ by the rounding of the products alone.
"""

import numpy as np
import pytest

from vesdyn.case import Case
from vesdyn.diagnostics import Moment
from vesdyn.planning import plan
from vesdyn.spreading import Spreading
from vesdyn.stepping import march

SCALE = 1e5
SCENES = {
    "typical": (1.81, 2.416, 17.5, 0.07, 0.01, 1.0),
    "pure membrane": (0.302, 1.51, 17.5, 0.07, 0.0, 1.0),
    "weak and swollen": (4.4, 0.466, 4.54, 0.0212, 0.0265, 1.04),
}


def case_of(scene, scale, method):
    shear_modulus, traction, drift_number, drag, thickness, prestretch = SCENES[scene]
    return Case(
        name="scaled",
        model="axisymmetric",
        accuracy=0.04,
        membrane={"shear_modulus": scale * shear_modulus, "thickness": thickness, "prestretch": prestretch},
        adhesion={"traction": scale * traction},
        receptors={"drift_number": drift_number / scale},
        drag=scale * drag,
        mesh={"front_edge": 0.02, "far_edge": 0.05},
        time={"end": 0.03, "step": "auto"},
        solver={"method": method},
        output={"frames": ()},
    )


def curve(case):
    sim = Spreading(case)
    rows = []
    for state in march(sim):
        m = Moment(sim, state)
        scaled = m["pressure"] / case.membrane.shear_modulus
        rows.append((m["time"], m["binding_area"], m["contact_radius"], m["density_max"], scaled))
    return np.array(rows)


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("method", ["newton", "relaxation"])
def test_scaled_scene_moves_alike(scene, method):
    plain, scaled = curve(case_of(scene, 1.0, method)), curve(case_of(scene, SCALE, method))
    assert len(plain) == len(scaled) > 20
    assert np.allclose(scaled, plain, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("scene", SCENES)
def test_scaled_scene_is_planned_alike(scene):
    plain, scaled = (plan(auto(case_of(scene, scale, "auto"))).case for scale in (1.0, SCALE))
    assert scaled.mesh.difficulty == pytest.approx(plain.mesh.difficulty, rel=0.01)  # three digits of it are kept
    assert (scaled.mesh.front_edge, scaled.mesh.far_edge, scaled.mesh.fine_angle) == (
        plain.mesh.front_edge, plain.mesh.far_edge, plain.mesh.fine_angle,
    )  # fmt: skip
    assert scaled.membrane.thickness == plain.membrane.thickness


def auto(case):
    return case.changed(model="auto", **{"mesh.front_edge": "auto", "mesh.far_edge": "auto"})
