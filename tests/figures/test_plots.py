"""Every script of plots/ on a tiny setting, so that what is shown cannot rot."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "plots"))

import accuracy
import bodies
import calibration
import claims
import cutoff
import figure2
import figure3
import figure4
import figure5
import figure6
import figure7
import figure8
import figure9
import order
import paper
import speed
import staircase
import study
import thickness
import wrinkling

from vesdyn import run

COARSE = {"model": "axisymmetric", "mesh.front_edge": 0.05, "mesh.far_edge": 0.1}
COARSE_SURFACE = {"model": "surface", "mesh.front_edge": 0.06, "mesh.far_edge": 0.12}
BRIEF = {"time.end": 0.03, "time.step": 0.002, "output.frames": [0.02]}


@pytest.fixture(autouse=True)
def runs(tmp_path, monkeypatch):
    monkeypatch.setattr(study, "RUNS", tmp_path / "runs")
    return tmp_path / "runs"


@pytest.fixture
def brief(monkeypatch):
    """Let each run be coarse and short and leave no summary."""
    mesh = {"mesh.front_edge": 0.05, "mesh.far_edge": 0.1, "solver.tolerance": 1e-3}
    monkeypatch.setattr(study, "EVERY_RUN", mesh | {"time.end": 0.03, "time.step": 0.002, "output.frames": [0.016, 0.024]})
    monkeypatch.setattr(study, "JOBS", 1)
    monkeypatch.setattr(run, "_draw", lambda directory: None)


def drawn(directory):
    return sorted(file.name for file in directory.iterdir() if file.stat().st_size > 5_000)


def test_accuracy(tmp_path):
    body = {"one body": (({**COARSE, **BRIEF}, {**COARSE_SURFACE, **BRIEF}), "k", "o", "-")}
    finest = {**COARSE, **BRIEF, "mesh.front_edge": 0.03}
    accuracy.main(tmp_path / "out", ("typical",), body, finest, check=None)
    assert drawn(tmp_path / "out") == ["accuracy.pdf", "accuracy.png"]


def test_order(tmp_path, monkeypatch):
    for name, value in {"EARLY": 0.008, "LATE": 0.02, "TAKEN_UP_END": 0.02}.items():
        monkeypatch.setattr(order, name, value)
    brief = {"time.step": 0.002, "time.end": 0.02}
    order.main(
        tmp_path / "out", (0.004, 0.002), COARSE, {"time.step": 0.001}, COARSE,
        {"axisymmetric": (0.07, 0.05), "surface": (0.08, 0.06)}, brief,
        COARSE | {"mesh.front_edge": 0.04},
    )  # fmt: skip
    assert drawn(tmp_path / "out") == ["order.pdf", "order.png"]


def test_staircase(tmp_path):
    staircase.main(tmp_path / "out", {"axisymmetric": (0.05, 0.04), "surface": (0.07, 0.05)}, end=0.03)
    assert drawn(tmp_path / "out") == ["staircase.pdf", "staircase.png"]


def test_speed(tmp_path):
    speed.main(tmp_path / "out", vertices=(500, 800), iterations=20, repeats=3, end=0.004, looks={0.0: ("k", "o"), 0.01: ("r", "s")})
    assert drawn(tmp_path / "out") == ["speed.pdf", "speed.png"]


def test_bodies(tmp_path, brief, monkeypatch):
    monkeypatch.setattr(study, "EVERY_RUN", {"output.frames": []})
    bodies.main(tmp_path / "out", end=0.012, wishes={"axisymmetric": 0.2, "surface": 0.2})
    assert drawn(tmp_path / "out") == ["bodies.pdf", "bodies.png"]


@pytest.mark.parametrize("figure", (figure2, figure3, figure4, figure5, figure6, figure7, figure8))
def test_figures_of_curves(figure, tmp_path, brief):
    figure.draw(tmp_path / "out")
    assert drawn(tmp_path / "out") == [f"{figure.__name__}.pdf", f"{figure.__name__}.png"]


def test_figure_9(tmp_path, brief, monkeypatch):
    monkeypatch.setitem(study.EVERY_RUN, "perturbation.at", 0.012)
    figure9.draw(tmp_path / "out")
    assert drawn(tmp_path / "out") == ["figure9.pdf", "figure9.png"]


def test_calibration_finds_the_drag_and_mobility_of_a_run(tmp_path, brief, monkeypatch):
    hidden = 0.073, 2.25
    front, density = calibration.printed(hidden, calibration.ACCURACY)
    monkeypatch.setattr(calibration, "READ", (("front", front, 0.003), ("density", density, 0.2)))
    assert calibration.measure(calibration.ACCURACY)[1] == pytest.approx(hidden, rel=0.01)
    calibration.draw(tmp_path / "out")
    assert drawn(tmp_path / "out") == ["calibration.pdf", "calibration.png"]


def test_thickness(tmp_path, brief, monkeypatch):
    monkeypatch.setattr(thickness, "LOOKS", {0.0: ("k", "-"), 0.05: ("r", "--")})
    monkeypatch.setattr(thickness, "SHOWN", 0.016)
    monkeypatch.setattr(thickness, "ITERATIONS", 1)
    monkeypatch.setattr(calibration, "READ", (("front", 0.28, 0.003), ("density", 2.3, 0.2)))
    thickness.draw(tmp_path / "out")
    assert drawn(tmp_path / "out") == ["thickness.pdf", "thickness.png"]


def test_wrinkling(tmp_path):
    in_space = {"mode": 5, "thickness": 0.02, "edge": 0.1, "start": 0.01, "end": 0.03, "size": 1e-3}
    looks = {0.0: ("r", "o"), 0.02: ("k", "s")}
    wrinkling.main(tmp_path / "out", edges=(0.1, 0.08), curves=looks, thicknesses=(0.015, 0.02), in_space=in_space)
    assert drawn(tmp_path / "out") == ["wrinkling.pdf", "wrinkling.png"]


def test_cutoff(tmp_path, brief, monkeypatch):
    monkeypatch.setattr(cutoff, "EDGES", (0.08, 0.1))
    monkeypatch.setattr(cutoff, "RANGES", (0.08, 0.1))
    monkeypatch.setattr(cutoff, "COARSE", {})
    cutoff.draw(tmp_path / "out")
    assert drawn(tmp_path / "out") == ["cutoff.pdf", "cutoff.png"]


def test_claims(tmp_path, brief, monkeypatch):
    monkeypatch.setitem(study.EVERY_RUN, "perturbation.at", 0.012)
    monkeypatch.setattr(claims, "UNSTATED", ({"drag": 0.1},))
    monkeypatch.setattr(claims, "STABILITY", claims.STABILITY[-2:])
    claims.draw(tmp_path)
    rows = [line.split(" | ") for line in (tmp_path / "claims.md").read_text().splitlines() if line.startswith("| F")]
    assert len(rows) == len(claims.CLAIMS) + 2
    assert all(row[3].startswith(("holds", "not reproduced")) for row in rows)


def test_verdict():
    assert claims.Found("", {"a": True, "b": True}).verdict == "holds"
    assert claims.Found("", {"a": True, "b": False}).verdict == "holds in part"
    assert claims.Found("", {"a": False}).verdict == "not reproduced"


def test_error_and_slope_of_a_curve(monkeypatch):
    t = np.geomspace(1e-4, 1.0, 500)
    exact, off = ({"time": t, "binding_area": factor * t**0.5} for factor in (1.0, 1.0 + 0.75 * 0.01))
    monkeypatch.setattr(study, "history", lambda _, changes: exact if "accuracy" in changes else off)
    curve = paper.Curve("typical-auto", {})
    assert curve.error() == pytest.approx(0.01, rel=1e-9)
    assert curve.slope(0.1) == pytest.approx(0.5, abs=1e-6)
    assert curve.time_of(0.5) == pytest.approx(0.25, rel=1e-3)


def test_order_of_curves_counts_from_where_it_stays(monkeypatch):
    t = np.geomspace(1e-3, 1.0, 400)
    rows = {"typical": {"time": t, "binding_area": t**0.5}, "typical-auto": {"time": t, "binding_area": 0.5 * t**0.25}}
    monkeypatch.setattr(study, "history", lambda name, _: rows[name])
    lower, upper = (paper.Curve(name, {}) for name in ("typical-auto", "typical"))
    assert paper.holds_from(lower, upper) == pytest.approx(0.5**4, rel=0.03)
    assert paper.holds_from(upper, lower) == np.inf


def test_front_shape_of_a_circular_turn():
    turn = np.linspace(0.0, 1.2, 400)
    circle = 0.3 + 0.05 * np.sin(turn), 0.05 * (1.0 - np.cos(turn))
    rise = np.linspace(0.0, 0.3, 50)[1:]
    r = np.concatenate([np.linspace(0.0, 0.3, 50)[:-1], circle[0], circle[0][-1] + rise * np.cos(1.2)])
    z = np.concatenate([np.zeros(49), circle[1], circle[1][-1] + rise * np.sin(1.2)])
    radius, angle, *_ = figure8.front_shape(np.column_stack([r, z]), cutoff=0.1)
    assert radius == pytest.approx(0.05, rel=1e-3)
    assert angle == pytest.approx(1.2, rel=1e-3)


def test_finished_runs_are_used_again(runs):
    changes = {**COARSE, **BRIEF}
    first = study.history("typical", changes)
    stamps = {file: file.stat().st_mtime_ns for file in runs.rglob("*.csv")}
    assert len(stamps) == 1
    again = study.history("typical", changes)
    assert {file: file.stat().st_mtime_ns for file in runs.rglob("*.csv")} == stamps
    assert all(np.array_equal(first[key], again[key]) for key in first)


def test_error_of_a_shifted_history_is_its_shift():
    t = np.linspace(0.0001, 0.3, 400)
    exact = {"time": t, "binding_area": np.sqrt(t)}
    shifted = {"time": t[::3], "binding_area": 1.01 * np.sqrt(t[::3])}
    assert study.area_error(shifted, exact) == pytest.approx(0.01, rel=1e-9)


def test_order_of_a_power_is_found():
    lengths = np.array([0.1, 0.05, 0.02])
    assert study.fitted_order(lengths, -3.0 * lengths**1.5) == pytest.approx(1.5, rel=1e-12)
