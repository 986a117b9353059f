"""Case files: refusals that say where, bases, sweeps, precedence, the way to YAML and back."""

import os
import pickle
import warnings
from pathlib import Path

import pytest

from vesdyn.case import Case
from vesdyn.case_file import load_case, load_sweep, shipped_case, template
from vesdyn.errors import CaseError

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


@pytest.mark.parametrize("file", CONFIGS, ids=lambda file: file.stem)
def test_shipped_cases_load_and_are_called_after_their_file(file):
    assert load_case(file).name == file.stem


def test_every_curve_of_the_figures_has_one_config():
    parameters = {}
    for file in CONFIGS:
        case = load_case(file)
        if (case.model, case.time.step, case.accuracy) == ("auto", "auto", 0.01):
            adhesion = case.adhesion
            scene = (case.membrane.shear_modulus, adhesion.traction, adhesion.cutoff, adhesion.ligand_ratio)
            assert parameters.setdefault(scene, file.stem) == file.stem
            assert case.receptors.mobility == 2.1875 and case.drag == 0.07
    figure_4 = {(K, 1.51, 0.1, 8) for K in (0.603, 1.206, 1.81, 3.018)}
    figure_5 = {(1.81, T, 0.1, 8) for T in (0.302, 0.604, 1.51, 2.416)}
    figure_6 = {(1.81, 1.51, d_c, 8) for d_c in (0.06, 0.1, 0.18)}
    figure_7 = {(1.81, 2.416, 0.1, q) for q in (1.5, 2, 3, 8)}
    assert parameters.keys() == figure_4 | figure_5 | figure_6 | figure_7


def test_typical_config_holds_the_defaults():
    assert load_case(CONFIGS[[f.stem for f in CONFIGS].index("typical")]) == Case(name="typical")


def test_resolved_case_reads_back_to_an_equal_one(load):
    case = load("name: a\nreceptors: {drift_number: 17}\nadhesion: {ligand_ratio: 3}\ntime: {step: 1.0e-5}")
    assert load(case.to_yaml()) == case
    assert load(case.to_yaml() + "provenance: {vesdyn: 0.1.0}\n") == case


def test_template_has_every_key_at_its_default(load):
    case = load(template())
    assert case == Case(name="typical")
    for section in ("membrane", "adhesion", "receptors", "perturbation", "mesh", "time", "output", "solver"):
        for key in type(getattr(case, section)).model_fields:
            assert f"  {key}: " in template() or f"  # {key}: " in template()


@pytest.mark.parametrize("text", ["1e-3", "1E-3", "1.e-3", "+1e-3", "0.001", "1.0e-03"])
def test_numbers_with_exponents_are_numbers(load, text):
    assert load(f"name: a\ntime: {{step: {text}}}").time.step == 1e-3


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
        ("xyzzy: 1", "xyzzy", "unknown key, leave it out; the keys here are name, model"),
        ("1: 2", "1", "unknown key"),
        ("adhesion: {cutoff: 0}", "adhesion.cutoff", "greater than 0"),
        ("adhesion: {ligand_ratio: 0}", "adhesion.ligand_ratio", "greater than 0"),
        ("receptors: {frozen: 1}", "receptors.frozen", "neither true nor false"),
        ("receptors: {mobility: 2, drift_number: 12}", "receptors.drift_number", "12 contradicts"),
        ("drag: -0.1", "drag", "at least 0"),
        ("perturbation: {front: 0.3}", "perturbation.front", "at most 0.2"),
        ("perturbation: {front: 0.02, at: 2}\ntime: {end: 1.2}", "perturbation.at", "2 is not before the end of the run, 1.2"),
        ("model: axisymmetric\nperturbation: {front: 0.02}", "perturbation.front", "set model to surface or auto"),
        ("model: flat", "model", "flat is not available; choose 'surface', 'axisymmetric' or 'auto'."),
        ("mesh: {front_edge: 0.06, far_edge: 0.05}", "mesh.front_edge", "0.06 is longer than far_edge = 0.05"),
        ("mesh: {layout: cubes}", "mesh.layout", "choose 'scalloped', 'rings' or 'spiral'"),
        ("time: {end: -1}", "time.end", "greater than 0"),
        ("time: {end: 1, step: 2}", "time.step", "longer than the whole run"),
        ("output: {frames: [0.3, 0.1]}", "output.frames", "does not increase"),
        ("output: {frames: [0.1, 0.1]}", "output.frames", "does not increase"),
        ("output: {frames: [0, 0.1]}", "output.frames", "always stored"),
        ("time: {end: 1}\noutput: {frames: [0.1, 3]}", "output.frames", "after the end of the run"),
        ("output: {frames: [0.1, true]}", "output.frames[1]", "true is not a number"),
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
        ("name: \0", "line 1: the control character \\x00 is not allowed"),
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


# Bases


@pytest.fixture
def files(tmp_path):
    """Return a function that writes files, given by stem and text, and returns the path of the first."""

    def files(**texts):
        (tmp_path / "deeper").mkdir(exist_ok=True)
        for stem, text in texts.items():
            (tmp_path / f"{stem}.yaml").write_text(text)
        return tmp_path / f"{next(iter(texts))}.yaml"

    return files


def test_keys_of_a_base_are_defaults_through_a_chain_and_section_by_section(files, tmp_path):
    path = files(
        a="name: a\nbase: deeper/b.yaml\ntime: {end: 0.5}\noutput: {frames: [0.1]}",
        c="name: c\ndrag: 0.1\ntime: {end: 2, order: 1}\noutput: {frames: [0.3, 0.4]}\nmesh: {layout: rings}",
    )
    (tmp_path / "deeper" / "b.yaml").write_text("base: ../c.yaml\nname: b\nmesh: auto\ntime: {step: 0.002}")
    case = load_case(path)
    assert (case.name, case.drag) == ("a", 0.1)
    assert (case.time.end, case.time.order, case.time.step, case.output.frames) == (0.5, 1, 0.002, (0.1,))
    assert (case.mesh.front_edge, case.mesh.layout) == ("auto", "rings")
    assert "base" not in case.to_yaml()
    assert load_case(path, ["mesh.front_edge=0.01"]).mesh.front_edge == 0.01


@pytest.mark.parametrize(
    "texts, begins, part",
    [
        ({"a": "base: b.yaml", "b": "name: b"}, "a.yaml: name: ", "missing"),
        ({"a": "name: a\nbase: b.yaml", "b": "drag: -1"}, "b.yaml: drag: ", "at least 0"),
        ({"a": "name: a\nbase: b.yaml\ndrag: -1", "b": "drag: 1"}, "a.yaml: drag: ", "at least 0"),
        ({"a": "name: a\nbase: b.yaml", "b": "output: {frames: [x]}"}, "b.yaml: output.frames[0]: ", "not a number"),
        ({"a": "name: a\nbase: b.yaml", "b": "drag: 1\ndrag: 2"}, "b.yaml: line 2: ", "given twice"),
        ({"a": "name: a\nbase: b.yaml", "b": "base: a.yaml"}, "b.yaml: base: ", "leads in a circle"),
        ({"a": "name: a\nbase: a.yaml"}, "a.yaml: base: ", "leads in a circle"),
        ({"a": "name: a\nbase: none.yaml"}, "a.yaml: base: ", "none.yaml: No such file"),
        ({"a": "name: a\nbase: [b.yaml]"}, "a.yaml: base: ", "[b.yaml] is not a path; give one"),
        ({"a": "name: a\nbase: 3"}, "a.yaml: base: ", "3 is not a path"),
        ({"a": "name: a\nbase: b.yaml", "b": ""}, "b.yaml: ", "the file is empty"),
    ],
)
def test_refusals_name_the_file_of_the_fault(files, tmp_path, texts, begins, part):
    with pytest.raises(CaseError) as refused:
        load_case(files(**texts))
    message = str(refused.value)
    assert message.startswith(f"{tmp_path}/{begins}") and part in message and message.endswith(".")


# Sweeps

SWEPT = "name: a\nsweep: {membrane.shear_modulus: [0.603, 1.0e+1], adhesion.cutoff: [0.1, 0.2]}"


def test_a_sweep_is_every_combination(files):
    cases = load_sweep(files(a=SWEPT), ["drag=0.1"])
    assert [case.name for case in cases] == [
        "a-shear_modulus=0.603-cutoff=0.1",
        "a-shear_modulus=0.603-cutoff=0.2",
        "a-shear_modulus=10.0-cutoff=0.1",
        "a-shear_modulus=10.0-cutoff=0.2",
    ]
    grid = [(case.membrane.shear_modulus, case.adhesion.cutoff) for case in cases]
    assert grid == [(0.603, 0.1), (0.603, 0.2), (10, 0.1), (10, 0.2)]
    assert {case.drag for case in cases} == {0.1}


def test_any_value_can_be_swept(files):
    cases = load_sweep(files(a="name: a\nsweep: {mesh: [auto, {layout: rings}], output.frames: [[], [0.1, 0.2]]}"))
    assert [(case.mesh.front_edge, case.output.frames) for case in cases[::3]] == [("auto", ()), (0.015, (0.1, 0.2))]
    assert cases[3].name == "a-mesh=_layout_rings_-frames=_0.1_0.2_"


def test_without_a_sweep_a_file_is_one_case(files):
    assert load_sweep(files(a="name: a")) == [Case(name="a")] == load_sweep(files(a="name: a\nsweep:"))


def test_a_sweep_is_no_single_case(files, tmp_path):
    with pytest.raises(CaseError) as refused:
        load_case(files(a="name: a\nbase: b.yaml", b=SWEPT))
    assert str(refused.value) == (
        f"{tmp_path}/b.yaml: sweep: makes many cases of this file; run them by `vesdyn batch {tmp_path}/a.yaml`."
    )


@pytest.mark.parametrize(
    "text, overrides, part",
    [
        ("sweep: 3", (), "a.yaml: sweep: not a grid; write for instance"),
        ("sweep: {drag: 3}", (), "a.yaml: sweep: drag: not a list"),
        ("sweep: {drag: []}", (), "a.yaml: sweep: drag: not a list"),
        ("sweep: {drag: [1, -1]}", (), "a.yaml: sweep: drag: -1 is out of range"),
        ("sweep: {time.ends: [1]}", (), "a.yaml: sweep: time.ends: unknown key, did you mean end?"),
        ("drag: 1\nsweep: {drag.x: [1]}", (), "a.yaml: sweep: drag.x: drag holds a value"),
        ("sweep: {drag: [1, 2]}", ("drag=3",), "--set drag: is swept in"),
        ("sweep: {drag: [1, 2]}", ("time.end=-1",), "--set time.end: -1"),
    ],
)
def test_refused_sweeps(files, text, overrides, part):
    with pytest.raises(CaseError) as refused:
        load_sweep(files(a=f"name: a\n{text}"), overrides)
    assert part in str(refused.value) and "\n" not in str(refused.value)
