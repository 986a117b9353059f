"""A run as its user reads it from Python: by name and time, with units, while it goes on."""

import csv

import numpy as np
import pytest

import vesdyn
from vesdyn.case import Case
from vesdyn.diagnostics import COLUMNS, Column
from vesdyn.errors import CaseError
from vesdyn.results import open_run
from vesdyn.run import run_case
from vesdyn.storage import DamagedRunError, RunDirectory, RunDirectoryError

KEYS = {
    "name": "a",
    "model": "axisymmetric",
    "mesh": {"front_edge": 0.05, "far_edge": 0.1},
    "time": {"end": 0.006, "step": 0.001},
    "output": {"frames": (0.002,)},
}
LOWEST = Column("lowest_node", "a0", "height of the first node", lambda moment: moment.x[0, -1])


@pytest.fixture(scope="module", params=["axisymmetric", "surface"])
def path(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("results") / "a"
    keys = KEYS | {"model": request.param, "mesh": {"front_edge": 0.08, "far_edge": 0.12}}
    assert run_case(Case.model_validate(keys), path, columns=[LOWEST], progress=False).state == "finished"
    return path


def test_the_door_opens_a_run():
    assert vesdyn.open_run is open_run


def test_history_by_name_with_units(path):
    run = open_run(path)
    assert list(run.history) == [column.name for column in (*COLUMNS, LOWEST)]  # a user's own column too
    assert run.history["time"].tolist() == pytest.approx([0.001 * i for i in range(1, 7)])
    assert run.history.units["binding_area"] == "a0^2" and run.history.units["lowest_node"] == "a0"
    assert run.history.meanings["lowest_node"] == "height of the first node"


def test_history_is_plain_csv(path):
    with open(path / "history.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["binding_area"]) for row in rows] == open_run(path).history["binding_area"].tolist()


def test_case_status_and_frames(path):
    run = open_run(path)
    assert run.case.name == "a" and run.status["state"] == "finished"
    assert run.times == [0.0, 0.002, 0.006] == [frame.time for frame in run.frames]
    assert run.frame(0.002 * (1 + 1e-12)).time == 0.002 and run.final.time == 0.006
    assert run.frames[-1].time == 0.006 and [frame.time for frame in run.frames[1:]] == [0.002, 0.006]
    with pytest.raises(CaseError, match=r"no frame at t = 0.5; there are 0, 0.002, 0.006"):
        run.frame(0.5)


def test_profile_of_the_start_is_a_half_circle(path):
    run = open_run(path)
    profile, centre = run.profile(0.0), run.frame(0.0).position[:, -1].min() + 0.5
    assert np.all(np.diff(profile.height) > 0)
    from_centre = np.hypot(profile.radius, profile.height - centre)
    # rings of a surface are averages over vertices at several heights: second order in their width, 0.1
    assert from_centre == pytest.approx(0.5, abs=0.02)
    assert profile.arc[-1] == pytest.approx(np.pi / 2, rel=0.02)  # a curve of chords, of rings as above
    assert profile.density == pytest.approx(1.0, abs=1e-12)


def test_run_that_goes_on_can_be_read(tmp_path):
    seen = []

    def look(moment):
        run = open_run(tmp_path / "a")
        seen.append((run.status["state"], len(run.history["time"]), run.times))

    run_case(Case.model_validate(KEYS), tmp_path / "a", on_step=look, progress=False)
    assert seen[0] == ("running", 1, [0.0]) and seen[3] == ("running", 4, [0.0, 0.002])


def test_damaged_history_is_not_given(tmp_path):
    run_case(Case.model_validate(KEYS), tmp_path / "a", progress=False)
    file = RunDirectory(tmp_path / "a").history_file
    file.write_bytes(file.read_bytes().replace(b"0.003", b"0.004", 1))
    with pytest.raises(DamagedRunError, match="history.csv is damaged"):
        open_run(tmp_path / "a").history


def test_directory_without_a_run(tmp_path):
    with pytest.raises(RunDirectoryError, match="holds no run|No such file"):
        open_run(tmp_path)
