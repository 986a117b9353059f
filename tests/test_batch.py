"""Batches: nothing is lost, repeated or different, however workers, batches and files come to harm."""

import io
import os
import pty
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress

import psutil
import pytest
from rich.console import Console

import vesdyn
from vesdyn import batch
from vesdyn.batch import BatchError, read_cases, run_batch
from vesdyn.case import Case
from vesdyn.case_file import load_case
from vesdyn.cli import main
from vesdyn.provenance import identity
from vesdyn.run import run_case
from vesdyn.storage import RunDirectory

FIVE = """\
name: five
model: axisymmetric
mesh: {front_edge: 0.04, far_edge: 0.08}
time: {end: 0.15, step: 0.001}
output: {frames: [0.07], checkpoint_minutes: 0.003}
sweep: {drag: [0.07, 0.08, 0.09, 0.1, 0.11]}
"""
TINY = Case(
    name="tiny",
    model="axisymmetric",
    mesh={"front_edge": 0.03, "far_edge": 0.06},
    time={"end": 0.02, "step": 0.002},
    output={"frames": (), "checkpoint_minutes": 0.0},
)
FAILS = TINY.model_copy(
    update={"name": "fails", "solver": TINY.solver.model_copy(update={"max_iterations": 1})}
)


@pytest.fixture(scope="module")
def five(tmp_path_factory):
    """The case file of five small cases (half a second each), and what they come to undisturbed."""
    directory = tmp_path_factory.mktemp("five")
    (directory / "five.yaml").write_text(FIVE)
    results = run_batch(read_cases([directory / "five.yaml"]), directory / "runs", jobs=2, show=False)
    assert [outcome.state for _, outcome in results] == 5 * ["finished"]
    return directory


def assert_same(runs, reference):
    """The same numbers in every history, bit for bit, and all finished."""
    assert {path.name for path in runs.iterdir()} == {path.name for path in reference.iterdir()}  # no stop file left
    for path in (path for path in reference.iterdir() if path.is_dir()):
        assert (runs / path.name / "history.csv").read_bytes() == (path / "history.csv").read_bytes()
        assert RunDirectory(runs / path.name).status()["state"] == "finished"


def command(five, out, jobs=2):
    return [sys.executable, "-m", "vesdyn", "batch", five / "five.yaml", "--jobs", str(jobs), "--out", out]


def start(arguments):
    """Begin a process in a group of its own, as a shell does."""
    return subprocess.Popen(arguments, start_new_session=True, stderr=subprocess.PIPE, text=True)


def wait_until(condition, process=None):
    given_up = time.monotonic() + 120.0
    while not condition():
        assert process is None or process.poll() is None, process.stderr.read()
        assert time.monotonic() < given_up
        time.sleep(0.005)


def finished(out):
    paths = {path.parent for path in out.glob("*/summary.png")}
    return {path for path in paths if RunDirectory(path).status().get("state") == "finished"}


def begun(out, rows=20):
    """Directories of runs in the midst of their steps."""
    histories = [path for path in out.glob("*/history.csv") if path.read_text().count("\n") > rows]
    return {path.parent for path in histories} - finished(out)


def group(leader):
    """Processes of the group of ``leader`` that have not ended."""
    found = []
    for process in psutil.process_iter(["pid", "status"]):
        with suppress(ProcessLookupError):
            if os.getpgid(process.pid) == leader and process.info["status"] != psutil.STATUS_ZOMBIE:
                found.append(process.pid)
    return found


def times_of_change(directories):
    return {file: file.stat().st_mtime_ns for path in directories for file in path.iterdir()}


# Reading


def test_files_and_their_sweeps_become_cases(tmp_path):
    (tmp_path / "a.yaml").write_text("name: a\nsweep: {drag: [1, 2]}")
    (tmp_path / "b.yaml").write_text("name: b")
    cases = read_cases([tmp_path / "a.yaml", tmp_path / "b.yaml"], ["time.end=1"])
    assert [case.name for case in cases] == ["a-drag=1", "a-drag=2", "b"]
    assert {case.time.end for case in cases} == {1.0}


def test_every_fault_is_told_before_anything_runs(tmp_path, capsys):
    for name, text in {"a": "name: x", "b": "name: x", "c": "drag: -1", "d": "name: d"}.items():
        (tmp_path / f"{name}.yaml").write_text(text)
    files = [str(tmp_path / f"{name}.yaml") for name in "abcd"]
    assert main(["batch", *files, "--out", str(tmp_path / "runs")]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert [line.removeprefix(f"vesdyn: {tmp_path}/") for line in lines] == [
        "c.yaml: name: missing; give it.",
        "c.yaml: drag: -1 is out of range; it must be at least 0.",
        f"a.yaml, {tmp_path}/b.yaml: name: x is the name of 2 cases of this batch; give each its own.",
    ]
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize("command", ["run", "explain"])
def test_commands_for_one_case_refuse_a_sweep(five, capsys, command):
    assert main([command, str(five / "five.yaml")]) == 2
    assert "run them by `vesdyn batch" in capsys.readouterr().err


@pytest.mark.parametrize("jobs", ["0", "-1", "x"])
def test_no_processes_are_refused(five, capsys, jobs):
    with pytest.raises(SystemExit):
        main(["batch", str(five / "five.yaml"), "--jobs", jobs])
    assert "give 1 or more" in capsys.readouterr().err


# One case, as a worker carries it out


@pytest.fixture
def carry_out(tmp_path):
    """Carry out a case in tmp_path/runs; return its outcome and the sentences it warned of."""
    path, sign = tmp_path / "runs", batch._Sign(tmp_path / "sign")
    sign.stop("")
    return lambda case=TINY, restart=False: batch._carry_out(case, path, restart, sign, identity())


def test_a_done_case_is_left_as_it_is(carry_out, tmp_path):
    first, _ = carry_out()
    before = times_of_change([tmp_path / "runs"])
    again, doubts = carry_out()
    assert times_of_change([tmp_path / "runs"]) == before
    assert (again.state, again.wall_time, doubts) == ("finished", first.wall_time, [])
    assert "finished already" in again.reason
    carry_out(restart=True)
    assert times_of_change([tmp_path / "runs"]) != before


def test_auto_is_planned_in_the_worker_and_recognised_again(carry_out, tmp_path):
    (tmp_path / "a.yaml").write_text(
        "name: a\nmodel: auto\naccuracy: 10%\nmesh: auto\ntime: {end: 0.02, step: auto}\noutput: {frames: []}"
    )
    case = load_case(tmp_path / "a.yaml")
    carry_out(case)
    stored = load_case(tmp_path / "runs" / "case.yaml")
    assert stored.model == "axisymmetric" and stored.mesh.front_edge != "auto"
    assert RunDirectory(tmp_path / "runs").origin()["decisions"]
    assert "finished already" in carry_out(case)[0].reason


def test_run_of_another_case_is_left_alone(carry_out, tmp_path):
    carry_out()
    before = times_of_change([tmp_path / "runs"])
    outcome, _ = carry_out(TINY.model_copy(update={"drag": 0.08}))
    assert outcome.state == "failed" and "drag: 0.07 there, 0.08 here" in outcome.reason
    assert times_of_change([tmp_path / "runs"]) == before


@pytest.mark.parametrize("state", ["finished", "interrupted"])
def test_run_of_another_version_is_computed_anew(carry_out, tmp_path, monkeypatch, state):
    carry_out()
    RunDirectory(tmp_path / "runs").write_status(state)
    monkeypatch.setattr(vesdyn, "__version__", "9.9")
    outcome, (doubt,) = carry_out()
    assert outcome.state == "finished" and "already" not in outcome.reason
    assert "holds a run by vesdyn" in doubt and "vesdyn 9.9" in doubt and "computes it anew" in doubt
    assert RunDirectory(tmp_path / "runs").origin()["vesdyn"] == "9.9"
    assert "finished already" in carry_out()[0].reason


def damage_checkpoints(directory):
    for file in (directory.checkpoint_file, directory.checkpoint_previous):
        file.write_bytes(b"damaged")


def shorten_history(directory):
    lines = directory.history_file.read_text().splitlines(keepends=True)
    directory.history_file.write_text("".join(lines[:2]))


def belong_to_another_mesh(directory):
    directory.write_checkpoint(directory.read_checkpoint() | {"mesh": 1})


@pytest.mark.parametrize(
    "harm, part",
    [
        (lambda directory: directory.checkpoint_file.write_bytes(b"damaged"), "is damaged and left aside"),
        (damage_checkpoints, "no checkpoint in it is whole"),
        (shorten_history, "history.csv is damaged"),
        (belong_to_another_mesh, "another mesh"),
    ],
)
def test_harmed_run_goes_on_or_starts_anew_and_says_so(carry_out, tmp_path, harm, part):
    carry_out()
    whole = (tmp_path / "runs" / "history.csv").read_bytes()
    directory = RunDirectory(tmp_path / "runs")
    directory.write_status("interrupted")
    harm(directory)
    outcome, doubts = carry_out()
    assert outcome.state == "finished" and part in "\n".join(doubts)
    assert directory.history_file.read_bytes() == whole


def test_a_stopped_batch_begins_nothing(carry_out, tmp_path):
    batch._Sign(tmp_path / "sign").stop("SIGINT")
    outcome, _ = carry_out()
    assert (outcome.state, outcome.reason) == ("interrupted", "not begun, stopped by SIGINT.")
    assert not (tmp_path / "runs").exists()


def test_the_end_of_a_batch_stops_its_workers(carry_out, tmp_path):
    """Its sign is gone: the batch has ended, or has been killed and another one has cleaned up."""
    (tmp_path / "sign").unlink()
    outcome, _ = carry_out()
    assert (outcome.state, outcome.reason) == ("interrupted", "not begun, stopped by the end of its batch.")


@pytest.mark.fault("n17")
def test_what_another_process_computes_is_elsewhere(carry_out, tmp_path):
    with RunDirectory(tmp_path / "runs").claim(TINY):
        assert carry_out()[0].state == "elsewhere"


# Processes of this machine


class InThisProcess:
    """A worker that carries out a case when it is handed over."""

    def kill(self):
        pass

    def submit(self, function, *arguments):
        future = Future()
        future.set_result(function(*arguments))
        return future


@pytest.fixture
def local(monkeypatch):
    """Put workers of a class, by default `InThisProcess`, in the place of processes."""

    def put(worker=InThisProcess):
        @contextmanager
        def local(jobs):
            workers = batch._Local(0)
            workers.workers = [worker() for _ in range(jobs)]
            yield workers

        monkeypatch.setattr(batch, "_local", local)

    return put


def test_failure_of_one_case_is_told_in_the_end_and_stops_no_other(tmp_path, capsys, local):
    local()
    for case in (FAILS, TINY):
        (tmp_path / f"{case.name}.yaml").write_text(case.to_yaml())
    files = [str(tmp_path / f"{name}.yaml") for name in ("fails", "tiny")]
    assert main(["batch", *files, "--jobs", "1", "--out", str(tmp_path / "runs")]) == 1
    stdout, stderr = capsys.readouterr()
    assert stdout == f"{tmp_path}/runs: 1 failed, 1 finished.\n"
    lines = [line for line in stderr.splitlines() if "warning" not in line]
    assert [line.split(",")[0] for line in lines[:2]] == ["fails: failed", "tiny: finished"]
    assert lines[2].startswith(f"vesdyn: {tmp_path}/runs/fails: ") and "max_iterations" in lines[2]
    assert len(lines) == 3


def test_killed_batch_goes_on_to_the_same_bits_and_repeats_nothing(five, tmp_path):
    out = tmp_path / "runs"
    process = start(command(five, out))
    wait_until(lambda: len(finished(out)) >= 2 and begun(out), process)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    done = finished(out)
    assert 2 <= len(done) < 5
    before = times_of_change(done)
    claimed = times_of_change(begun(out))
    assert subprocess.run(command(five, out)).returncode == 0
    assert times_of_change(done) == before
    assert_same(out, five / "runs")
    for file, changed in claimed.items():  # gone on with, not begun anew
        assert file.name != "case.yaml" or file.stat().st_mtime_ns == changed


@pytest.mark.parametrize(
    "number, whole_group", [(signal.SIGINT, True), pytest.param(signal.SIGTERM, False, marks=pytest.mark.verify)]
)
def test_interrupted_batch_stores_checkpoints_and_leaves_no_process(five, tmp_path, number, whole_group):
    out = tmp_path / "runs"
    process = start(command(five, out))
    wait_until(lambda: finished(out) and begun(out), process)
    (os.killpg if whole_group else os.kill)(process.pid, number)
    _, stderr = process.communicate()
    assert process.returncode == 130 and "Traceback" not in stderr
    wait_until(lambda: not group(process.pid))
    runs = [RunDirectory(path) for path in out.iterdir() if path.is_dir()]
    assert len(runs) < 5 and {run.status()["state"] for run in runs} <= {"finished", "interrupted"}
    assert all(run.read_checkpoint()["time"] == run.last_row()["time"] for run in runs)
    assert f"not begun, stopped by {number.name}." in stderr
    assert subprocess.run(command(five, out)).returncode == 0
    assert_same(out, five / "runs")


def test_workers_end_with_a_killed_batch(five, tmp_path):
    process = start(command(five, tmp_path / "runs"))
    wait_until(lambda: begun(tmp_path / "runs"), process)
    assert len(group(process.pid)) >= 3
    process.kill()
    process.wait()
    wait_until(lambda: not group(process.pid))


def test_killed_worker_is_replaced_and_its_case_goes_on(five, tmp_path):
    out = tmp_path / "runs"
    process = start(command(five, out, jobs=1))
    wait_until(lambda: begun(out), process)
    (worker,) = [child for child in psutil.Process(process.pid).children() if "spawn_main" in str(child.cmdline())]
    worker.kill()
    _, stderr = process.communicate()
    assert process.returncode == 0, stderr
    assert_same(out, five / "runs")


def test_case_whose_process_dies_again_and_again_is_given_up(tmp_path, local):
    class Dies(InThisProcess):
        renewed = 0

        def submit(self, function, case, *arguments):
            if case.name != "deadly":
                return super().submit(function, case, *arguments)
            if self.renewed % 2:
                raise BrokenProcessPool  # as one that died idle
            future = Future()
            future.set_exception(BrokenProcessPool())
            return future

        def renew(self):
            self.renewed += 1

    local(Dies)
    cases = [TINY.model_copy(update={"name": "deadly"}), TINY]
    (_, deadly), (_, tiny) = run_batch(cases, tmp_path / "runs", jobs=1, show=False)
    assert (deadly.state, tiny.state) == ("failed", "finished")
    assert "died 3 times" in deadly.reason and "memory" in deadly.reason


@pytest.mark.fault("n17")
def test_a_case_that_is_computed_elsewhere_is_waited_for(tmp_path, monkeypatch, local):
    """The directory is held for a while; the other case is computed meanwhile, and the first one then."""
    local()
    monkeypatch.setattr(batch, "_ELSEWHERE", 0.05)
    held, release, order = threading.Event(), threading.Event(), []

    def neighbour():
        with RunDirectory(tmp_path / "runs" / "held").claim(TINY.model_copy(update={"name": "held"})):
            held.set()
            release.wait(60)

    def tell(line, **_):
        order.append(line.partition(":")[0])
        release.set()

    (tmp_path / "runs").mkdir()
    thread = threading.Thread(target=neighbour)
    thread.start()
    held.wait(60)
    monkeypatch.setattr(batch, "print", tell, raising=False)
    results = run_batch([TINY.model_copy(update={"name": "held"}), TINY], tmp_path / "runs", jobs=1)
    thread.join()
    assert [outcome.state for _, outcome in results] == 2 * ["finished"] and order == ["tiny", "held"]


# On the terminal


def test_table_tells_how_each_case_stands(tmp_path):
    cases = [TINY, TINY.model_copy(update={"name": "waits"}), FAILS]
    outcomes = {"tiny": run_case(TINY, tmp_path / "tiny", progress=False)}
    run_case(FAILS, tmp_path / "fails", progress=False)
    RunDirectory(tmp_path / "fails").append_history({"time": 0.01, "binding_area": 0.125})
    console = Console(file=io.StringIO(), width=160)
    console.print(batch._table(cases, tmp_path, outcomes, began=0.1))
    rows = {words[1]: words for words in map(str.split, console.file.getvalue().splitlines()) if len(words) > 5}
    assert rows["tiny"][3:6] == ["finished", "│", "0.0200"]
    assert rows["waits"][3] == "waiting"
    assert [rows["fails"][i] for i in (3, 5, 9)] == ["running", "0.0100", "0.1250"]


def test_live_table_on_a_terminal(tmp_path, monkeypatch, local):
    local()
    monkeypatch.setenv("COLUMNS", "120")
    monkeypatch.setenv("TERM", "xterm")
    ours, theirs = pty.openpty()
    shown = []

    def read():
        with suppress(OSError):  # the end, on Linux
            while part := os.read(ours, 4096):
                shown.append(part)

    reader = threading.Thread(target=read)
    reader.start()
    with open(theirs, "w", encoding="utf-8") as terminal, monkeypatch.context() as patch:
        patch.setattr(sys, "stderr", terminal)
        run_batch([TINY], tmp_path / "runs", jobs=1)
    reader.join()
    text = b"".join(shown).decode()
    for word in ("binding area", "wall time", "finished", "0.0200"):
        assert word in text


# A cluster


def test_missing_package_is_one_sentence(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "distributed", None)
    (tmp_path / "tiny.yaml").write_text(TINY.to_yaml())
    assert main(["batch", str(tmp_path / "tiny.yaml"), "--scheduler", "tcp://x", "--out", str(tmp_path / "runs")]) == 2
    assert capsys.readouterr().err == (
        "vesdyn: --scheduler: needs the package distributed; `pip install 'vesdyn[cluster]'`.\n"
    )


@pytest.mark.parametrize("address", ["nonsense://x", "tcp://127.0.0.1:9"])
def test_absent_scheduler_is_one_sentence(tmp_path, monkeypatch, address):
    monkeypatch.setattr(batch, "_PATIENCE", 0.5)
    with pytest.raises(BatchError) as refused:
        run_batch([TINY], tmp_path, scheduler=address, show=False)
    assert str(refused.value).startswith(f"--scheduler {address}: no answer") and "\n" not in str(refused.value)


@pytest.fixture
def cluster():
    """A Dask scheduler and two worker processes of one thread each."""
    from distributed import Client, LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        with Client(cluster) as client:
            yield client


@pytest.mark.verify
def test_killed_worker_of_a_cluster_loses_nothing(five, tmp_path, cluster):
    out, killed = tmp_path / "runs", []

    def kill():
        wait_until(lambda: begun(out))
        address, pid = next(iter(cluster.run(os.getpid).items()))  # busy, as are all while cases are left
        os.kill(pid, signal.SIGKILL)
        killed.append(address)

    killer = threading.Thread(target=kill)
    killer.start()
    results = run_batch(read_cases([five / "five.yaml"]), out, scheduler=cluster.scheduler.address, show=False)
    killer.join()
    assert killed and [outcome.state for _, outcome in results] == 5 * ["finished"]
    assert_same(out, five / "runs")


@pytest.mark.verify
def test_interrupt_reaches_a_cluster(five, tmp_path, cluster):
    out = tmp_path / "runs"
    process = start(command(five, out) + ["--scheduler", cluster.scheduler.address])
    wait_until(lambda: begun(out), process)
    process.send_signal(signal.SIGINT)
    _, stderr = process.communicate()
    assert process.returncode == 130, stderr
    assert {RunDirectory(path).status()["state"] for path in out.iterdir() if path.is_dir()} <= {"finished", "interrupted"}
    run_batch(read_cases([five / "five.yaml"]), out, scheduler=cluster.scheduler.address, show=False)
    assert_same(out, five / "runs")
