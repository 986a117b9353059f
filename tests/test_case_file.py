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
        if (case.model, case.time.step, case.accuracy, case.adhesion.law) == ("auto", "auto", 0.01, "linear"):
            adhesion = case.adhesion
            scene = (case.membrane.shear_modulus, adhesion.traction, adhesion.cutoff, adhesion.ligand_ratio)
            assert parameters.setdefault(scene, file.stem) == file.stem
            assert case.receptors.mobility == 13 and case.drag == 0.024
    figure_4 = {(K, 1.51, 0.1, 8) for K in (0.603, 1.206, 1.81, 3.018)}
    figure_5 = {(1.81, T, 0.1, 8) for T in (0.302, 0.604, 1.51, 2.416)}
    figure_6 = {(1.81, 1.51, d_c, 8) for d_c in (0.06, 0.1, 0.18)}
    figure_7 = {(1.81, 2.416, 0.1, q) for q in (1.5, 2, 3, 8)}
    assert parameters.keys() == figure_4 | figure_5 | figure_6 | figure_7


def test_typical_config_holds_the_defaults_but_for_what_was_inferred():
    case = load_case(CONFIGS[[f.stem for f in CONFIGS].index("typical")])
    assert case == Case(name="typical", drag=0.024, receptors={"mobility": 13})


def test_the_other_reading_of_the_paper_is_a_base_of_its_own(tmp_path):
    base = CONFIGS[0].parent / "base" / "extremes.yaml"
    (tmp_path / "case.yaml").write_text(f"name: typical\nbase: {base}\n")
    case = load_case(tmp_path / "case.yaml")
    assert (case.drag, case.receptors.mobility, case.adhesion.traction) == (0.07, 2.1875, 2.416)


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
@pytest.mark.fault("n12")
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


# Precedence: --set over file over base over default


@pytest.fixture
def told(files):
    """Return a function that loads a file over a base, with overrides, and gives the case and what was warned of."""

    def told(file, base="", *overrides):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            path = files(a=f"name: a\nbase: b.yaml\n{file}", b=f"name: b\n{base}")
            return load_case(path, overrides), [str(warning.message) for warning in caught]

    return told


@pytest.mark.parametrize(
    "file, base, overrides, drift_number",
    [
        ("receptors: {drift_number: 20}", "receptors: {mobility: 2}", (), 20),
        ("receptors: {mobility: 2}", "receptors: {drift_number: 20}", (), 16),
        ("receptors: {mobility: 2}", "", ("receptors.drift_number=20",), 20),
        ("receptors: {drift_number: 20}", "", ("receptors.mobility=2",), 16),
        ("receptors: {drift_number: 20}", "", ("receptors.drift_number=null",), 8 * 2.1875),
        ("receptors: {mobility: 2}", "", ("adhesion.ligand_ratio=3",), 6),
        ("receptors: {drift_number: 20}", "", ("adhesion.ligand_ratio=3",), 20),
        ("receptors: {mobility: 2, drift_number: 16}", "", ("adhesion.ligand_ratio=3",), 6),  # as runs stored it once
        ("receptors: {mobility: 2, drift_number: 16}\nadhesion: {ligand_ratio: 8}", "", ("receptors.mobility=3",), 24),
        ("receptors: {mobility: 3}\nadhesion: {ligand_ratio: 2}", "receptors: {drift_number: 20}", (), 6),
    ],
)
@pytest.mark.fault("n8")
def test_of_mobility_and_drift_number_the_more_specific_wins(told, file, base, overrides, drift_number):
    case, warned = told(file, base, *overrides)
    assert case.drift_number == drift_number and warned == []
    assert case.receptors.mobility == drift_number / case.adhesion.ligand_ratio


@pytest.mark.parametrize(
    "file, base, override, key, value, warned",
    [
        ("time: {end: 0.5}", "", None, "output.frames", (0.008, 0.044, 0.128), None),
        ("", "", "time.end=0.5", "output.frames", (0.008, 0.044, 0.128), None),
        ("time: {end: 0.5}", "output: {frames: [0.1, 0.8]}", None, "output.frames", (0.1,),
         "b.yaml: output.frames: 0.8 is after the end of the run, 0.5, and left out."),
        ("output: {frames: [0.1, 0.8, 0.9]}", "", "time.end=0.5", "output.frames", (0.1,),
         "a.yaml: output.frames: 0.8 and 1 more are after the end of the run, 0.5, and left out."),
        ("time: {step: 0.1}", "", "time.end=0.05", "time.step", 0.05,
         "a.yaml: time.step: 0.1 is longer than the run, end = 0.05, and gives way to it."),
        ("mesh: {far_edge: 0.05}", "", "mesh.front_edge=0.06", "mesh.far_edge", 0.06,
         "a.yaml: mesh.far_edge: 0.05 is below front_edge = 0.06 and gives way to it."),
        ("mesh: {far_edge: 0.01}", "mesh: {front_edge: 0.02}", None, "mesh.front_edge", 0.01,
         "b.yaml: mesh.front_edge: 0.02 is above far_edge = 0.01 and gives way to it."),
    ],
)  # fmt: skip
def test_less_specific_keys_give_way(told, tmp_path, file, base, override, key, value, warned):
    case, sentences = told(file, base, *([override] if override else []))
    section, inner = key.split(".")
    assert getattr(getattr(case, section), inner) == value
    assert sentences == ([f"{tmp_path}/{warned}"] if warned else [])


@pytest.mark.parametrize(
    "file, override, begins",
    [
        ("time: {end: 0.5}\noutput: {frames: [0.8]}", None, "a.yaml: output.frames: 0.8 is after the end"),
        ("time: {end: 0.5}", "output.frames=[0.8]", "--set output.frames: 0.8 is after the end"),
        ("time: {end: 0.5}", "time.step=2", "--set time.step: 2 is longer"),
        ("perturbation: {front: 0.02, at: 0.2}", "time.end=0.1", "a.yaml: perturbation.at: 0.2 is not before"),
        ("perturbation: {front: 0.02}", "model=axisymmetric", "a.yaml: perturbation.front: an axisymmetric body"),
    ],
)
def test_contradictions_that_are_left_name_what_was_written(files, tmp_path, file, override, begins):
    with pytest.raises(CaseError) as refused:
        load_case(files(a=f"name: a\n{file}"), [override] if override else [])
    assert str(refused.value).removeprefix(f"{tmp_path}/").startswith(begins)


def test_overrides_contradict_each_other(files):
    with pytest.raises(CaseError, match="^--set receptors.drift_number: 20 contradicts"):
        load_case(files(a="name: a"), ["receptors.mobility=1", "receptors.drift_number=20"])


def test_sections_are_merged_at_every_level(files):
    path = files(a="name: a\nbase: b.yaml\nmembrane: {prestretch: 1.2}", b="membrane: {thickness: 0.02}")
    case = load_case(path, ["membrane={shear_modulus: 1}"], membrane={"thickness": 0.03})
    assert (case.membrane.shear_modulus, case.membrane.thickness, case.membrane.prestretch) == (1, 0.03, 1.2)


def test_changes_in_python_are_dotted_or_nested(files):
    case = load_case("typical", membrane={"thickness": 0}, **{"time.end": 1.3}, drag=0.1)
    assert (case.name, case.membrane.thickness, case.membrane.shear_modulus) == ("typical", 0, 1.81)
    assert (case.time.end, case.time.step, case.drag) == (1.3, 0.001, 0.1)
    with pytest.raises(CaseError, match="^drga: unknown key, did you mean drag"):
        load_case("typical", drga=1)
    assert load_case("typical", "drag=0.2", drag=0.3).drag == 0.3


@pytest.mark.parametrize("path", [None, 3, [], {}])
def test_what_is_no_path(path):
    with pytest.raises(CaseError, match="is not a path"):
        load_case(path)


# Shipped cases


def test_shipped_cases_go_by_their_names(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert load_case("typical") == load_case(CONFIGS[0].parent / "typical.yaml") == load_case("typical.yaml")
    assert shipped_case("typical").name == "typical.yaml"
    assert shipped_case("none") is shipped_case("../typical") is shipped_case("base/paper") is None
    (tmp_path / "typical.yaml").write_text("name: mine")
    assert load_case("typical.yaml").name == "mine" and load_case("typical").name == "typical"
    with pytest.raises(CaseError, match="^typicl: No such file or directory; did you mean the shipped case typical"):
        load_case("typicl")


# Stored cases


@pytest.mark.parametrize(
    "text",
    [
        "",
        "receptors: {drift_number: 17}\nadhesion: {ligand_ratio: 3}",
        "receptors: {mobility: 2}",
        "receptors: {mobility: 2, drift_number: 16}",
        "time: {end: 0.0005}",
        "model: axisymmetric",
        "model: auto\nmesh: auto",
        "output: {frames: [3.1]}",
        "perturbation: {front: 0.02}\ntime: {end: 0.1}",
        "ligands: {pattern: stripes, width: 2}",
        "mesh: {front_edge: 0.06}",
    ],
)
def test_a_stored_case_holds_what_was_given_and_reads_back(load, text):
    case = load(f"name: a\n{text}")
    again = load(case.to_yaml() + "provenance: {vesdyn: 0.1.0}\n")
    assert again == case and again.given_keys() == case.given_keys() and again.hash == case.hash
    assert again.to_yaml() == case.to_yaml()
    assert pickle.loads(pickle.dumps(again)).given_keys() == case.given_keys()


@pytest.mark.fault("n8")
def test_a_stored_case_can_be_changed(load):
    stored = load("name: a\nadhesion: {ligand_ratio: 4}").to_yaml()
    assert load(stored, "adhesion.ligand_ratio=2").drift_number == 2 * 2.1875
    assert load(stored, "receptors.mobility=1").drift_number == 4
    assert load(stored, "receptors.drift_number=3").drift_number == 3
    assert load(stored, "model=axisymmetric").mesh.front_edge == "auto"
    assert load(stored, "time.end=0.5").output.frames == (0.008, 0.044, 0.128)
    assert load(stored.replace("ligand_ratio: 4", "ligand_ratio: 2")).drift_number == 2 * 2.1875
    short = load("name: a\ntime: {end: 0.5}").to_yaml()
    assert load(short, "time.end=1.2") == Case(name="a")
    assert load(short.replace("end: 0.5", "end: 0.1")).output.frames == (0.008, 0.044)


def test_a_stored_case_keeps_the_defaults_it_was_stored_with(load):
    stored = Case(name="a", drag=0.1).to_yaml().replace("cutoff: 0.1", "cutoff: 0.2")  # by an older version, say
    case = load(stored)
    assert case.adhesion.cutoff == 0.2 and not case.given("adhesion.cutoff")
    assert load(case.to_yaml()) == case
    assert load(stored, "drag=0.2").adhesion.cutoff == 0.1  # a new case


def test_faults_in_stored_defaults_are_named(complaint, tmp_path):
    for defaults, part in (("3", "not a mapping"), ("{drag: -1}", "drag: -1 is out of range"), ("{x: 1}", "x: unknown")):
        assert complaint(f"name: a\ndefaults: {defaults}").startswith(f"{tmp_path}/case.yaml: defaults: {part}")


def test_a_name_that_looks_like_a_number_is_stored_as_text(load):
    for name in ("1e5", "010", "0x10", "1_0", "2024-01-01", "null", "true", "yes", "1.5"):
        assert load(Case(name=name).to_yaml()).name == name


# YAML


@pytest.mark.parametrize("number", ["1:30", "010", "0x10", "9_6", "0o10", "0b1", "1,5", "1e", "١", "1 0"])
@pytest.mark.parametrize("way", ["file", "--set", "sweep"])
@pytest.mark.fault("a09")
def test_numbers_are_those_of_yaml_1_2(files, tmp_path, number, way):
    path = files(a="name: a" + {"file": f"\ndrag: {number}", "--set": "", "sweep": f"\nsweep: {{drag: ['1', {number}]}}"}[way])
    with pytest.raises(CaseError) as refused:
        load_sweep(path, [f"drag={number}"] if way == "--set" else [])
    where = {"file": f"{path}: drag: ", "--set": "--set drag: ", "sweep": f"{path}: sweep: drag: "}[way]
    assert str(refused.value).startswith(where) and "is not a number" in str(refused.value)


@pytest.mark.fault("a09")
def test_padded_seeds_are_refused(complaint):
    assert "perturbation.seed: 010 is not a number; write a whole one" in complaint("name: a\nperturbation: {seed: 010}")


@pytest.mark.parametrize("text, value", [("7", 7), ("+7", 7), ("7.", 7), (".5", 0.5), ("5e-1", 0.5), ("0.50", 0.5)])
def test_numbers_of_yaml_1_2_are_read(load, text, value):
    assert load(f"name: a\ndrag: {text}").drag == value


def test_yes_and_dates_are_text(load, complaint):
    assert "yes is neither true nor false" in complaint("name: a\nreceptors: {frozen: yes}")
    assert load("name: 2001-13-45").name == "2001-13-45"


def test_anchors_are_read_and_bombs_are_not(load, complaint):
    assert load("name: a\ntime: {end: &t 0.5}\noutput: {frames: [*t]}").output.frames == (0.5,)
    bomb = "a0: &a0 [x, x]\n" + "".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 9))
    assert "more than 20,000 values" in complaint(bomb)
    assert "nested more than 50 deep" in complaint("name: &a [*a]")


# Sources, and files that are none


@pytest.mark.fault("n21")
def test_override_and_sweep_into_a_value_name_their_source(files):
    path = files(a="name: a\nsweep: {drag.x: [1]}", b="name: b")
    with pytest.raises(CaseError, match=f"^{path}: sweep: drag.x: drag holds a value and has no keys in it; "):
        load_sweep(path)
    path = files(b="name: b")
    with pytest.raises(CaseError, match="^--set drag.x: drag holds a value and has no keys in it; "):
        load_case(path, ["drag.x=1"])
    with pytest.raises(CaseError, match="^--set membrane.thickness.x: membrane.thickness holds a value"):
        load_case(path, ["membrane.thickness.x=1"])


@pytest.mark.fault("n20")
def test_endless_and_huge_files_are_refused_at_once(tmp_path, files):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for path in (pipe, Path("/dev/zero")):
        with pytest.raises(CaseError, match="is not a regular file; give"):
            load_case(path)
        with pytest.raises(CaseError, match="a.yaml: base: .*is not a regular file"):
            load_case(files(a=f"name: a\nbase: {path}"))
        with pytest.raises(CaseError, match="a.yaml: mesh.file: .*is not a regular file"):
            load_case(files(a=f"name: a\nmesh: {{file: {path}}}"))
    large = tmp_path / "large.yaml"
    large.write_text("#" * 1_000_001)
    with pytest.raises(CaseError, match="large.yaml: has 1,000,001 bytes, and a case at most 1,000,000; "):
        load_case(large)


@pytest.mark.fault("n20")
def test_many_faults_bases_frames_and_cases_make_few_sentences(files, tmp_path, complaint):
    many = complaint("name: a\n" + "".join(f"k{i}: 1\n" for i in range(5_000))).splitlines()
    assert len(many) == 20 and many[-1] == f"{tmp_path}/case.yaml: and 4,981 more faults; correct these first."
    assert "more than 20,000 values" in complaint("name: a\n" + "".join(f"k{i}: 1\n" for i in range(30_000)))
    frames = ", ".join(map(str, range(1, 2000)))
    assert "is too long; give at most 1000 values." in complaint(f"name: a\noutput: {{frames: [{frames}]}}")
    for i in range(30):
        (tmp_path / f"b{i}.yaml").write_text(f"base: b{i + 1}.yaml")
    with pytest.raises(CaseError, match="b20.yaml: base: is more than 20 bases deep"):
        load_case(tmp_path / "b0.yaml", ["name=a"])
    grid = ", ".join(f"{key}: [1, 2, 3, 4, 5, 6, 7, 8, 9, 10]" for key in ("drag", "x", "y", "z", "time.end"))
    with pytest.raises(CaseError, match="sweep: makes 100,000 cases; make at most 10,000 at once"):
        load_sweep(files(a=f"name: a\nsweep: {{{grid}}}"))


def test_what_the_user_wrote_is_cut_and_its_control_characters_shown(complaint):
    message = complaint('name: "a\\e[31m\\a"\n"\\e[2J": 1\ndrag: ' + "x" * 500)
    assert "\x1b" not in message and "\x07" not in message
    assert "\\x1b[31m" in message and "\\x1b[2J: unknown key" in message
    assert all(len(line) < 300 for line in message.splitlines())


@pytest.mark.fault("a04")
def test_the_template_gives_way_to_what_is_set(load):
    case = load(template(), "time.end=0.5")
    assert case.output.frames == (0.008, 0.044, 0.128) and case.warnings() == []
    assert case.given_keys() == {"name": "typical", "time": {"end": 0.5}}


def _written(path, text):
    path.write_text(text)
    return path


def test_a_key_set_twice_is_told(tmp_path):
    path = _written(tmp_path / "a.yaml", "name: a")
    for sets, told in (
        (["drag=1", "drag=2"], "--set drag: 1 gives way to 2, which is given after it."),
        (["time={end: 1}", "time.end=2"], "--set time.end: 1 gives way to 2, which is given after it."),
    ):
        with pytest.warns(UserWarning) as caught:
            load_case(path, sets)
        assert [str(one.message) for one in caught] == [told]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        load_case(path, ["drag=2", "drag=2", "time.end=2", "time.step=0.01"])


@pytest.mark.fault("n21")
@pytest.mark.parametrize("key", ["time.end[0]", "drag\x00", "k" * 80, "time." + "k" * 80])
def test_the_source_of_an_odd_key_is_named(tmp_path, key):
    with pytest.raises(CaseError, match="^--set [^/]*: unknown key"):
        load_case(_written(tmp_path / "a.yaml", "name: a"), [f"{key}=1"])


def test_a_swept_mesh_file_is_taken_from_the_folder_of_its_sweep(tmp_path, monkeypatch):
    (tmp_path / "cell.ply").write_text("no mesh yet")
    path = _written(tmp_path / "a.yaml", "name: a\nsweep: {mesh.file: [cell.ply]}")
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    (case,) = load_sweep(path)
    assert case.mesh.file == str(tmp_path / "cell.ply")


def test_a_stored_mesh_file_can_be_given_up(tmp_path):
    (tmp_path / "cell.ply").write_text("no mesh yet")
    stored = load_case(_written(tmp_path / "a.yaml", "name: a\nmesh: {file: cell.ply}")).to_yaml()
    assert load_case(_written(tmp_path / "b.yaml", stored), ["mesh.file=null"]).mesh.file is None


def test_a_second_document_is_told_in_whole_words(tmp_path):
    with pytest.raises(CaseError, match="line 2: expected a single document in the stream, but found another"):
        load_case(_written(tmp_path / "a.yaml", "name: a\n---\nname: b"))


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("name: a\nmembrane: !mine {thickness: 0.01}\n", "the tag !mine is not needed here"),
        ("name: a\noutput: {frames: !!set [0.1]}\n", "the tag !!set is not needed here"),
        (f"name: a\nx: &x {[1] * 150}\ny: [{', '.join(150 * ['*x'])}]\n", "there are more than 20,000 values"),
    ],
    ids=["tagged mapping", "tagged list", "values by aliases"],
)
def test_tags_and_very_many_values_are_refused(tmp_path, text, sentence):
    (tmp_path / "a.yaml").write_text(text)
    with pytest.raises(CaseError, match=sentence):
        load_case(tmp_path / "a.yaml")
