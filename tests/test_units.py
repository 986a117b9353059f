"""Units of SI: quantities in a case, what is told in SI, and what is refused."""

import subprocess
import sys

import numpy as np
import pytest
from scipy.constants import k as BOLTZMANN

import vesdyn
from vesdyn import units
from vesdyn.case import UNIT_OF, Case
from vesdyn.case_file import load_case
from vesdyn.cli import main
from vesdyn.diagnostics import COLUMNS
from vesdyn.errors import CaseError
from vesdyn.scales import ratios, told
from vesdyn.units import Scales

SCALES = {"diameter": "10 um", "diffusivity": "0.01 um^2/s", "temperature": "300 K", "receptor_density": "1000/um^2"}
A0, D, KT = 1e-5, 1e-14, 300.0 * BOLTZMANN  # [m], [m^2/s], [J]
TEXT = """name: si
model: axisymmetric
units: {diameter: 10 um, diffusivity: 0.01 um^2/s, temperature: 300 K}
membrane: {shear_modulus: 6 uN/m, thickness: 200 nm}
adhesion: {traction: 10 Pa, cutoff: 0.5 um}
receptors: {drift_number: 6.0e-6}
drag: 1.0e+6 Pa s/m
mesh: {front_edge: 0.05, far_edge: 0.1}
time: {end: 2 s, step: 500 ms}
output: {frames: [1 s, 0.00015]}
"""


def si(**keys):
    return Case(name="a", units=SCALES, **keys)


@pytest.mark.parametrize(
    ("key", "text", "expected"),
    [
        ("membrane.shear_modulus", "6 uN/m", 6e-6 * A0**2 / KT),
        ("membrane.shear_modulus", "6 µN/m", 6e-6 * A0**2 / KT),
        ("membrane.thickness", "50 nm", 0.005),
        ("adhesion.traction", "50 Pa", 50.0 * A0**3 / KT),
        ("adhesion.cutoff", "2e-2 um", 0.002),
        ("drag", "1e6 Pa*s/m", 1e6 * D * A0**2 / KT),
        ("drag", "2 Pa s", 2.0 * D * A0 / KT),  # a viscosity: of the drag times a0
        ("time.end", "2 h", 7200.0 * D / A0**2),
    ],
)
def test_quantities_in_units_of_the_model(key, text, expected):
    assert si(**{key: text}).get(key) == pytest.approx(expected, rel=1e-14)


def test_every_unit_of_a_key_and_of_a_column_is_known():
    assert len(UNIT_OF) == 15
    scales = si().scales
    for unit in {*UNIT_OF.values(), *(column.unit for column in COLUMNS)} - {"1"}:
        number, name = scales.of(unit)
        assert number > 0.0 and scales.to(1.0, unit, name) == pytest.approx(number, rel=1e-14)


def test_round_trip_of_what_was_given(tmp_path):
    (tmp_path / "a.yaml").write_text(TEXT)
    case = load_case(tmp_path / "a.yaml")
    assert case.output.frames == (1e-4, 0.00015) and "6 uN/m" in case.to_yaml()
    (tmp_path / "b.yaml").write_text(case.to_yaml())
    again = load_case(tmp_path / "b.yaml")
    assert again == case and again.hash == case.hash and again.to_yaml() == case.to_yaml()
    plain = Case(**{key: value for key, value in case.resolved().items() if key not in ("units", "receptors")}, receptors=case.receptors)
    assert plain.hash == case.hash  # the scales alone decide no numbers


def test_other_scales_convert_anew(tmp_path):
    (tmp_path / "a.yaml").write_text(TEXT)
    case, larger = (load_case(tmp_path / "a.yaml", sets) for sets in (["output.frames=[]"], ["output.frames=[]", "units.diameter=20 um"]))
    assert larger.membrane.shear_modulus == pytest.approx(4.0 * case.membrane.shear_modulus, rel=1e-14)
    assert case.changed(**{"units.diameter": "20 um"}).drag == larger.drag
    softer = load_case(tmp_path / "a.yaml", ["membrane.shear_modulus=3 uN/m", "time.end=1 s"])
    assert softer.membrane.shear_modulus == pytest.approx(case.membrane.shear_modulus / 2.0) and len(softer.output.frames) == 1


@pytest.mark.parametrize(
    ("keys", "sentence"),
    [
        ({"drag": "1 Pa s"}, "drag: 1 Pa s needs the scales of the scene; give units:"),
        ({"units": {"diameter": "10 um"}}, "units.diffusivity: missing; give it, such as 0.01 um^2/s."),
        ({"units": SCALES | {"diameter": 10}}, "units.diameter: 10 has no unit; write a number and a unit, such as 10 um."),
        ({"units": SCALES | {"diameter": "10 s"}}, "units.diameter: 10 s is not a length; write one such as 10 um."),
        ({"units": SCALES | {"diameter": "0 um"}}, "units.diameter: 0 um is out of range; it must be greater than 0."),
        ({"units": SCALES | {"temperature": "1e999 K"}}, "units.temperature: 1e999 K is out of range"),
        ({"units": SCALES, "time": {"end": "2 Pa"}}, "time.end: 2 Pa is not a quantity that is measured in s; write one such as 2 h."),
        ({"units": SCALES, "time": {"end": "2 parsnips"}}, "time.end: parsnips is no unit"),
        ({"units": SCALES, "time": {"end": "2 s^99"}}, "time.end: s^99 is no unit"),
        ({"units": SCALES, "drag": "-1 Pa s"}, "drag: -"),
        ({"units": SCALES, "output": {"frames": ["1 s", "1 m"]}}, "output.frames[1]: 1 m is not a quantity that is measured in s"),
        ({"units": SCALES, "adhesion": {"ligand_ratio": "8 um"}}, "adhesion.ligand_ratio: 8 um is not a number"),
        ({"units": {"diametre": "10 um"}}, "units.diametre: unknown key, did you mean diameter?"),
        ({"units": "um"}, "units: um is not a section with keys"),
    ],
)  # fmt: skip
def test_what_is_refused(keys, sentence):
    with pytest.raises(CaseError) as error:
        Case(name="a", **keys)
    assert sentence in str(error.value)


def test_refusal_names_the_file(tmp_path, capsys):
    (tmp_path / "a.yaml").write_text(TEXT.replace("10 Pa", "10 Paa"))
    assert main(["scales", str(tmp_path / "a.yaml")]) == 2
    assert f"{tmp_path}/a.yaml: adhesion.traction: Paa is no unit" in capsys.readouterr().err


@pytest.mark.parametrize("keys", [{"membrane": {"shear_modulus": 6.0e-6}}, {"time": {"end": 7200.0}}])
def test_number_that_smells_of_si_is_told(keys):
    assert any("a number of SI needs its unit" in doubt for doubt in Case(name="a", **keys).warnings())
    assert not any("SI" in doubt for doubt in Case(name="a", time={"end": 3.0}).warnings())


@pytest.mark.parametrize(
    ("value", "unit", "shown"),
    [(0.67, "a0^2", "67 um^2"), (0.002, "a0", "20 nm"), (1.0, "a0^2/D", "2.778 h"), (2.0, "c_r0", "2000/um^2"), (0.0, "a0", "0 nm")],
)
def test_handy_units(value, unit, shown):
    assert si().scales.shown(value, unit) == shown


def test_what_has_no_scale():
    scales = Scales(A0, D, 300.0)
    assert scales.of("c_r0") is None and scales.of("1") is None and scales.shown(1.0, "furlong") is None
    with pytest.raises(CaseError, match="is no unit for a0"):
        scales.to(1.0, "a0", "s")


def test_similar_scenes_have_equal_ratios():
    """model: K, T_max and drag times s with the drift number over s is the same motion."""
    case = si(receptors={"drift_number": 17.5})
    s = 1e5
    scaled = case.changed(
        **{
            "membrane.shear_modulus": s * case.membrane.shear_modulus,
            "adhesion.traction": s * case.adhesion.traction,
            "drag": s * case.drag,
            "receptors.drift_number": case.drift_number / s,
        }
    )
    assert [r.value for r in ratios(scaled)] == pytest.approx([r.value for r in ratios(case)], rel=1e-14)
    assert ratios(case)[0].value == pytest.approx(2.416 * 0.1 / 2.0 / 1.81)
    assert "L W" in told(case) and "10 um" in told(case) and "no units are given" in told(Case(name="a"))


def test_run_speaks_si(tmp_path, capsys):
    (tmp_path / "a.yaml").write_text(TEXT)
    assert main(["run", str(tmp_path / "a.yaml"), "--out", str(tmp_path / "r")]) == 0
    words = capsys.readouterr().out
    assert "t = 0.0002 = 2 s" in words and " um^2 (" in words
    assert main(["info", str(tmp_path / "r")]) == 0
    assert "t = 0.0002 = 2 s" in capsys.readouterr().out
    run = vesdyn.open_run(tmp_path / "r")
    assert np.allclose(run.history.to("time", "min"), run.history["time"] * 1e4 / 60.0, rtol=1e-12)
    assert np.allclose(run.history.to("pressure", "Pa"), run.history["pressure"] * KT / A0**3, rtol=1e-12)
    for column, unit, sentence in (("time", "m", "is no unit for"), ("density_max", "1/um^2", "has no scale"), ("tme", "s", "unknown")):
        with pytest.raises(CaseError, match=sentence):
            run.history.to(column, unit)
    assert "10000 s" in (tmp_path / "r" / "columns.csv").read_text()


@pytest.mark.parametrize("text", ["3 m", "3nm", "1e-3 um^2/s", ".5 °C", "1000/um^2", "-2 Pa s"])
def test_what_is_a_quantity(text):
    assert units.is_quantity(text)


@pytest.mark.parametrize("text", ["auto", 3.0, "1%", "0x10", "1e", "9_6", "1:30", "1,5", "0o10", "um", "3", "3 4", "1_000 m"])
def test_what_is_none(text):
    assert not units.is_quantity(text)


def test_pint_is_read_only_where_it_is_needed():
    code = "import sys, vesdyn; vesdyn.load_case('typical'); assert 'pint' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_frames_every_so_many_seconds(tmp_path):
    (tmp_path / "a.yaml").write_text(TEXT.replace("frames: [1 s, 0.00015]", "frames: {every: 500 ms}"))
    case = load_case(tmp_path / "a.yaml")
    assert case.output.frames == (5e-5, 1e-4, 1.5e-4, 2e-4) and "{every: 500 ms}" in case.to_yaml()
    (tmp_path / "b.yaml").write_text(case.to_yaml())
    assert load_case(tmp_path / "b.yaml") == case
