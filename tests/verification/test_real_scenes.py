"""The real scenes that are shipped: their numbers against those in SI, and each run to its end.

kT = 4.11e-21 J. K a0^2/kT; h = (3 B/K)^(1/2)/a0; T_max d_c/2 = W a0^2/kT; drift number T_max d_c/2 = W/(kT c); drag =
viscosity D a0/kT.
"""

import pytest

from vesdyn.case_file import load_case
from vesdyn.meshing import reduced_volume, spheroid_area
from vesdyn.planning import plan
from vesdyn.run import simulate

KT = 4.11e-21  # [J]
SI = {  # a0 [m], K [N/m], B [J], W [J/m2], d_c [m], receptors [1/m2], D [m2/s], viscosity [Pa s], reduced volume
    "red-cell": (5.64e-6, 5.5e-6, 2e-19, 1e-6, 20e-9, 1e15, 1e-14, 1e-3, 0.6),
    "red-cell-sphere": (5.64e-6, 5.5e-6, 2e-19, 1e-6, 20e-9, 1e15, 1e-14, 1e-3, 1.0),
    "giant-vesicle": (14e-6, 2e-6, 20 * KT, 2e-7, 28e-9, 1e14, 1e-12, 1e-3, 0.95),
    "white-cell": (8.5e-6, 80e-6, 1.5e-18, 1e-5, 50e-9, 3e14, 2e-14, 100.0, 1.0),
}


@pytest.mark.parametrize("name", SI)
def test_numbers_are_those_of_the_comments(name):
    a0, K, B, W, range_, receptors, D, viscosity, volume = SI[name]
    case = load_case(f"real/{name}")
    strength = 0.5 * case.adhesion.traction * case.adhesion.cutoff
    assert case.membrane.shear_modulus == pytest.approx(K * a0**2 / KT, rel=0.005)
    assert case.membrane.thickness == pytest.approx((3.0 * B / K) ** 0.5 / a0, rel=0.005)
    assert case.adhesion.cutoff == pytest.approx(range_ / a0, rel=0.005)
    assert strength == pytest.approx(W * a0**2 / KT, rel=0.005)
    assert case.drift_number * strength == pytest.approx(W / (KT * receptors), rel=0.01)
    assert case.drag == pytest.approx(viscosity * D * a0 / KT, rel=0.005)
    assert reduced_volume(spheroid_area(case.mesh.axes)) == pytest.approx(volume, rel=0.002)


@pytest.mark.verify
@pytest.mark.parametrize("name", SI)
def test_scene_runs_to_its_end_and_believes_to_keep_its_wish(name):
    case = plan(load_case(f"real/{name}")).case
    moments = [(m["binding_area"], m["area_error"], m["volume_error"]) for m in simulate(case)]
    final = moments[-1][0]
    assert max(error for area, error, _ in moments if area >= 0.1 * final) <= 1.1 * case.accuracy
    assert max(abs(error) for *_, error in moments) < 1e-9
    assert final > 10.0 * moments[0][0]  # it spreads: nearness alone is not it
