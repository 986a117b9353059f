"""What `auto` decides: the body, and whether bending may be left out; wrinkles told where a membrane is slack."""

import numpy as np
import pytest

from vesdyn import planning
from vesdyn.case import Case
from vesdyn.kinds import KINDS
from vesdyn.planning import Scout, compression_note, plan, survey, wrinkling

BRIEF = {"time": {"end": 0.05, "step": "auto"}, "output": {"frames": ()}}
AUTO = {"front_edge": "auto", "far_edge": "auto"}


def planned(model="auto", accuracy=0.01, **membrane):
    return plan(Case(name="a", model=model, accuracy=accuracy, mesh=AUTO, membrane=membrane, **BRIEF))


def sentence(decisions, start):
    (found,) = [text for text in decisions if text.startswith(start)]
    return found


def test_bending_is_left_out_where_it_does_little_and_nothing_is_slack():
    case, decisions = planned(prestretch=1.2, thickness=0.0005, accuracy=0.02)
    assert case.membrane.thickness == 0.0
    assert "changes the binding area by 0." in sentence(decisions, "left out: bending;")
    assert any(text.startswith("compression: none") for text in decisions)


def test_bending_is_kept_where_its_effect_exceeds_the_wish():
    case, decisions = planned(prestretch=1.2, thickness=0.02)
    assert case.membrane.thickness == 0.02
    assert "would differ by up to" in sentence(decisions, "bending: thickness 0.02;")


def test_bending_is_kept_under_compression_whatever_its_effect():
    case, decisions = planned(thickness=0.0005, accuracy=0.2)
    assert case.membrane.thickness == 0.0005
    assert "wrinkle at the scale of the mesh" in sentence(decisions, "bending: thickness")
    assert "wavelength of about" in sentence(decisions, "compression:")


def test_bending_is_never_left_out_of_a_body_that_was_asked_for():
    case, _ = planned("axisymmetric", prestretch=1.2, thickness=0.0005, accuracy=0.02)
    assert case.membrane.thickness == 0.0005


def test_a_pure_membrane_says_so():
    case, decisions = planned(thickness=0.0)
    assert "left out: bending (membrane.thickness is 0)." in decisions
    assert "without bending it would wrinkle at the scale of the mesh" in sentence(decisions, "compression:")


def test_wrinkles_of_a_compressed_sheet():
    """B = 0.3/3 * 0.1^2 = 1e-3, T = -0.02: k^2 = T/2B = 10, rate T^2/(4 B drag) = 0.1/drag."""
    case = Case(name="a", drag=0.05, membrane={"shear_modulus": 0.3, "thickness": 0.1})
    text = wrinkling(case, -0.02)
    assert f"{2 * np.pi / np.sqrt(10):.2g} a0" in text
    assert "in 0.5 a0^2/D" in text


@pytest.mark.parametrize("model, tension, told", [("axisymmetric", -0.1, True), ("axisymmetric", 0.0, False), ("surface", -0.1, False)])
def test_only_a_meridian_under_compression_notes_it(model, tension, told):
    history = {"time": [0.1], "free_tension_min": [tension], "free_tension_min_height": [0.2]}
    note = compression_note(Case(name="a", model=model), history)
    assert (note is not None) == told


def test_scouts_of_a_soft_scene_are_fine_as_far_as_the_front_goes():
    """The front passes 80 degrees, beyond which the edges of the first scouts are many times longer: there they fold under."""
    soft = Case(
        name="a", model="axisymmetric", accuracy=0.04, mesh=AUTO, membrane={"shear_modulus": 0.1},
        adhesion={"traction": 3.0}, time={"end": 1.2, "step": "auto"}, output={"frames": ()},
    )  # fmt: skip
    scouts = survey(soft)
    assert all(80.0 < seen.reach < seen.fine_angle and not seen.folded for seen in scouts)
    assert all(seen.final_time == 1.2 or seen.steady for seen in scouts)
    assert scouts[0].final_area == pytest.approx(scouts[1].final_area, rel=0.04)


# Scouts, by what they say they saw


def said(front_edge, fine_angle, radius=0.2, reach=40.0):
    """What a scout would say that met no compression; its area runs as the root of time, whatever its edge."""
    t = np.linspace(0.0, 1.0, 50)
    nothing = dict.fromkeys(Scout._fields)
    return Scout(**nothing | {
        "front_edge": front_edge, "fine_angle": fine_angle, "early_radius": radius, "reach": reach, "final_area": 0.6,
        "final_time": 1.0, "steady": False, "bends": True, "tension": 0.1, "tension_time": 0.1, "tension_height": 0.1,
        "curve": np.stack([t, 0.6 * np.sqrt(t) * (1.0 + front_edge**2)], axis=1),
    })  # fmt: skip


@pytest.fixture
def scouts(monkeypatch):
    """Put ``say(edge, fine_angle)`` in the place of the scout; the list of the edges and angles it was asked for."""

    def put(say):
        asked = []
        monkeypatch.setattr(planning, "scout", lambda case, edge, fine: asked.append((edge, fine)) or say(edge, fine))
        return asked

    return put


def test_scouts_resolve_cutoff_and_front_and_come_in_pairs(scouts):
    """Four edges in the cutoff; about six in the radius at which the wish begins to count."""
    asked = scouts(lambda edge, fine: said(edge, fine, radius=0.05))
    coarser, finer = survey(Case(name="a", model="axisymmetric", adhesion={"cutoff": 0.06}))
    assert asked[0][0] == pytest.approx(0.06 / 4)
    assert finer.front_edge <= 1.6 * 0.05 / 6 and coarser.front_edge >= 1.5 * finer.front_edge
    asked = scouts(lambda edge, fine: said(edge, fine, radius=0.05 if edge > 0.012 else 0.02))  # nearer when seen finer
    _, finer = survey(Case(name="a", model="axisymmetric", adhesion={"cutoff": 0.06}))
    assert finer.front_edge <= 1.6 * 0.02 / 6 and len(asked) == 3


def test_scouts_are_fine_as_far_as_the_front_goes(scouts):
    scouts(lambda edge, fine: said(edge, fine, reach=min(fine, 120.0)))
    assert all(scout.reach < scout.fine_angle for scout in survey(Case(name="a", model="axisymmetric")))


@pytest.mark.parametrize("failures, found", [(2, True), (3, False)])
def test_a_scout_without_a_balance_is_repeated_finer(scouts, failures, found):
    asked = scouts(lambda edge, fine: said(edge, fine) if len(asked) > failures else None)
    assert (survey(Case(name="a", model="axisymmetric")) is not None) == found
    assert asked[0][0] > asked[1][0] > asked[2][0]


def test_the_wish_is_shared_out(scouts):
    """Four tenths to the mesh, half to the step, a tenth to the tolerance."""
    scouts(lambda edge, fine: said(edge, fine))
    case, decisions = plan(Case(name="a", model="axisymmetric", accuracy=0.02, mesh=AUTO))
    mesh = KINDS["axisymmetric"].mesh_error(case.mesh, True).at(case.mesh.front_edge, 0.2) * case.mesh.difficulty
    assert mesh == pytest.approx(0.4 * 0.02, rel=0.1)  # edges have two digits
    assert "estimated error 1.00%" in sentence(decisions, "step: adaptive")
    assert "estimated error 0.20%" in sentence(decisions, "tolerance:")


def test_bending_stays_where_the_pure_membrane_is_slack(scouts):
    """However little it changes the area: without it the mesh would wrinkle."""
    for slack, thickness in ((False, 0.0), (True, 0.0005)):
        told = iter([0.1, 0.1, -0.5 if slack else 0.1])
        scouts(lambda edge, fine: said(edge, fine)._replace(tension=next(told)))
        assert planned(thickness=0.0005).case.membrane.thickness == thickness
