"""Nothing of another case, version or other sources, and no code that others could write, is used in silence."""

import os
import shutil
import subprocess
import sys
import warnings
from pathlib import Path

import pytest
from stand_in import assert_same, interrupt_at

from vesdyn import _jit, batch, provenance, stepping, storage
from vesdyn.batch import BatchError
from vesdyn.case import Case
from vesdyn.cli import main
from vesdyn.provenance import BYSTANDERS, PACKAGE, identity, imported_modules
from vesdyn.run import missed_wish, run_case
from vesdyn.storage import RunDirectory, RunDirectoryError

CASE = Case(name="a", time={"end": 0.006, "step": 0.001}, output={"frames": (0.002,), "checkpoint_minutes": 0.0})


def changed(**sections):
    """CASE with other keys in its sections."""
    return Case.model_validate(
        {"name": "a"}
        | {s: getattr(CASE, s).model_dump() | sections.get(s, {}) for s in ("time", "output")}
        | {s: keys for s, keys in sections.items() if s not in ("time", "output")}
    )


# Sources


def test_no_module_that_decides_numbers_is_left_out_of_the_hash():
    deciding = ["spreading", "stepping", "diagnostics", "planning", "case", "case_file"]
    assert not {file.stem for file in imported_modules(PACKAGE, deciding)} & BYSTANDERS


def test_any_edit_of_a_deciding_module_changes_the_hash(tmp_path):
    before = provenance.hash_of(PACKAGE.glob("*.py"))
    copy = Path(shutil.copytree(PACKAGE, tmp_path / "vesdyn"))
    assert provenance.hash_of(copy.glob("*.py")) == before
    source = (copy / "receptors.py").read_text()
    for edited in (source + "\n", source.replace("1e-12", "1e-13", 1)):  # another size, and the same
        (copy / "receptors.py").write_text(edited)
        assert provenance.hash_of(copy.glob("*.py")) != before


@pytest.fixture
def other_sources(monkeypatch):
    """From here on the sources are other ones."""

    def change():
        monkeypatch.setattr(provenance, "_SOURCES", "0" * 64)

    return change


def test_finished_run_of_other_sources_is_said(physics, tmp_path, other_sources):
    run_case(CASE, tmp_path / "a")
    other_sources()
    with pytest.warns(UserWarning, match=r"was computed by other sources .*--restart"):
        assert run_case(CASE, tmp_path / "a").state == "finished"


def test_going_on_with_other_sources_is_said_and_noted(physics, tmp_path, other_sources):
    physics.before_step = interrupt_at(3)
    run_case(CASE, tmp_path / "a")
    physics.before_step = staticmethod(lambda steps: None)
    other_sources()
    with pytest.warns(UserWarning, match="goes on with another sources"):
        run_case(CASE, tmp_path / "a")
    assert RunDirectory(tmp_path / "a").origin()["resumed_with"][0]["sources"] == "0" * 64


def test_batch_computes_the_run_of_other_sources_anew(physics, tmp_path, other_sources):
    sign = batch._Sign(tmp_path / "sign")
    sign.stop("")
    run_case(CASE, tmp_path / "a")
    other_sources()
    outcome, doubts = batch._carry_out(CASE, tmp_path / "a", False, sign, identity())
    assert "already" not in outcome.reason and "computes it anew" in "".join(doubts)


# Workers of a cluster


class Cluster(batch._Cluster):
    """One whose scheduler knows the workers ``answers`` (address to identity)."""

    def __init__(self, answers):
        super().__init__("tcp://x")
        self.client, self.answers = self, answers
        self._workers = lambda: set(answers)

    def run(self, look, workers, on_error):
        return {worker: self.answers[worker] for worker in workers}


@pytest.mark.fault("a01")
@pytest.mark.parametrize(
    "theirs, part",
    [
        ({"vesdyn": "0.0.9"}, "the worker tcp://w2 has vesdyn 0.0.9"),
        ({"sources": "f" * 64}, "(sources ffffffffffff)"),
        ({"vesdyn": "0.0.1", "sources": "unknown"}, "vesdyn 0.0.1 (sources unknown)"),
        (None, "the worker tcp://w2 has no vesdyn"),
        (ModuleNotFoundError("vesdyn"), "the worker tcp://w2 has no vesdyn"),
    ],
)
def test_worker_of_another_version_is_refused_by_name(theirs, part):
    ours = identity()
    with pytest.raises(BatchError) as refusal:
        Cluster({"tcp://w1": ours, "tcp://w2": ours | theirs if isinstance(theirs, dict) else theirs})._check_workers()
    assert part in str(refusal.value)
    if isinstance(theirs, dict):
        assert f"this process vesdyn {ours['vesdyn']} (sources {ours['sources'][:12]})" in str(refusal.value)


@pytest.mark.fault("a01")
def test_worker_of_other_libraries_is_told():
    with pytest.warns(UserWarning, match="tcp://w2 has numba 0.1 for"):
        Cluster({"tcp://w2": identity() | {"numba": "0.1"}})._check_workers()


@pytest.mark.fault("a01")
def test_worker_that_came_later_refuses_by_itself(physics, tmp_path):
    sign = batch._Sign(tmp_path / "sign")
    sign.stop("")
    outcome, _ = batch._carry_out(CASE, tmp_path / "a", False, sign, identity() | {"sources": "0" * 64})
    assert outcome.state == "failed" and "its worker has vesdyn" in outcome.reason
    assert not (tmp_path / "a").exists()


@pytest.mark.verify
@pytest.mark.fault("a01")
def test_real_worker_with_a_changed_line_is_refused(tmp_path, capfd):
    from distributed import LocalCluster

    shutil.copytree(PACKAGE, tmp_path / "vesdyn")
    file = tmp_path / "vesdyn" / "spreading.py"
    file.write_text(file.read_text() + "\n# changed\n")
    (tmp_path / "q.yaml").write_text("name: q\nmodel: axisymmetric\nmesh: {front_edge: 0.03, far_edge: 0.06}\ntime: {end: 0.004}\n")
    with LocalCluster(n_workers=0, dashboard_address=None) as cluster:
        address = cluster.scheduler_address
        worker = subprocess.Popen(
            [sys.executable, "-m", "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard"],
            env=os.environ | {"PYTHONPATH": str(tmp_path)}, cwd=tmp_path, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        try:
            from distributed import Client

            with Client(address) as client:
                client.wait_for_workers(1, timeout=60)
            assert main(["batch", str(tmp_path / "q.yaml"), "--out", str(tmp_path / "r"), "--scheduler", address]) == 2
        finally:
            worker.terminate()
            worker.wait()
    assert "install the same on both" in capfd.readouterr().err


# The wish


@pytest.mark.fault("n3")
@pytest.mark.verify
def test_mesh_and_step_that_cannot_keep_the_wish_are_told_before_and_after(tmp_path):
    keys = {"name": "a", "model": "axisymmetric", "mesh": {"front_edge": 0.02, "far_edge": 0.05}, "time": {"end": 0.02, "step": 0.004}}
    wanting = Case.model_validate(keys | {"accuracy": 0.001, "output": {"frames": ()}})
    with pytest.warns(UserWarning) as told:
        outcome = run_case(wanting, tmp_path / "a", progress=False)
    words = " ".join(str(warning.message) for warning in told)
    assert "mesh.front_edge: 0.02 is estimated to cost" in words and "time.step: 0.004 is estimated to cost" in words
    assert "mesh.front_edge: 0.02 is estimated to cost" in outcome.note and "time.step: 0.004" in outcome.note
    assert not missed_wish(Case.model_validate(keys))  # nobody wished


# Compiled code


@pytest.mark.fault("n19")
def test_cache_is_made_for_the_user_alone(tmp_path):
    assert _jit.cache_directory(tmp_path, "abc") is None
    assert (tmp_path / "abc").stat().st_mode & 0o777 == 0o700


@pytest.mark.fault("n19")
@pytest.mark.parametrize("mode", [0o777, 0o757, 0o775, 0o770])
@pytest.mark.parametrize("above", [False, True])
def test_cache_where_others_may_write_is_refused(tmp_path, monkeypatch, mode, above):
    monkeypatch.setattr(_jit, "_private", lambda group: False)
    (tmp_path / "shared" / "abc").mkdir(parents=True, mode=0o700)
    (tmp_path / "shared" if above else tmp_path / "shared" / "abc").chmod(mode)
    assert "others may write in" in _jit.cache_directory(tmp_path / "shared", "abc")


@pytest.mark.fault("n19")
def test_cache_of_another_user_is_refused(tmp_path, monkeypatch):
    (tmp_path / "abc").mkdir(mode=0o700)
    monkeypatch.setattr(os, "geteuid", lambda: os.getuid() + 1)
    assert "belongs to another user" in _jit.cache_directory(tmp_path, "abc")


@pytest.mark.fault("n19")
def test_a_file_planted_by_another_user_is_seen(tmp_path, monkeypatch):
    (tmp_path / "abc").mkdir(mode=0o700)
    planted = tmp_path / "abc" / "kernel.nbi"
    planted.write_bytes(b"")
    if os.geteuid() != 0:
        pytest.skip("needs root, to give a file to another user")
    os.chown(planted, 12345, 12345)
    assert "kernel.nbi belongs to another user" in _jit.cache_directory(tmp_path, "abc")


def cache_of(package_parent, **environment):
    """Where a process keeps its compiled code, and what it says on stderr."""
    done = subprocess.run(
        [sys.executable, "-c", "import vesdyn._jit, numba, vesdyn; print(vesdyn.__file__); print(numba.config.CACHE_DIR)"],
        capture_output=True, text=True, check=True, cwd="/",
        env=os.environ | {"PYTHONPATH": str(package_parent)} | environment,
    )  # fmt: skip
    where, cache = done.stdout.split()
    assert Path(where).parents[1] == package_parent
    return Path(cache), done.stderr


@pytest.mark.fault("n1")
def test_sources_name_the_cache_in_numba_cache_dir_too(tmp_path):
    shutil.copytree(PACKAGE, tmp_path / "edited" / "vesdyn", ignore=shutil.ignore_patterns("__pycache__"))
    file = tmp_path / "edited" / "vesdyn" / "koiter.py"
    file.write_text(file.read_text().replace("/ 3.0", "/ 2.9"))
    caches = [cache_of(parent, NUMBA_CACHE_DIR=str(tmp_path / "c"))[0] for parent in (PACKAGE.parent, tmp_path / "edited")]
    assert [cache.parent for cache in caches] == 2 * [tmp_path / "c"] and caches[0] != caches[1]


@pytest.mark.fault("n19")
@pytest.mark.parametrize("home", ["/proc/no/home", "shared"])
def test_home_that_cannot_hold_the_cache_gives_a_temporary_one_and_a_warning(tmp_path, home):
    if home == "shared":
        home = tmp_path / "shared"
        home.mkdir()
        home.chmod(0o777)
    cache, words = cache_of(PACKAGE.parent, HOME=str(home), XDG_CACHE_HOME=str(home), NUMBA_CACHE_DIR="")
    assert "kept for this time only" in words
    assert not cache.exists() and not cache.parent.exists()  # removed in the end


# Going on with a changed case


@pytest.fixture
def interrupted(physics, tmp_path):
    physics.before_step = interrupt_at(3)
    run_case(CASE, tmp_path / "a")
    physics.before_step = staticmethod(lambda steps: None)
    return tmp_path / "a"


@pytest.mark.fault("a05")
@pytest.mark.parametrize(
    "wanted",
    [
        changed(solver={"max_iterations": 50000}),
        changed(output={"checkpoint_minutes": 3.0}),
        changed(output={"frames": (0.002, 0.005)}),
        changed(time={"end": 0.008}),
    ],
)
def test_run_goes_on_with_what_changes_nothing_so_far_and_notes_it(interrupted, tmp_path, wanted):
    run_case(wanted, tmp_path / "reference")
    with pytest.warns(UserWarning, match="goes on with a changed case"):
        assert run_case(wanted, interrupted).state == "finished"
    assert (interrupted / "history.csv").read_bytes() == (tmp_path / "reference" / "history.csv").read_bytes()
    (note,) = RunDirectory(interrupted).origin()["resumed_with"]
    assert note["changes"] and storage.load_case(interrupted / "case.yaml") == wanted


@pytest.mark.fault("a05")
@pytest.mark.parametrize(
    "wanted",
    [
        changed(time={"step": 0.0005}),
        changed(output={"frames": (0.001, 0.002)}),
        changed(time={"end": 0.003}, output={"frames": ()}),
        changed(mesh={"front_edge": 0.02}),
        Case.model_validate(CASE.model_dump() | {"drag": 0.08}),
    ],
)
def test_run_does_not_go_on_with_other_physics_mesh_or_steps(interrupted, wanted):
    with pytest.raises(RunDirectoryError, match="holds a run of a different case"):
        run_case(wanted, interrupted)


@pytest.mark.fault("a05")
def test_finished_run_is_prolonged(physics, tmp_path, capsys):
    run_case(CASE, tmp_path / "a")
    run_case(changed(time={"end": 0.008}, output={"frames": (0.002, 0.006)}), tmp_path / "reference")
    assert main(["resume", str(tmp_path / "a"), "--until", "0.008", "--quiet"]) == 0
    assert (tmp_path / "a" / "history.csv").read_bytes() == (tmp_path / "reference" / "history.csv").read_bytes()
    assert RunDirectory(tmp_path / "a").frame_times() == [0.0, 0.002, 0.006, 0.008]
    assert main(["resume", str(tmp_path / "a"), "--set", "drag=0.08"]) == 2
    assert "--restart" in capsys.readouterr().err


@pytest.mark.fault("a05")
def test_batch_goes_on_with_a_later_end(interrupted, tmp_path):
    sign = batch._Sign(tmp_path / "sign")
    sign.stop("")
    outcome, doubts = batch._carry_out(changed(time={"end": 0.008}), interrupted, False, sign, identity())
    assert outcome.state == "finished" and "changed case" in "".join(doubts) and "anew" not in "".join(doubts)


@pytest.mark.fault("a11")
@pytest.mark.parametrize("frames", [(), (0.002,)])
def test_last_state_is_always_a_frame(physics, tmp_path, frames):
    run_case(changed(output={"frames": frames}), tmp_path / "a")
    assert RunDirectory(tmp_path / "a").frame_times() == [0.0, *frames, 0.006]


@pytest.mark.fault("n10")
def test_resting_state_stands_for_the_frames_after_it(physics, tmp_path, monkeypatch):
    monkeypatch.setattr(stepping, "is_steady", lambda sim, state: state.steps >= 4)
    case = Case(name="a", time={"end": 1.0, "step": "auto"}, output={"frames": (0.5, 0.75)})
    outcome = run_case(case, tmp_path / "a")
    rest = outcome.time
    assert outcome.state == "finished" and 0 < rest < 0.5
    assert "the frames at 0.5, 0.75 show this resting state" in outcome.reason
    frames = RunDirectory(tmp_path / "a").frames()
    assert [frame.time for frame in frames] == [0.0, rest, 0.5, 0.75]
    assert all((frame.density == frames[1].density).all() for frame in frames[2:])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert "finished already" in run_case(case, tmp_path / "a").reason
    shutil.copytree(tmp_path / "a", tmp_path / "b")
    (tmp_path / "b" / "status.yaml").unlink()
    run_case(case, tmp_path / "b")
    assert_same(tmp_path / "b", tmp_path / "a")
