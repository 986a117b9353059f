"""Runs side by side: what is measured of each, the keys in which they differ, the files that a batch leaves."""

import csv
import shutil

import numpy as np
import pytest

from vesdyn import comparison
from vesdyn.batch import run_batch
from vesdyn.case_file import load_sweep
from vesdyn.cli import main
from vesdyn.run import run_case

TEXT = """name: a
model: axisymmetric
units: {diameter: 10 um, diffusivity: 0.01 um^2/s}
adhesion: {cutoff: 0.2}
mesh: {front_edge: 0.05, far_edge: 0.1}
time: {end: 0.02, step: 0.002}
output: {frames: []}
sweep: {membrane.shear_modulus: [0.5, 2.0]}
"""


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """A directory in which a batch of two has run, and the cases."""
    out = tmp_path_factory.mktemp("batch")
    (out / "a.yaml").write_text(TEXT)
    cases = load_sweep(out / "a.yaml")
    assert [outcome.state for _, outcome in run_batch(cases, out / "runs", jobs=1, show=False)] == 2 * ["finished"]
    return out / "runs", cases


def test_a_batch_leaves_its_results(done):
    out, cases = done
    with open(out / comparison.RESULTS, newline="") as file:
        soft, stiff = csv.DictReader(file)
    assert [row["membrane.shear_modulus"] for row in (soft, stiff)] == ["0.5", "2.0"]
    assert list(soft) == ["name", "state", "membrane.shear_modulus", *comparison.MEASURES]
    history = comparison.open_runs([out / cases[0].name])[0].history
    assert float(soft["binding_area"]) == history["binding_area"][-1] > float(stiff["binding_area"]) > 0.0
    assert 0.0 < float(soft["t50"]) < float(soft["t95"]) < float(soft["time"]) == 0.02
    assert np.interp(float(soft["t95"]), history["time"], history["binding_area"]) == pytest.approx(0.95 * history["binding_area"][-1])
    assert (out / comparison.PICTURE).stat().st_size > 5_000


def test_compare_at_the_command_line(done, tmp_path, capsys):
    out, cases = done
    paths = [str(out / case.name) for case in cases]
    assert main(["compare", *paths, "--plot", str(tmp_path / "b.png")]) == 0
    words = capsys.readouterr().out.splitlines()
    assert len(words) == 3 and "membrane.shear_modulus" in words[0] and "binding_area [a0^2]" in words[0] and " um^2" in words[1]
    assert (tmp_path / "b.png").read_bytes()[:4] == b"\x89PNG"
    assert main(["compare", *paths, "--csv"]) == 0
    assert capsys.readouterr().out == (out / comparison.RESULTS).read_text()
    assert main(["compare", paths[0], str(tmp_path)]) == 2
    assert "holds no run" in capsys.readouterr().err


def test_each_run_is_told_in_its_own_units(done, tmp_path, capsys):
    out, cases = done
    larger = cases[0].changed(**{"units.diameter": "20 um"})
    assert run_case(larger, tmp_path / "larger", progress=False).state == "finished"
    assert main(["compare", str(out / cases[0].name), str(tmp_path / "larger")]) == 0
    small, large = capsys.readouterr().out.splitlines()[1:]
    assert "0.02 = 3.333 min" in small and "0.02 = 13.33 min" in large  # four times the area, four times the time


def test_a_damaged_run_is_a_row_and_no_curve(done, tmp_path, capsys):
    out, cases = done
    shutil.copytree(out, tmp_path / "runs")
    paths = [tmp_path / "runs" / case.name for case in cases]
    (paths[0] / "history.csv").write_text("time\n1\n")
    assert main(["compare", *map(str, paths), "--plot", str(tmp_path / "b.png")]) == 0
    first, second = capsys.readouterr().out.splitlines()[1:]
    assert "damaged" in first and " nan " in first and "finished" in second


def test_first_time_of_a_level():
    time, area = np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.0, 0.4, 0.3, 0.6])
    assert comparison._first_time(time, area, 0.2) == 0.5
    assert comparison._first_time(time, area, 0.5) == pytest.approx(2.0 + 2.0 / 3.0)
    assert np.isnan(comparison._first_time(time, 0.0 * area, 0.0))
