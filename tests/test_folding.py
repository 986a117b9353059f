"""Membrane that has turned over and lies on other membrane at the substrate: recognised, and the run ends there.

Whole scenes that fold stand in tests/verification/test_scenes_out_of_the_corner.py.
"""

import numpy as np
import pytest
from measure import sphere

from vesdyn.body import area_facing_away
from vesdyn.case import Case
from vesdyn.spreading import Spreading
from vesdyn.stepping import FoldError, march

LEVEL = 0.01  # [a0]
EDGES = {"axisymmetric": 0.002, "surface": 0.02}


def pressed(x, turned_from=np.inf):
    """``x`` flat where it is below z = 0.1, and the rim of that: from ``turned_from`` of its radius on it is mirrored."""
    low = x[:, -1] < 0.1
    flat = x.copy()
    flat[low, -1] = 0.0
    r = np.linalg.norm(flat[:, :-1], axis=1)
    rim = r[low].max()
    turned = low & (r > turned_from * rim)
    flat[turned, :-1] *= ((2.0 * turned_from * rim - r[turned]) / r[turned])[:, None]
    return flat, rim


@pytest.mark.parametrize("model", EDGES)
def test_sphere_and_pressed_sphere_do_not_fold(model):
    x, body = sphere(model, EDGES[model])
    assert area_facing_away(body.topology, x, LEVEL) == 0.0
    assert area_facing_away(body.topology, pressed(x)[0], LEVEL) == 0.0


@pytest.mark.parametrize("model", EDGES)
def test_pleat_is_found_with_its_area(model):
    """A ring that lies turned over between radii a < b has pi (b^2 - a^2), less the elements that its two creases cut."""
    x, body = sphere(model, EDGES[model])
    folded, rim = pressed(x, 0.8)
    expected = np.pi * rim**2 * (0.8**2 - 0.6**2)
    cut = 2.0 * np.pi * (0.8 + 0.6) * rim * EDGES[model]
    assert expected - cut < area_facing_away(body.topology, folded, LEVEL) < expected and cut < 0.8 * expected
    folded[:, -1] += 2.0 * LEVEL
    assert area_facing_away(body.topology, folded, LEVEL) == 0.0  # not at the substrate


@pytest.mark.parametrize("model", ["axisymmetric", pytest.param("surface", marks=pytest.mark.verify)])
def test_membrane_far_softer_than_its_adhesion_folds_on_either_body(model):
    case = Case(
        name="soft",
        model=model,
        accuracy=0.04,
        membrane={"shear_modulus": 0.001},
        mesh={"front_edge": 0.01 if model == "axisymmetric" else 0.04, "far_edge": 0.05, "fine_angle": 150.0},
        time={"end": 2.0, "step": "auto"},
        output={"frames": ()},
    )
    with pytest.raises(FoldError, match=r"^t = 0\.\d+: the membrane has folded over itself at the substrate"):
        for _ in march(Spreading(case)):
            pass
