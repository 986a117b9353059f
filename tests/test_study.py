"""Runs by name and change, kept and used again; curves with errors; fronts of stored shapes."""

from pathlib import Path

import numpy as np
import pytest

from vesdyn import run
from vesdyn import study as study_module
from vesdyn.errors import RunError
from vesdyn.study import (
    FAMILIES,
    Curve,
    Study,
    area_error,
    at_one_product,
    contour_radius,
    fitted_order,
    front_shapes,
    goes_one_way,
    holds_from,
    with_drift_number_held,
)

CONFIGS = Path(__file__).parents[1] / "configs"
COARSE = {"model": "axisymmetric", "mesh.front_edge": 0.05, "mesh.far_edge": 0.1, "solver.tolerance": 1e-3}
BRIEF = {"time.end": 0.03, "time.step": 0.002, "output.frames": [0.02]}


@pytest.fixture(autouse=True)
def no_summaries(monkeypatch):
    monkeypatch.setattr(run, "_draw", lambda directory: None)


@pytest.fixture
def study(tmp_path):
    return Study(tmp_path / "runs", CONFIGS, jobs=1)


def curve(history, finer=None, errors_of=None):
    return Curve("made up", {}, None, history, finer or history, errors_of)


def power(factor, exponent, t=np.geomspace(1e-4, 1.0, 500)):
    return {"time": t, "binding_area": factor * t**exponent}


# Runs


def test_finished_runs_are_used_again(study):
    changes = {**COARSE, **BRIEF}
    first = study.history("typical", changes)
    stamps = {file: file.stat().st_mtime_ns for file in study.directory.rglob("history.csv")}
    assert len(stamps) == 1
    again = study.history("typical", changes)
    assert {file: file.stat().st_mtime_ns for file in study.directory.rglob("history.csv")} == stamps
    assert all(np.array_equal(first[key], again[key]) for key in first)


def test_an_edited_case_is_another_run(tmp_path):
    file = tmp_path / "case.yaml"
    study = Study(tmp_path / "runs", tmp_path)
    file.write_text("name: case\ndrag: 0.07")
    before = study.path("case", {"time.end": 0.5})
    file.write_text("name: case\ndrag: 0.08")
    assert study.path("case", {"time.end": 0.5}) != before
    file.write_text("name: case\ndrag: 0.07  # again")
    assert study.path("case", {"time.end": 0.5}) == before


def test_changes_to_every_run_are_another_run(study):
    other = Study(study.directory, CONFIGS, every={"drag": 0.1})
    assert other.case("typical").drag == 0.1
    assert other.path("typical") != study.path("typical")
    assert other.file("numbers", {}, "txt") != study.file("numbers", {}, "txt")


def test_a_shorter_run_keeps_the_frames_it_reaches(study):
    assert study.case("typical", {"time.end": 0.1}).output.frames == (0.008, 0.044)


def test_runs_are_prepared_side_by_side(study):
    side_by_side = Study(study.directory, CONFIGS, jobs=2, every={**COARSE, **BRIEF})
    wanted = [("typical", {"drag": drag}) for drag in (0.07, 0.1)]
    side_by_side.prepare(wanted)
    assert all((side_by_side.path(*run) / "history.csv").exists() for run in wanted)


def test_a_run_that_is_damaged_is_computed_anew_and_one_of_other_sources_told(study, tmp_path, monkeypatch):
    study = Study(tmp_path / "runs", CONFIGS, every={**COARSE, **BRIEF})
    history = study.history("typical")
    file = study.path("typical") / "history.csv"
    content = file.read_bytes()
    file.write_bytes(content.replace(b"1", b"2"))
    study_module._WHOLE.clear()  # as in a new process
    with pytest.warns(UserWarning, match="history.csv is damaged"):
        again = study.history("typical")
    assert file.read_bytes() == content and all(np.array_equal(again[name], history[name]) for name in history)
    study_module._WHOLE.clear()
    monkeypatch.setattr(study_module, "sources_hash", lambda: "0" * 64)
    with pytest.warns(UserWarning, match="was computed by other sources; remove it"):
        study.history("typical")


def test_a_run_that_fails_is_told(study):
    with pytest.raises(RunError, match="typical.*failed"):
        study.history("typical", {**COARSE, **BRIEF, "solver.method": "relaxation", "solver.max_iterations": 1})


def test_resolution_and_time_of_a_run(study):
    changes = {**COARSE, **BRIEF}
    edge, nodes = study.resolution("typical", changes)
    assert edge == 0.05 and nodes == len(study.frames("typical", changes)[-1]["density"])
    taken = study.cpu_time("typical", changes)
    assert taken > 0.0
    assert study.cpu_time("typical", changes) == taken  # kept


# Histories


def test_error_of_a_shifted_history_is_its_shift():
    exact = power(1.0, 0.5, np.linspace(0.0001, 0.3, 400))
    shifted = power(1.01, 0.5, exact["time"][::3])
    assert area_error(shifted, exact) == pytest.approx(0.01, rel=1e-9)


def test_order_of_a_power_is_found_with_its_error():
    lengths = np.array([0.1, 0.05, 0.02, 0.01])
    order, error = fitted_order(lengths, -3.0 * lengths**1.5)
    assert order == pytest.approx(1.5, rel=1e-12)
    assert error == pytest.approx(0.0, abs=1e-12)
    scattered, error = fitted_order(lengths, 3.0 * lengths**1.5 * [1.1, 0.9, 1.1, 0.9])
    assert 0.02 < error < 0.3 and abs(scattered - 1.5) < 2 * error
    assert np.isnan(fitted_order(lengths[:2], lengths[:2])[1])


# Curves


def test_error_and_exponent_of_a_curve():
    off, exact = power(1.0 + 0.75 * 0.01, 0.5), power(1.0, 0.5)
    found = curve(off, exact)
    assert found.error() == pytest.approx(0.01, rel=1e-9)
    assert found.exponent(0.1) == pytest.approx(0.5, abs=1e-6)
    assert found.exponent_error(0.1) == pytest.approx(0.0, abs=1e-6)  # a constant factor is no error of it
    assert curve(power(1.0, 0.52), exact).exponent_error(0.1) == pytest.approx(0.02, abs=1e-6)
    assert found.time_of(0.5) == pytest.approx(0.25, rel=1e-3)


def test_a_varied_curve_has_the_errors_of_its_original():
    original = curve(power(1.01, 0.5), power(1.0, 0.5))
    varied = curve(power(2.0, 0.4), errors_of=original)
    assert varied.error() == original.error() > 0.0
    assert varied.final == 2.0


def test_order_of_curves_counts_from_where_it_stays():
    t = np.geomspace(1e-3, 1.0, 400)
    lower, upper = curve(power(0.5, 0.25, t)), curve(power(1.0, 0.5, t))
    assert holds_from(lower, upper) == pytest.approx(0.5**4, rel=0.03)
    assert holds_from(upper, lower) == np.inf


def test_what_goes_one_way_may_waver_by_its_error():
    t = np.linspace(0.0, 1.0, 50)
    wavering = t + 0.05 * np.sin(40 * t)
    assert goes_one_way(t, wavering, 0.11, +1) and not goes_one_way(t, wavering, 0.01, +1)
    assert not goes_one_way(t, wavering, 0.11, -1)


# Families of the paper


def test_cases_of_each_family_differ_in_its_key(study):
    for cases, key in FAMILIES.values():
        section, name = key.split(".")
        values = [getattr(getattr(study.case(case), section), name) for case in cases]
        assert values == sorted(set(values))


def test_what_is_held_in_figures_6_and_7(tmp_path):
    study = Study(tmp_path / "runs", CONFIGS, jobs=1, every={**COARSE, **BRIEF})
    laws = [found.case.adhesion for found in at_one_product(study)]
    assert [law.traction * law.cutoff for law in laws] == pytest.approx([0.151] * 3, rel=1e-5)
    assert len({law.cutoff for law in laws}) == 3
    assert {found.case.drift_number for found in with_drift_number_held(study)} == {104.0}


# Fronts


def test_contour_of_a_stored_sphere_is_a_circle(study):
    changes = {"model": "surface", "mesh.front_edge": 0.05, "mesh.far_edge": 0.1, "mesh.layout": "rings",
               "time.end": 0.004, "time.step": 0.002, "output.frames": []}  # fmt: skip
    start = study.frames("typical", changes)[0]
    radius = contour_radius(start, 0.1)
    assert radius.shape == (360,)
    assert radius == pytest.approx((0.5**2 - 0.4**2) ** 0.5, rel=0.02)  # a chord of the sphere of radius 1/2


def test_front_shapes_are_read_at_the_asked_times(study):
    found = front_shapes(study, "typical", (0.01, 0.02), changes={**COARSE, "time.end": 0.02, "time.step": 0.002})
    assert list(found.times) == [0.01, 0.02]
    assert found.shapes.shape == found.errors.shape == (2, 4)
    assert np.all((found.shapes[:, 1] > 0.2) & (found.shapes[:, 1] < np.pi / 2))
