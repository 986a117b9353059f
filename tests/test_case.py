"""The case: defaults, refusals that are sentences, doubts, and the way to YAML and back."""

import pickle
from pathlib import Path

import pytest
from pydantic import ValidationError

from vesdyn.case import Case, CaseError, load_case, template

CONFIGS = sorted((Path(__file__).parents[1] / "configs").glob("*.yaml"))


@pytest.fixture
def load(tmp_path):
    """Return a function that loads a case from YAML text (and overrides)."""

    def load(text, *overrides):
        file = tmp_path / "case.yaml"
        file.write_text(text)
        return load_case(file, overrides)

    return load


@pytest.fixture
def complaint(load):
    """Return a function that gives the message with which YAML text (and overrides) is refused."""

    def complaint(text, *overrides):
        with pytest.raises(CaseError) as refused:
            load(text, *overrides)
        return str(refused.value)

    return complaint


def test_defaults_are_the_typical_case(load):
    case = load("name: typical")
    assert (case.membrane.shear_modulus, case.membrane.thickness, case.membrane.prestretch) == (1.81, 0, 1)
    assert (case.adhesion.traction, case.adhesion.cutoff, case.adhesion.ligand_ratio) == (2.416, 0.1, 8)
    assert (case.receptors.mobility, case.receptors.drift_number, case.receptors.frozen) == (2.1875, 17.5, False)
    assert (case.drag, case.mesh.front_edge, case.mesh.far_edge) == (0.07, 0.015, 0.05)
    assert (case.time.end, case.time.step) == (1.2, 0.001)
    assert case.output.frames == (0.008, 0.044, 0.128, 0.56)
    assert not case.warnings()


@pytest.mark.parametrize("file", CONFIGS, ids=lambda file: file.stem)
def test_shipped_cases_load_and_are_called_after_their_file(file):
    assert load_case(file).name == file.stem


def test_typical_config_holds_the_defaults():
    assert load_case(CONFIGS[[f.stem for f in CONFIGS].index("typical")]) == Case(name="typical")


def test_resolved_case_reads_back_to_an_equal_one(load):
    case = load("name: a\nreceptors: {drift_number: 17}\nadhesion: {ligand_ratio: 3}\ntime: {step: 1.0e-5}")
    assert load(case.to_yaml()) == case
    assert load(case.to_yaml() + "provenance: {vesdyn: 0.1.0}\n") == case


def test_template_has_every_key_at_its_default(load):
    case = load(template())
    assert case == Case(name="typical")
    for section in ("membrane", "adhesion", "receptors", "mesh", "time", "output", "solver"):
        for key in type(getattr(case, section)).model_fields:
            assert f"  {key}: " in template() or f"  # {key}: " in template()


def test_case_is_frozen_comparable_and_picklable(load):
    case = load("name: a")
    with pytest.raises(ValidationError):
        case.drag = 1.0
    with pytest.raises(ValidationError):
        case.membrane.shear_modulus = 1.0
    assert pickle.loads(pickle.dumps(case)) == case
    assert case != load("name: a\ndrag: 0.08")
    assert hash(case) == hash(load("name: a"))


@pytest.mark.parametrize("text", ["1e-3", "1E-3", "1.e-3", "+1e-3", "0.001", "1.0e-03"])
def test_numbers_with_exponents_are_numbers(load, text):
    assert load(f"name: a\ntime: {{step: {text}}}").time.step == 1e-3


@pytest.mark.parametrize(
    "receptors, drift_number",
    [
        ("{}", 8 * 2.1875),
        ("{mobility: 2}", 16),
        ("{drift_number: 12}", 12),
        ("{mobility: 2, drift_number: 16}", 16),
        ("{mobility: null, drift_number: 12}", 12),
    ],
)
def test_drift_number_is_resolved(load, receptors, drift_number):
    case = load(f"name: a\nreceptors: {receptors}")
    assert case.drift_number == case.receptors.drift_number == drift_number
    assert case.receptors.mobility == drift_number / 8


def test_overrides_replace_add_and_are_read_as_yaml(load):
    case = load("name: a\ntime: {end: 1}", "time.step=1e-3", "time.end=0.5", "output.frames=[0.1, 0.5]", "name=b")
    assert (case.time.end, case.time.step, case.output.frames, case.name) == (0.5, 1e-3, (0.1, 0.5), "b")


@pytest.mark.parametrize(
    "yaml, key, part",
    [
        ("membrane: {shear_modulus: -1}", "membrane.shear_modulus", "-1 is out of range; it must be greater than 0."),
        ("membrane: {shear_modulus: .nan}", "membrane.shear_modulus", ".nan is not a finite number"),
        ("membrane: {shear_modulus: .inf}", "membrane.shear_modulus", ".inf is not a finite number"),
        ("membrane: {shear_modulus: true}", "membrane.shear_modulus", "true is not a number"),
        ("membrane: {shear_modulus: '1.81'}", "membrane.shear_modulus", "'1.81' is not a number"),
        ("membrane: {shear_modulus: }", "membrane.shear_modulus", "null is not a number"),
        ("membrane: {prestretch: 0.9}", "membrane.prestretch", "at least 1"),
        ("membrane: 3", "membrane", "not a section"),
        ("membrane: {shear_modulos: 1}", "membrane.shear_modulos", "unknown key, did you mean shear_modulus?"),
        ("shear_modulus: 1", "shear_modulus", "unknown key, did you mean membrane.shear_modulus?"),
        ("colour: 1", "colour", "unknown key, leave it out; the keys here are name, model"),
        ("1: 2", "1", "unknown key"),
        ("adhesion: {cutoff: 0}", "adhesion.cutoff", "greater than 0"),
        ("adhesion: {ligand_ratio: 0}", "adhesion.ligand_ratio", "greater than 0"),
        ("receptors: {frozen: 1}", "receptors.frozen", "neither true nor false"),
        ("receptors: {mobility: 2, drift_number: 12}", "receptors.drift_number", "12 contradicts"),
        ("drag: -0.1", "drag", "at least 0"),
        ("model: flat", "model", "flat is not available; choose 'surface', 'axisymmetric' or 'auto'."),
        ("mesh: {front_edge: 0.06}", "mesh.front_edge", "0.06 is longer than far_edge = 0.05"),
        ("mesh: {layout: cubes}", "mesh.layout", "choose 'scalloped', 'rings' or 'spiral'"),
        ("time: {end: -1}", "time.end", "greater than 0"),
        ("time: {step: 2}", "time.step", "longer than the whole run"),
        ("output: {frames: [0.3, 0.1]}", "output.frames", "does not increase"),
        ("output: {frames: [0.1, 0.1]}", "output.frames", "does not increase"),
        ("output: {frames: [0, 0.1]}", "output.frames", "always stored"),
        ("output: {frames: [0.1, 3]}", "output.frames", "after the end of the run"),
        ("output: {frames: [0.1, yes]}", "output.frames[1]", "true is not a number"),
        ("output: {frames: 0.1}", "output.frames", "not a list"),
        ("solver: {max_iterations: 1.5}", "solver.max_iterations", "not a whole number"),
    ],
)
def test_refusals_name_file_key_value_and_remedy(complaint, tmp_path, yaml, key, part):
    message = complaint(f"name: a\n{yaml}")
    assert message.startswith(f"{tmp_path / 'case.yaml'}: {key}: ")
    assert part in message
    assert message.endswith((".", "?")) and "\n" not in message


@pytest.mark.parametrize("name", ["a/b", "..", ".hidden", "-x", "''", "a b"])
def test_names_that_are_no_directory_names_are_refused(complaint, name):
    assert "cannot name a directory" in complaint(f"name: {name}")


def test_a_number_as_name_is_refused(complaint):
    assert "put it in quotes" in complaint("name: 2024")


def test_every_problem_gets_its_own_line(complaint):
    lines = complaint("drag: -1\ntime: {end: x}").splitlines()
    assert [line.split(": ")[1] for line in lines] == ["name", "drag", "time.end"]


@pytest.mark.parametrize(
    "text, part",
    [
        ("", "the file is empty"),
        ("- 1\n- 2", "not a mapping"),
        ("just text", "not a mapping"),
        ("name: a\ntime: {end: 1", "line 2: "),
        ("name: a\ndrag: 0.1\ndrag: 0.2", "line 3: the key drag is given twice"),
        ("name: a\ntime: {end: 1, end: 2}", "line 2: the key end is given twice"),
        ("name: a\n\tdrag: 1", "line 2: "),
        ("name: \0", "not readable as YAML"),
        ("name: 2001-13-45", "month must be in 1..12"),
    ],
)
def test_files_that_are_no_case(complaint, text, part):
    assert part in complaint(text)


def test_missing_file(tmp_path):
    with pytest.raises(CaseError, match="No such file"):
        load_case(tmp_path / "none.yaml")
    with pytest.raises(CaseError, match="Is a directory"):
        load_case(tmp_path)


@pytest.mark.parametrize(
    "override, part",
    [
        ("drag", "--set drag: not of the form"),
        ("=1", "not of the form"),
        ("time..end=1", "not of the form"),
        ("drag=-1", "--set drag: -1 is out of range"),
        ("drag.x=1", "--set drag.x: drag holds a value"),
        ("time={end: 1", "--set time: line 1"),
        ("time={end: -1}", "--set time.end: -1"),
        ("output.frames=[x]", "--set output.frames[0]: x is not a number"),
    ],
)
def test_refused_overrides_are_named(complaint, override, part):
    assert part in complaint("name: a\ndrag: 0.07", override)


@pytest.mark.parametrize(
    "override, key",
    [
        ("mesh.front_edge=0.04", "adhesion.cutoff"),
        ("time.step=0.01", "time.step"),
        ("adhesion.traction=0.001", "adhesion.traction"),
        ("adhesion.ligand_ratio=0.5", "adhesion.ligand_ratio"),
        ("drag=0", "drag"),
    ],
)
def test_doubtful_values_are_warned_of(load, override, key):
    (doubt,) = load("name: a", override).warnings()
    assert doubt.startswith(f"{key}: ") and doubt.endswith(".")
