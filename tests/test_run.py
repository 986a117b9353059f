"""The loop around the physics: time levels, and the same bits however a run is interrupted."""

import math
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
import yaml
from stand_in import Physics, assert_same, interrupt_at, put_in_place

from vesdyn import run
from vesdyn.balance import NoBalanceError
from vesdyn.case import Case
from vesdyn.run import run_case
from vesdyn.storage import RunDirectory, RunDirectoryError

QUICK = [Path(__file__).parents[1] / "configs" / "quick.yaml", "--set", "mesh.front_edge=0.05", "mesh.far_edge=0.1"]


# Runs of a chaotic map


CASE = Case(
    name="a",
    time={"end": 0.02, "step": 0.001},
    output={"frames": (0.0045, 0.01, 0.02), "checkpoint_minutes": 0.0},
)


LEVELS = [*np.linspace(0.0, 0.0045, 6)[1:], *np.linspace(0.0045, 0.01, 7)[1:], *np.linspace(0.01, 0.02, 11)[1:]]


@pytest.fixture
def physics(monkeypatch):
    """Put Physics in the place of the real one; return it, to set its ``before_step``."""
    return put_in_place(monkeypatch)


@pytest.fixture
def uninterrupted(physics, tmp_path):
    assert run_case(CASE, tmp_path / "reference").state == "finished"
    return tmp_path / "reference"


def test_a_run_leaves_history_frames_checkpoint_and_picture(uninterrupted):
    directory = RunDirectory(uninterrupted)
    assert directory.frame_times() == [0.0, 0.0045, 0.01, 0.02]
    assert directory.history()["time"].tolist() == pytest.approx(LEVELS, abs=1e-15)
    assert directory.read_checkpoint()["time"] == 0.02
    assert directory.status()["state"] == "finished"
    assert directory.summary_file.exists()


def test_outcome_tells_the_figures_of_the_history(physics, tmp_path):
    outcome = run_case(CASE, tmp_path / "a")
    history = RunDirectory(tmp_path / "a").history()
    assert (outcome.time, outcome.steps, outcome.exit_status) == (0.02, len(history["time"]), 0)
    assert outcome.binding_area == history["binding_area"][-1]
    assert outcome.volume_error == max(abs(history["volume_error"]))


def test_a_finished_run_is_not_run_again_unless_told_to(physics, uninterrupted, monkeypatch):
    monkeypatch.setattr(run, "Spreading", None)
    outcome = run_case(CASE, uninterrupted)
    assert outcome.exit_status == 0 and "--restart" in outcome.reason
    monkeypatch.setattr(run, "Spreading", Physics)
    assert not run_case(CASE, uninterrupted, restart=True).reason


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("step", [0, 4, 13])
@pytest.mark.parametrize("checkpoint_minutes", [0.0, 60.0])
def test_interrupted_run_goes_on_to_the_same_bits(physics, tmp_path, number, step, checkpoint_minutes):
    case = CASE.model_copy(update={"output": CASE.output.model_copy(update={"checkpoint_minutes": checkpoint_minutes})})
    run_case(case, tmp_path / "reference")
    before = signal.getsignal(number)
    physics.before_step = interrupt_at(step, (number,))
    outcome = run_case(case, tmp_path / "a")
    assert (outcome.state, outcome.exit_status, outcome.steps) == ("interrupted", 130, step + 1)
    assert signal.Signals(number).name in outcome.reason
    assert signal.getsignal(number) is before
    physics.before_step = staticmethod(lambda steps: None)
    assert run_case(case, tmp_path / "a").state == "finished"
    assert_same(tmp_path / "a", tmp_path / "reference")


def test_interrupt_in_the_last_step_still_finishes(physics, tmp_path):
    physics.before_step = interrupt_at(len(LEVELS) - 1)
    assert run_case(CASE, tmp_path / "a").state == "finished"


@pytest.fixture
def ctrl_c():
    """Ctrl-C as on a terminal: a shell starts its background processes with SIGINT ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_second_interrupt_stops_within_the_step(physics, tmp_path, uninterrupted, ctrl_c):
    physics.before_step = interrupt_at(7, (signal.SIGINT, signal.SIGINT))
    outcome = run_case(CASE, tmp_path / "a")
    assert (outcome.state, outcome.steps) == ("interrupted", 7)
    physics.before_step = staticmethod(lambda steps: None)
    assert run_case(CASE, tmp_path / "a").state == "finished"
    assert_same(tmp_path / "a", uninterrupted)


def fail_at(step, error):
    def before_step(steps):
        if steps == step:
            raise error

    return staticmethod(before_step)


@pytest.mark.parametrize("step", [0, 9])
def test_failed_relaxation_is_an_outcome_with_the_last_good_state_kept(physics, tmp_path, uninterrupted, step):
    physics.before_step = fail_at(step, NoBalanceError("it stalls"))
    outcome = run_case(CASE, tmp_path / "a")
    assert (outcome.state, outcome.exit_status, outcome.steps) == ("failed", 1, step)
    assert outcome.reason.startswith("it stalls; reduce time.step, raise solver.max_iterations")
    physics.before_step = staticmethod(lambda steps: None)
    assert run_case(CASE, tmp_path / "a").state == "finished"
    assert_same(tmp_path / "a", uninterrupted)


def test_unforeseen_error_is_raised_and_noted(physics, tmp_path):
    physics.before_step = fail_at(3, ZeroDivisionError("why"))
    with pytest.raises(ZeroDivisionError):
        run_case(CASE, tmp_path / "a")
    assert RunDirectory(tmp_path / "a").status()["reason"] == "ZeroDivisionError: why"


def test_run_killed_before_its_first_checkpoint_starts_over(physics, tmp_path, uninterrupted):
    physics.before_step = fail_at(6, MemoryError())
    with pytest.raises(MemoryError):
        run_case(CASE, tmp_path / "a")
    for name in ("checkpoint.h5", "checkpoint_previous.h5"):
        (tmp_path / "a" / name).unlink()
    physics.before_step = staticmethod(lambda steps: None)
    assert run_case(CASE, tmp_path / "a").state == "finished"
    assert_same(tmp_path / "a", uninterrupted)


def test_run_killed_between_its_last_checkpoint_and_the_word_finished(physics, tmp_path, uninterrupted):
    run_case(CASE, tmp_path / "a")
    RunDirectory(tmp_path / "a").write_status("running")
    assert run_case(CASE, tmp_path / "a").state == "finished"
    assert_same(tmp_path / "a", uninterrupted)


def test_stop_is_asked_after_each_step(physics, tmp_path, uninterrupted):
    reasons = iter([None, None, "a whim"])
    outcome = run_case(CASE, tmp_path / "a", stop=lambda: next(reasons))
    assert (outcome.state, outcome.steps, outcome.reason) == ("interrupted", 3, "stopped by a whim.")
    assert run_case(CASE, tmp_path / "a").state == "finished"
    assert_same(tmp_path / "a", uninterrupted)


def test_damaged_checkpoint_costs_a_few_steps_only(physics, tmp_path, uninterrupted):
    physics.before_step = interrupt_at(12)
    run_case(CASE, tmp_path / "a")
    (tmp_path / "a" / "checkpoint.h5").write_bytes(b"damaged")
    physics.before_step = staticmethod(lambda steps: None)
    with pytest.warns(UserWarning, match="damaged"):
        run_case(CASE, tmp_path / "a")
    assert_same(tmp_path / "a", uninterrupted)


def test_another_case_in_the_directory_is_refused(physics, uninterrupted):
    with pytest.raises(RunDirectoryError, match="drag: 0.07 there, 0.08 here"):
        run_case(CASE.model_copy(update={"drag": 0.08}), uninterrupted)


def test_doubts_are_warned_of(physics, tmp_path):
    with pytest.warns(UserWarning, match="drag: without drag"):
        run_case(CASE.model_copy(update={"drag": 0.0}), tmp_path / "a")


def test_checkpoints_are_written_on_the_way(physics, tmp_path):
    physics.before_step = fail_at(6, MemoryError())
    for minutes, stored in ((0.0, 6), (60.0, None)):
        case = CASE.changed(**{"output.checkpoint_minutes": minutes})
        with pytest.raises(MemoryError):
            run_case(case, tmp_path / f"{minutes:g}")
        checkpoint = RunDirectory(tmp_path / f"{minutes:g}").read_checkpoint()
        assert (checkpoint and checkpoint["steps"]) == stored


# The wish

WANTING = CASE.changed(accuracy=0.001, **{"model": "axisymmetric", "mesh.front_edge": 0.02, "mesh.far_edge": 0.05})
HISTORY = {
    "time": np.array([0.01, 0.02]), "binding_area": np.array([0.1, 0.2]), "contact_radius": np.array([0.18, 0.25]),
    "free_tension_min": np.zeros(2), "free_tension_min_height": np.zeros(2), "area_error": np.array([0.004, 0.003]),
}  # fmt: skip


@pytest.mark.fault("n3")
def test_mesh_and_step_that_cannot_keep_the_wish_are_told_before_a_run(physics, tmp_path):
    with pytest.warns(UserWarning) as told:
        run_case(WANTING.changed(model="surface"), tmp_path / "a")  # a meridian would be asked for its compression
    words = " ".join(str(warning.message) for warning in told)
    assert "mesh.front_edge: 0.02 is estimated to cost" in words and "time.step: 0.001 is estimated to cost" in words


@pytest.mark.fault("n3")
def test_mesh_step_and_belief_that_missed_the_wish_are_told_after_a_run():
    note = run._notes(WANTING, HISTORY)
    assert "mesh.front_edge: 0.02 is estimated to cost" in note and "time.step: 0.001 is estimated to cost" in note
    assert "believed to be off by up to 0.004 of itself, more than the wish of 0.001" in note
    assert run._notes(WANTING.changed(accuracy=0.2), HISTORY) is None


# The real thing, through the command line


def vesdyn(directory, *arguments):
    command = [sys.executable, "-m", "vesdyn", *map(str, arguments)]
    return subprocess.Popen(command, cwd=directory, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def finish(process):
    stdout, stderr = process.communicate()
    return process.returncode, stdout, stderr


def wait_for_rows(file, rows, process):
    while not (file.exists() and file.read_text().count("\n") > rows):
        assert process.poll() is None, process.stderr.read()
        time.sleep(0.005)


@pytest.fixture(scope="module")
def quick(tmp_path_factory):
    """The directory of the quick case on a coarser mesh, run in one go."""
    directory = tmp_path_factory.mktemp("quick")
    status, stdout, stderr = finish(vesdyn(directory, "run", *QUICK))
    assert status == 0, stderr
    assert "binding area" in stdout
    return directory / "runs" / "quick"


def test_quick_case_leaves_everything(quick):
    expected = {"case.yaml", "status.yaml", "history.csv", "frames.h5", "frames.xdmf", "summary.png", "checkpoint.h5"}
    assert {file.name for file in quick.iterdir()} >= expected
    columns = (
        "time, binding_area, contact_radius, pressure, volume_error, receptor_number_error, density_min, density_max,"
        " membrane_area, height, elastic_energy, adhesion_work, dissipation, iterations, residual"
    )
    history = RunDirectory(quick).history()
    assert list(history)[:15] == columns.split(", ")
    assert all(np.all(np.isfinite(values)) for values in history.values())
    assert math.isclose(history["time"][-1], 0.06)
    with h5py.File(quick / "frames.h5") as file:
        assert file["frame_0001"].keys() >= {"position", "density", "gap", "traction", "tension_1", "tension_2"}


@pytest.mark.parametrize("number", [signal.SIGKILL, *(pytest.param(number, marks=pytest.mark.verify) for number in (signal.SIGINT, signal.SIGTERM))])
def test_quick_case_stopped_and_resumed_gives_the_same_bits(quick, tmp_path, number):
    case = ["run", *QUICK, "output.checkpoint_minutes=0", "--out", "a"]
    process = vesdyn(tmp_path, *case)
    wait_for_rows(tmp_path / "a" / "history.csv", 3, process)
    process.send_signal(number)
    status, _, stderr = finish(process)
    assert status == (-signal.SIGKILL if number == signal.SIGKILL else 130), stderr
    status, stdout, _ = finish(vesdyn(tmp_path, "info", "a"))
    assert ("killed" if number == signal.SIGKILL else "interrupted") in stdout
    status, _, stderr = finish(vesdyn(tmp_path, "resume", "a", "--quiet"))
    assert (status, stderr) == (0, "")
    assert_same(tmp_path / "a", quick)
    assert yaml.safe_load((tmp_path / "a" / "status.yaml").read_text())["state"] == "finished"


def test_state_of_another_mesh_is_refused_with_the_remedy(tmp_path):
    case = Case(name="a", mesh={"front_edge": 0.1, "far_edge": 0.2}, time={"end": 0.002}, output={"frames": ()})
    run_case(case, tmp_path / "a", progress=False)
    directory = RunDirectory(tmp_path / "a")
    directory.write_checkpoint(directory.read_checkpoint() | {"mesh": 1})
    directory.write_status("interrupted", "", 0.0)
    with pytest.raises(RunDirectoryError, match="another mesh.*--restart"):
        run_case(case, tmp_path / "a", progress=False)
