"""Every script of plots/ on a tiny setting, so that what is shown cannot rot."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "plots"))

import accuracy
import order
import speed
import staircase
import study

COARSE = {"model": "axisymmetric", "mesh.front_edge": 0.05, "mesh.far_edge": 0.1}
COARSE_SURFACE = {"model": "surface", "mesh.front_edge": 0.06, "mesh.far_edge": 0.12}
BRIEF = {"time.end": 0.03, "time.step": 0.002, "output.frames": [0.02]}


@pytest.fixture(autouse=True)
def runs(tmp_path, monkeypatch):
    monkeypatch.setattr(study, "RUNS", tmp_path / "runs")
    return tmp_path / "runs"


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
    speed.main(tmp_path / "out", vertices=(500, 800), iterations=20, repeats=3, end=0.004)
    assert drawn(tmp_path / "out") == ["speed.pdf", "speed.png"]


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
