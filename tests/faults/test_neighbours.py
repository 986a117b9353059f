"""Locks that fail, other processes in the same directory, other systems, and streams that are closed."""

import errno
import io
import os
import subprocess
import sys
import threading
import time

import pytest

from vesdyn import storage
from vesdyn.batch import run_batch
from vesdyn.case import Case
from vesdyn.cli import main
from vesdyn.errors import CaseError
from vesdyn.interrupts import Forgiving, on_terminal
from vesdyn.provenance import cores
from vesdyn.results import open_run
from vesdyn.run import run_case
from vesdyn.storage import BusyError, RunDirectory, RunDirectoryError

CASE = Case(name="a", time={"end": 0.004, "step": 0.001}, output={"frames": (), "checkpoint_minutes": 0.0})
TINY = "name: NAME\nmodel: axisymmetric\nmesh: {front_edge: 0.03, far_edge: 0.06}\ntime: {end: END, step: 0.001}\noutput: {frames: []}\n"
VESDYN = [sys.executable, "-m", "vesdyn"]


@pytest.fixture
def without_flock(monkeypatch):
    """A file system whose flock fails, with the number given to the function."""

    def fail_with(number):
        def flock(handle, operation):
            raise OSError(number, os.strerror(number))

        monkeypatch.setattr(storage.fcntl, "flock", flock)

    return fail_with


@pytest.mark.fault("a03")
@pytest.mark.parametrize("number", [errno.ENOLCK, errno.EIO, errno.EBADF, errno.ENOSYS, errno.ENOTSUP, errno.EACCES])
def test_run_without_locks_of_the_file_system(physics, tmp_path, without_flock, tried, number):
    without_flock(number)
    tried["neighbours"] += 1
    with RunDirectory(tmp_path / "a").claim(CASE):
        assert RunDirectory(tmp_path / "a").busy()
        with pytest.raises(BusyError, match="another process"):
            run_case(CASE, tmp_path / "a")
    assert not RunDirectory(tmp_path / "a").busy()
    assert run_case(CASE, tmp_path / "a").state == "finished"
    assert not list((tmp_path / "a").glob(".lock*"))


@pytest.mark.fault("a03")
@pytest.mark.parametrize(
    "owner, age, taken",
    [
        ("HOST 999999999 x", 0, True),  # killed
        ("HOST 1 x", 0, False),  # alive
        ("HOST SELF x", 300, False),  # stopped for long, and alive
        ("HOST 1 0.0-x", 0, True),  # its number was given to another process
        ("elsewhere 1 x", -3600, True),  # touched in the future
        ("elsewhere 1 x", 30, False),  # another host, touched lately
        ("elsewhere 1 x", 300, True),  # another host, for long untouched
        ("", 300, True),  # died as it wrote its name
        ("", 0, False),
    ],
)
def test_lock_file_of_a_dead_owner_is_taken_over(physics, tmp_path, without_flock, tried, owner, age, taken):
    without_flock(errno.ENOLCK)
    tried["neighbours"] += 1
    (tmp_path / "a").mkdir()
    lock = tmp_path / "a" / ".lock"
    owner = owner.replace("SELF x", f"{os.getpid()} {storage._began(os.getpid())}-x")
    lock.write_text(owner.replace("HOST", storage.socket.gethostname()))
    os.utime(lock, (time.time() - age, time.time() - age))
    if taken:
        assert run_case(CASE, tmp_path / "a").state == "finished"
    else:
        with pytest.raises(BusyError):
            run_case(CASE, tmp_path / "a")


@pytest.mark.fault("a03")
def test_of_many_one_gets_the_lock(tmp_path, tried):
    held, tries = [], 16
    start = threading.Barrier(tries)

    def try_it():
        start.wait()
        with storage._lock_by_file(tmp_path / ".lock") as got:
            held.append(got)
            start.wait()

    threads = [threading.Thread(target=try_it) for _ in range(tries)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    tried["neighbours"] += tries
    assert sorted(held) == [False] * (tries - 1) + [True]


@pytest.mark.fault("a08")
def test_cores_without_sched_getaffinity(monkeypatch):
    assert cores() == len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else True
    monkeypatch.delattr(os, "sched_getaffinity", raising=False)
    assert cores() == os.cpu_count()


@pytest.mark.verify  # what happens in the loop is held by tests/test_batch.py
@pytest.mark.fault("n17")
def test_two_batches_in_one_directory(tmp_path, tried):
    files = []
    for name in ("x", "y"):
        files.append(tmp_path / f"{name}.yaml")
        files[-1].write_text(TINY.replace("NAME", name).replace("END", "0.03"))
    tried["neighbours"] += 1
    command = [*VESDYN, "batch", *files, "--jobs", "1", "--out", tmp_path / "r"]
    both = [subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) for _ in range(2)]
    for process in both:
        words, errors = process.communicate(timeout=900)  # a new tree compiles its kernels first
        assert process.returncode == 0, errors
        assert "2 finished" in words and "failed" not in errors
    assert not list((tmp_path / "r").glob(".batch*"))


@pytest.mark.fault("n18")
@pytest.mark.parametrize(
    "command, closed", [("info", ">&-"), ("info", "2>&-"), ("resume", "2>&-"), ("resume", "<&- >&- 2>&-")]
)
def test_streams_that_are_closed(physics, tmp_path, tried, command, closed):
    run_case(CASE, tmp_path / "a")
    tried["neighbours"] += 1
    shell = f"{sys.executable} -m vesdyn {command} {tmp_path / 'a'} {closed}"
    done = subprocess.run(["sh", "-c", shell], capture_output=True, text=True)
    assert done.returncode == 0 and "Traceback" not in done.stderr, done.stderr


def test_stream_that_is_no_terminal(tmp_path):
    closed = open(tmp_path / "x", "w")
    closed.close()
    assert not on_terminal(None) and not on_terminal(closed)


@pytest.mark.fault("n18")
def test_broken_pipe_is_no_error(tmp_path, tried):
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run([*VESDYN, "template"], stdout=writing, stderr=subprocess.PIPE, text=True)
    os.close(writing)
    tried["neighbours"] += 1
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.fault("n18")
@pytest.mark.parametrize("where", ["pipe", "/dev/full"])
def test_words_that_nobody_reads_keep_nothing_from_being_computed(tmp_path, tried, where):
    """Unbuffered, as in containers, the first word fails before the run has begun."""
    (tmp_path / "q.yaml").write_text(TINY.replace("NAME", "q").replace("END", "0.003").replace("axisymmetric", "auto"))
    reading, writing = os.pipe()
    os.close(reading)
    with open(os.devnull if where == "pipe" else where, "w") as full:
        done = subprocess.run(
            [*VESDYN, "run", tmp_path / "q.yaml", "--out", tmp_path / "r"], stderr=subprocess.PIPE, text=True,
            stdout=writing if where == "pipe" else full, env=os.environ | {"PYTHONUNBUFFERED": "1"},
        )  # fmt: skip
    os.close(writing)
    tried["neighbours"] += 1
    assert RunDirectory(tmp_path / "r").status()["state"] == "finished"
    assert done.returncode == (0 if where == "pipe" else 1) and "Traceback" not in done.stderr
    assert where == "pipe" or "standard output: No space left on device" in done.stderr


@pytest.mark.fault("n18")
@pytest.mark.parametrize("command", [["--help"], ["--version"], ["template"], ["info", "none"]])
def test_full_standard_output_is_a_sentence(command):
    with open("/dev/full", "w") as full:
        done = subprocess.run([*VESDYN, *command], stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.returncode == (2 if command[0] == "info" else 1)
    assert all(line.startswith("vesdyn: ") for line in done.stderr.splitlines()) and done.stderr


class Gone(io.StringIO):
    """A terminal that was closed."""

    encoding = "ascii"

    def isatty(self):
        return True

    def write(self, text):
        raise OSError(errno.EIO, "Input/output error")


@pytest.mark.fault("n18")
def test_run_outlives_its_terminal(physics, tmp_path, monkeypatch, tried):
    monkeypatch.setattr(sys, "stderr", Gone())
    tried["neighbours"] += 1
    assert run_case(CASE, tmp_path / "a", progress=True).state == "finished"


def test_words_that_the_terminal_cannot_show_are_escaped(tmp_path):
    with open(tmp_path / "words", "w", encoding="ascii") as file:
        words = Forgiving(file)
        print("caf\xe9 \udce9", file=words)
    assert (tmp_path / "words").read_text() == "caf\\xe9 \\udce9\n" and words.fault is None


@pytest.mark.fault("n22")
@pytest.mark.parametrize("name", ["x" * 300, "loop", "nowhere", "x\x1b[31m" * 50])
@pytest.mark.parametrize("command", ["run", "batch", "info", "resume", "infer", "explain"])
def test_names_that_can_be_no_directory_or_file(tmp_path, capsys, monkeypatch, command, name):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "q.yaml").write_text(TINY.replace("NAME", "q").replace("END", "0.003"))
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "nowhere").symlink_to("missing")
    for arguments in ([command, "q.yaml", "--out", name], [command, name])[command not in ("run", "batch") :]:
        assert main(arguments) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert "Errno" not in line and "\x1b" not in line and line.endswith((".", "`."))
    assert {file.name for file in tmp_path.iterdir()} == {"q.yaml", "loop", "nowhere"}


@pytest.mark.parametrize("path", [None, 3, "a\0b", "\ud800", b"a", ["a"]])
def test_what_is_no_path_is_told(path):
    for use in (lambda: run_case(CASE, path), lambda: open_run(path), lambda: run_batch([CASE], path)):
        with pytest.raises(RunDirectoryError, match="is not a path; give that of a directory"):
            use()


def test_cases_of_one_name_are_no_batch(tmp_path):
    with pytest.raises(CaseError, match="a: is the name of several cases of this batch; give each its own"):
        run_batch([CASE, CASE.changed(drag=0.1)], tmp_path)


@pytest.mark.fault("n22")
@pytest.mark.parametrize("command", ["run", "batch"])
def test_out_that_is_a_file_is_told_before_anything_else(tmp_path, capsys, monkeypatch, command):
    monkeypatch.setattr("vesdyn.planning.plan", None)
    (tmp_path / "q.yaml").write_text("name: q\nmodel: auto\nmesh: auto\n")
    (tmp_path / "out").write_text("mine")
    for out in (tmp_path / "out", tmp_path / "out" / "below"):
        assert main([command, str(tmp_path / "q.yaml"), "--out", str(out)]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert "is a file, not a directory; choose another --out." in line
    assert (tmp_path / "out").read_text() == "mine"
