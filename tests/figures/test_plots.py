"""Every script of plots/ on a tiny setting, so that what is shown cannot rot; and what a script may contain."""

import ast
import importlib
import re
from pathlib import Path

import numpy as np
import pytest

from vesdyn import run
from quadrature import use_a_grid
from vesdyn.case_file import load_case
from vesdyn.calibration import Reading, calibrated, computed, jacobian
from vesdyn.study import Study

ROOT = Path(__file__).parents[2]
SCRIPTS = sorted(file.stem for file in (ROOT / "plots").glob("*.py") if file.stem != "looks")

MESH = {"mesh.front_edge": 0.05, "mesh.far_edge": 0.1}
COARSE = {"model": "axisymmetric", **MESH}
COARSE_SURFACE = {"model": "surface", "mesh.front_edge": 0.06, "mesh.far_edge": 0.12}
BRIEF = {"time.end": 0.03, "time.step": 0.002, "output.frames": [0.016, 0.024]}
COARSE_AND_BRIEF = {**MESH, **BRIEF, "solver.tolerance": 1e-3}
MOVED = {**COARSE_AND_BRIEF, "perturbation.at": 0.012}  # the front is displaced within the brief run

TINY_READINGS = Reading("front", 0.28, 0.003), Reading("density", 2.3, 0.2)  # about those of brief runs
OF_THEIR_OWN = {"calibration", "claims"}  # scripts with a test of their own, below

TINY = {  # script: changes made to each run, arguments of measure()
    "accuracy": ({}, {
        "scenes": ("typical",), "check": None, "finest": {**COARSE, **BRIEF, "mesh.front_edge": 0.03},
        "families": {"surface, wish 4 %, 2 %": (({**COARSE, **BRIEF}, {**COARSE_SURFACE, **BRIEF}), "k", "o", "-")},
    }),
    "bodies": ({}, {"end": 0.012, "wishes": {"axisymmetric": 0.2, "surface": 0.2}}),
    "cutoff": (COARSE_AND_BRIEF, {"edges": (0.08, 0.1), "ranges": (0.08, 0.1), "coarse": {}}),
    **{f"figure{number}": (COARSE_AND_BRIEF, {}) for number in range(2, 8)},
    "drag": (COARSE_AND_BRIEF, {"drags": (0.03, 0.07), "mobilities": (2.0, 4.0), "end": 0.03}),
    "figure8": ({**COARSE_AND_BRIEF, "output.frames": [0.008, 0.024]}, {}),
    "figure9": (MOVED, {}),
    "other_laws": (COARSE_AND_BRIEF, {"on_surface": COARSE_SURFACE, "shown": 0.016}),
    "order": ({}, {
        "steps": (0.004, 0.002), "mesh": COARSE, "smallest": {"time.step": 0.001}, "taken_up_mesh": COARSE,
        "edges": {"axisymmetric": (0.07, 0.05), "surface": (0.08, 0.06)},
        "mesh_step": {"time.step": 0.002, "time.end": 0.02}, "finest": {**COARSE, "mesh.front_edge": 0.04},
        "times": (0.008, 0.02, 0.02),
    }),
    "real": (COARSE_AND_BRIEF, {"scenes": {"typical": ("typical case", 3.1, 1000.0)}}),
    "speed": ({}, {"vertices": (500, 800), "iterations": 20, "repeats": 3, "end": 0.004, "thicknesses": (0.0, 0.01)}),
    "staircase": ({}, {"edges": {"axisymmetric": (0.05, 0.04), "surface": (0.07, 0.05)}, "end": 0.03}),
    "thickness": (COARSE_AND_BRIEF, {
        "thicknesses": (0.0, 0.05), "shown": 0.016, "readings": TINY_READINGS, "iterations": 1,
    }),
    "wrinkling": ({}, {
        "edges": (0.1, 0.08), "thicknesses": (0.0, 0.01), "scaled": (0.015, 0.02),
        "in_space": {"mode": 5, "thickness": 0.02, "edge": 0.1, "start": 0.01, "end": 0.03, "size": 1e-3},
    }),
}  # fmt: skip


PAGES = {"drag": ("drag.md",), "real": ("real.md",)}  # what a script writes beside its picture


@pytest.fixture(autouse=True)
def scripts_are_found(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "plots"))
    monkeypatch.setattr(run, "_draw", lambda directory: None)  # no summary of each run


@pytest.fixture
def study_of(tmp_path):
    """Return a function that makes a study whose runs all have the changes ``every``."""
    return lambda every: Study(tmp_path / "runs", ROOT / "configs", jobs=1, every=every)


def written(directory):
    return sorted(file.name for file in directory.iterdir() if file.stat().st_size > 1_000)


def imports(source):
    """Names of the top-level modules that a text imports."""
    names = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names.add(node.module.split(".")[0])
    return names


def test_every_script_is_tried():
    assert sorted({*TINY, *OF_THEIR_OWN}) == SCRIPTS


@pytest.mark.parametrize("name", SCRIPTS)
def test_script_imports_no_other_and_marches_by_no_loop_of_its_own(name):
    source = (ROOT / "plots" / f"{name}.py").read_text()
    assert not imports(source) & set(SCRIPTS)
    assert not [node.lineno for node in ast.walk(ast.parse(source)) if isinstance(node, ast.While)]
    assert ast.get_docstring(ast.parse(source))


@pytest.mark.parametrize("name", [name for name in SCRIPTS if name not in OF_THEIR_OWN])
def test_script_measures_and_draws(name, study_of, tmp_path):
    script, (every, arguments) = importlib.import_module(name), TINY[name]
    script.draw(script.measure(study_of(every), **arguments), tmp_path / "out")
    assert written(tmp_path / "out") == [*PAGES.get(name, ()), f"{name}.pdf", f"{name}.png"]


TINY_INFERENCE = """
name: tiny
unknowns: {drag: {low: 0.03, high: 0.2}, receptors.mobility: {low: 1, high: 8}}
cases: {one: {file: one.yaml}}
data:
  - {claim: front, value: "at(one, 0.02, contact_radius)", printed: 0.27, error: 0.003}
  - {claim: large, value: final(one), above: [0.1, 0.2]}
design: {points: 10, refined: 0, checks: 0, accuracy: 20%}
"""


@pytest.fixture
def tiny_inference(tmp_path, monkeypatch):
    """Return the file of an inference on brief runs, whose posteriors are found on a grid."""
    use_a_grid(monkeypatch)
    (tmp_path / "one.yaml").write_text("name: one\nmodel: axisymmetric\nmesh: auto\ntime: {end: 0.03, step: auto}\n")
    (tmp_path / "tiny.yaml").write_text(TINY_INFERENCE)
    return tmp_path / "tiny.yaml"


@pytest.mark.verify
def test_calibration_tells_and_draws_an_inference(study_of, tmp_path, tiny_inference):
    import calibration

    held = {"receptors.mobility": 2.0}
    own = tmp_path / "own.yaml"
    own.write_text(TINY_INFERENCE.replace("name: tiny", "name: own").replace('  - {claim: large, value: final(one), above: [0.1, 0.2]}\n', ""))
    finished = calibration.measure(study_of({}), tiny_inference, tmp_path / "runs", held, n_direct=4, own=own, n_trials=2)
    calibration.draw(finished, tmp_path / "out")
    draws = (tmp_path / "out" / "inference-draws.csv").read_text().splitlines()
    assert draws[0] == "drag,receptors.mobility" and len(draws) == 1 + calibration.N_DRAWS
    assert written(tmp_path / "out") == ["inference-corner.png", "inference-predictive.png", "inference.md"]
    report = (tmp_path / "out" / "inference.md").read_text()
    assert all(f"## {title}" in report for title in ("Unknowns", "With unknowns held", "Without the emulator", "Time"))
    assert "of 2 |" in report.partition("## Are unknowns recovered?")[2]


@pytest.mark.verify
def test_claims_have_a_row_each(study_of, tmp_path, monkeypatch, tiny_inference):
    import claims

    monkeypatch.setattr(claims, "STABILITY", claims.STABILITY[-2:])
    sets = {"one": {}, "two": {"drag": 0.1}}
    claims.draw(claims.measure(study_of(MOVED), tiny_inference, tmp_path / "runs", sets), tmp_path)
    text = (tmp_path / "claims.md").read_text()
    rows = [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("| ")]
    by_name = {}
    for row in rows:
        by_name.setdefault(row[0], []).append(row)
    assert "calibrated (sets" in by_name["front"][0][3] and "predicted" not in by_name["front"][0][3]
    assert by_name["large"][0][3] in ("predicted", "open", "refuted")
    assert [len(by_name[name]) for name in ("F8", "F9, front", "S")] == [2, 2, 1]
    assert all(row[3].endswith("of 2") for name in ("F8", "F9, front", "S") for row in by_name[name])


def rows_below(page, title):
    """Rows of the first table below a title of a page of docs/, as lists of cells."""
    lines = (ROOT / "docs" / page).read_text().partition(f"## {title}\n")[2].strip().splitlines()
    start = next(k for k, line in enumerate(lines) if line.startswith("| "))
    end = next((k for k in range(start, len(lines)) if not lines[k].startswith("| ")), len(lines))
    return [line.strip("| ").split(" | ") for line in lines[start + 2 : end]]


def test_no_calibrated_number_of_the_docs_is_called_a_prediction():
    """docs/claims.md as stored: a claim that has set a parameter is calibrated, whatever its probability; none "holds"."""
    rows = rows_below("claims.md", "By inference")
    assert len(rows) > 15
    for row in rows:
        assert row[3].startswith("calibrated (sets") == ("sets" in row[3])
        assert row[3].split(" ")[0] in ("calibrated", "predicted", "open", "refuted")
    calibrated = {row[0] for row in rows if row[3].startswith("calibrated")}
    assert "F9 front at 0.140" in calibrated  # the drag of every version was taken from it
    assert not re.search(r"\bholds\b", (ROOT / "docs" / "claims.md").read_text())
    nothing = {row[0] for row in rows_below("claims.md", "What counts for nothing")}
    assert nothing == {"F6 at one product T_max d_c", "F9, base state: r = 0.416 at t = 0.140"}
    assert not nothing & {row[0] for row in rows}


def test_shipped_parameters_are_those_inferred_and_the_other_reading_those_of_the_extremes():
    """Drag and mobility of configs/base/ lie in the intervals of docs/inference.md at the shipped thickness and prestretch."""
    rows = {row[0]: row[1:] for row in rows_below("inference.md", "With unknowns held")}
    shipped = load_case(ROOT / "configs" / "typical.yaml")
    assert (shipped.membrane.thickness, shipped.membrane.prestretch) == (0.01, 1.0)
    for name, base, column in (("all data", {}, 0), ("extremes", {"drag": 0.07, "receptors.mobility": 2.1875}, 1)):
        case = shipped.changed(**base)
        for key, value in (("drag", case.drag), ("receptors.mobility", case.receptors.mobility)):
            low, high = (float(x) for x in re.search(r"\((\S+) to (\S+)\)", rows[key][column]).groups())
            assert low < value < high, (name, key)


# What scripts measure ------------------------------------------------------------------------------------


def test_figure_3_tells_area_and_exponent_with_errors(study_of):
    import figure3

    longer = {"output.frames": [0.008], "time.end": 0.4, "time.step": 0.004, "mesh.front_edge": 0.02}
    measured = figure3.measure(study_of({**COARSE_AND_BRIEF, **longer}))
    (t, area, error), *_ = measured["areas"]
    curve = measured["curve"]
    assert t == 0.008
    assert area == pytest.approx(curve.history["binding_area"][curve.history["time"] == t][0], rel=1e-12)
    assert error == pytest.approx(area * curve.error(), rel=1e-12)
    assert [row[0] for row in measured["areas"]] == [0.008, 0.044, 0.128]  # the run ends before 0.56
    assert all(0 < exponent < 1 for _, exponent, _ in measured["exponents"])


def test_figure_8_reads_the_front_at_the_times_it_says(study_of):
    import figure8

    measured = figure8.measure(study_of({**COARSE_AND_BRIEF, "output.frames": [0.008, 0.024]}))
    found = measured["typical-auto"]
    assert list(found.times) == [0.008, 0.024]
    assert set(figure8.SNAPSHOTS) <= set(figure8.TIMES)
    assert found.shapes[1, 1] > 0.3 and np.all(found.shapes[:, 0] > 0.0)


def test_figure_9_of_the_control_beside_itself_shows_nothing(study_of):
    from figure9 import modulations

    circle = np.full(360, 0.4)
    assert modulations({"contact": {0.144: (circle, circle)}}) == [("contact", 0.144, 0.0, 0.0, 0.0)]


def test_calibration_finds_the_drag_and_mobility_of_a_run(study_of):
    study, hidden, accuracy = study_of(COARSE_AND_BRIEF), (0.073, 2.25), 0.01
    front, density = computed(study, hidden, accuracy)
    readings = Reading("front", front, 0.003), Reading("density", density, 0.2)
    found = calibrated(study, readings, jacobian(study, accuracy), accuracy)
    assert found == pytest.approx(hidden, rel=0.01)

