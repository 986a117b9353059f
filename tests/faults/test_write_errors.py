"""Every write, sync, move and open of a run fails once; nothing is lost, and nothing damaged passes for good.

After SQLite's account of its testing: the n-th call fails, for n = 1, 2, ... until a run goes through without.
"""

import errno
import itertools
import os
import re
import shutil
import subprocess
import sys
import warnings

import pytest
from stand_in import assert_same, interrupt_at

from vesdyn import files, storage
from vesdyn.case import Case
from vesdyn.files import WriteError
from vesdyn.run import run_case
from vesdyn.storage import RunDirectory

CASE = Case(
    name="a",
    time={"end": 0.004, "step": 0.001},
    output={"frames": (0.002,), "checkpoint_minutes": 0.0},
)
FEW_OR_ALL = [17, pytest.param(1, marks=pytest.mark.verify)]  # one call in so many
WRITING = ("open", "write", "fsync", "close", "replace", "rename", "unlink", "makedirs")
SENTENCES = {
    errno.ENOSPC: "the disk is full",
    errno.EDQUOT: "the quota of the disk is used up",
    errno.EIO: "the disk fails",
    errno.EROFS: "the disk is read-only",
    errno.EACCES: "writing is not allowed",
}


class FailingSystem:
    """The module ``os``, whose n-th writing call fails with ``error``, and all after it if the disk stays full."""

    def __init__(self, n, error, stays=False):
        self.left, self.error, self.stays, self.failed = n, error, stays, 0

    def __getattr__(self, name):
        call = getattr(os, name)
        return (lambda *arguments, **options: self._call(name, call, arguments, options)) if name in WRITING else call

    def _call(self, name, call, arguments, options):
        self.left -= 1
        if self.left == 0 or (self.stays and self.left < 0 and name not in ("close", "unlink")):
            self.failed += 1
            if name == "write":
                call(arguments[0], bytes(arguments[1])[: len(arguments[1]) // 2])  # the half that found room
            if name == "close":
                call(*arguments)
            raise OSError(self.error, os.strerror(self.error))
        return call(*arguments, **options)


def fail(monkeypatch, *how):
    system = FailingSystem(*how)
    monkeypatch.setattr(files, "os", system)
    monkeypatch.setattr(storage, "os", system)
    return system


def try_errors(numbers, error, stays, tmp_path, monkeypatch, tried):
    """Run with the n-th call failing for each of ``numbers`` until none fails; each time go on undisturbed."""
    reference, path = tmp_path / "reference", tmp_path / "a"
    run_case(CASE, reference)
    for n in numbers:
        shutil.rmtree(path, ignore_errors=True)
        with monkeypatch.context() as patch:
            system = fail(patch, n, error, stays)
            try:
                outcome = run_case(CASE, path)
            except WriteError as failure:
                assert re.fullmatch(rf"{path}: {SENTENCES[error]} \(\S+\); .+ and give the same command again\.", str(failure))
                assert error != errno.ENOSPC or "make room and" in str(failure)
            else:
                assert outcome.state == "finished"
        tried["errors injected"] += system.failed > 0
        if path.exists():
            RunDirectory(path).faults(), RunDirectory(path).history()  # raise nothing
        assert run_case(CASE, path).state == "finished", n
        assert_same(path, reference)
        assert (path / "summary.png").exists()
        assert not list(path.glob("**/*.part")), n
        if system.failed == 0:
            return
    assert False, "the run has more calls than were tried"


@pytest.mark.fault("a14")
@pytest.mark.parametrize("every", FEW_OR_ALL)
@pytest.mark.parametrize("stays", [False, True])
def test_disk_full_at_any_call(physics, tmp_path, monkeypatch, tried, stays, every):
    try_errors(itertools.count(1 + stays, every), errno.ENOSPC, stays, tmp_path, monkeypatch, tried)


@pytest.mark.fault("a14")
@pytest.mark.parametrize("error", list(SENTENCES)[1:])
def test_other_errors_at_some_calls(physics, tmp_path, monkeypatch, tried, error):
    try_errors(itertools.count(error % 43 + 1, 43), error, False, tmp_path, monkeypatch, tried)


@pytest.mark.verify
@pytest.mark.fault("a14")
@pytest.mark.parametrize("stays", [False, True])
@pytest.mark.parametrize("error", list(SENTENCES)[1:])
def test_other_errors_at_any_call(physics, tmp_path, monkeypatch, tried, error, stays):
    try_errors(itertools.count(1), error, stays, tmp_path, monkeypatch, tried)


@pytest.mark.fault("a14")
@pytest.mark.parametrize("every", FEW_OR_ALL)
@pytest.mark.parametrize("stays", [False, True])
def test_disk_full_when_a_run_goes_on(physics, tmp_path, monkeypatch, tried, stays, every):
    run_case(CASE, tmp_path / "reference")
    physics.before_step = interrupt_at(1)
    run_case(CASE, tmp_path / "begun")
    physics.before_step = staticmethod(lambda steps: None)
    for n in itertools.count(1 + stays, every):
        shutil.rmtree(tmp_path / "a", ignore_errors=True)
        shutil.copytree(tmp_path / "begun", tmp_path / "a")
        with monkeypatch.context() as patch, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            system = fail(patch, n, errno.ENOSPC, stays)
            try:
                run_case(CASE, tmp_path / "a")
            except WriteError as failure:
                assert "the disk is full" in str(failure)
        tried["errors injected"] += system.failed > 0
        assert run_case(CASE, tmp_path / "a").state == "finished"
        assert_same(tmp_path / "a", tmp_path / "reference")
        if system.failed == 0:
            return


# The real thing: errors of the system's own calls, under every library -------------------------------------

FAULTS_C = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/types.h>
#include <unistd.h>
static long left = -1, failed = 0; static int error_number = 0, stays = 0; static char prefix[4096] = "";
void faults_set(long n, int e, int s, const char *p) { left = n; error_number = e; stays = s; failed = 0; strncpy(prefix, p, 4095); }
long faults_failed(void) { return failed; }
static int inside(const char *path) { return prefix[0] && path && strncmp(path, prefix, strlen(prefix)) == 0; }
static int inside_fd(int fd) {
    char link[64], path[4096]; snprintf(link, 64, "/proc/self/fd/%d", fd);
    if (!prefix[0]) return 0;
    ssize_t n = readlink(link, path, 4095); if (n < 0) return 0; path[n] = 0; return inside(path);
}
static int fails(void) {
    if (left < 0 && !(stays && failed)) return 0;
    if (left > 0) { left--; if (left > 0) return 0; left = -1; } else if (!(stays && failed)) return 0;
    failed++; errno = error_number; return 1;
}
#define REAL(name) static __typeof__(name) *real; if (!real) real = dlsym(RTLD_NEXT, #name);
#define OPEN(name) int name(const char *path, int flags, ...) { REAL(name) va_list a; va_start(a, flags); mode_t m = va_arg(a, int); va_end(a); \
    if ((flags & (O_WRONLY | O_RDWR | O_CREAT)) && inside(path) && fails()) return -1; return real(path, flags, m); }
OPEN(open) OPEN(open64)
ssize_t write(int fd, const void *b, size_t n) { REAL(write) if (inside_fd(fd) && fails()) { real(fd, b, n / 2); errno = error_number; return -1; } return real(fd, b, n); }
ssize_t pwrite(int fd, const void *b, size_t n, off_t o) { REAL(pwrite) if (inside_fd(fd) && fails()) return -1; return real(fd, b, n, o); }
ssize_t pwrite64(int fd, const void *b, size_t n, off64_t o) { REAL(pwrite64) if (inside_fd(fd) && fails()) return -1; return real(fd, b, n, o); }
int fsync(int fd) { REAL(fsync) if (inside_fd(fd) && fails()) return -1; return real(fd); }
int ftruncate(int fd, off_t n) { REAL(ftruncate) if (inside_fd(fd) && fails()) return -1; return real(fd, n); }
int rename(const char *a, const char *b) { REAL(rename) if (inside(b) && fails()) return -1; return real(a, b); }
int mkdir(const char *p, mode_t m) { REAL(mkdir) if (inside(p) && fails()) return -1; return real(p, m); }
"""

SERVER = r"""
import ctypes, os, shutil, sys
from pathlib import Path
from vesdyn.case import Case
from vesdyn.cli import main
from vesdyn.run import run_case
from vesdyn.storage import RunDirectory
root, error, every = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
(root / "a.yaml").write_text(
    "name: a\nmodel: axisymmetric\nmesh: {front_edge: 0.03, far_edge: 0.06}\n"
    "time: {end: 0.008, step: 0.002}\noutput: {frames: [0.004], checkpoint_minutes: 0}\n")
faults = ctypes.CDLL(None)
main(["run", str(root / "a.yaml"), "--out", str(root / "reference"), "--quiet"])
path = root / "b"
n, injected = 1, 0
while True:
    shutil.rmtree(path, ignore_errors=True)
    child = os.fork()
    if child == 0:
        sys.stderr = open(root / "words", "w")
        faults.faults_set(n, error, 1, os.fsencode(path))
        status = main(["run", str(root / "a.yaml"), "--out", str(path), "--quiet"])
        sys.stderr.flush()
        os._exit(77 if status == 0 and faults.faults_failed() == 0 else status)
    _, status = os.waitpid(child, 0)
    assert os.WIFEXITED(status), f"call {n}: signal {os.WTERMSIG(status)}"
    status = os.waitstatus_to_exitcode(status)
    words = (root / "words").read_text()
    assert status in (77, 1), (n, status, words)
    assert status == 77 or ("give the same command again." in words and "Traceback" not in words), (n, words)
    assert main(["run", str(root / "a.yaml"), "--out", str(path), "--quiet"]) == 0, n
    for file in ("history.csv", "frames.xdmf", "frames.h5", "summary.png", *(f"frames/000{i}.h5" for i in range(3))):
        assert (path / file).read_bytes() == (root / "reference" / file).read_bytes(), (n, file)
    if status == 77:
        break
    injected += 1
    n += every
print(injected)
"""


@pytest.fixture(scope="module")
def failing_library(tmp_path_factory):
    """A library that, loaded ahead of the others, makes calls of the system fail."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None or sys.platform != "linux":
        pytest.skip("needs a C compiler, on Linux")
    folder = tmp_path_factory.mktemp("failing")
    (folder / "faults.c").write_text(FAULTS_C)
    command = [compiler, "-shared", "-fPIC", "-o", folder / "faults.so", folder / "faults.c", "-ldl"]
    if subprocess.run(command, capture_output=True).returncode:
        pytest.skip("needs a C compiler that makes shared libraries")
    return folder / "faults.so"


def try_real_errors(failing_library, tmp_path, error, every):
    command = [sys.executable, "-c", SERVER, tmp_path, str(error), str(every)]
    done = subprocess.run(
        command, capture_output=True, text=True, env=os.environ | {"LD_PRELOAD": str(failing_library)}
    )
    assert done.returncode == 0, done.stderr[-3000:]
    return int(done.stdout.split()[-1])


@pytest.mark.fault("a14")
def test_real_run_on_a_disk_that_fills_at_some_calls(failing_library, tmp_path, tried):
    tried["errors injected"] += try_real_errors(failing_library, tmp_path, errno.ENOSPC, 60)


@pytest.mark.verify
@pytest.mark.fault("a14")
@pytest.mark.parametrize("error", SENTENCES)
def test_real_run_on_a_disk_that_fails_at_any_call(failing_library, tmp_path, tried, error):
    tried["errors injected"] += try_real_errors(failing_library, tmp_path, error, 1)
