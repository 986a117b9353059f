"""An interrupt is heard wherever the program is; a second one stops at once."""

import itertools
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from stand_in import assert_same, interrupt_at

from vesdyn import batch, interrupts
from vesdyn.case import Case
from vesdyn.run import run_case
from vesdyn.storage import RunDirectory

CASE = Case(name="a", time={"end": 0.006, "step": 0.001}, output={"frames": (0.002,), "checkpoint_minutes": 60.0})
AUTO = "name: q\nmodel: auto\naccuracy: 0.5%\nmesh: auto\ntime: {end: 0.4, step: auto}\noutput: {frames: [], checkpoint_minutes: 0}\n"


FEW = [(signal.SIGINT, 0.0), (signal.SIGTERM, 0.3)]
MOMENTS = [
    pytest.param(number, delay, marks=[] if (number, delay) in FEW else pytest.mark.verify)
    for number in (signal.SIGINT, signal.SIGTERM)
    for delay in (0.0, 0.3, 1.5, 3.0)
]


def run_python(code, *signals, after="ready"):
    """Run ``code`` in a process, send it ``signals`` once it says ``after``; return status and stderr."""
    heard = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # ignored in background jobs
    process = subprocess.Popen(
        [sys.executable, "-c", heard + code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    assert process.stdout.readline().strip() == after
    for number in signals:
        process.send_signal(number)
        time.sleep(0.2)
    try:
        _, words = process.communicate(timeout=60)
    finally:
        process.kill()
    return process.returncode, words


@pytest.mark.fault("a13")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_process_that_never_comes_to_its_turn_is_ended(tried, number):
    """As in a compiler: a long call of a library, during which Python does not run its handlers."""
    tried["interrupts"] += 1
    code = (
        "import hashlib\nfrom vesdyn import interrupts\ninterrupts.watch()\n"
        "with interrupts.interrupts() as asked:\n    print('ready', flush=True)\n    hashlib.pbkdf2_hmac('sha256', b'a', b'b', 2**31 - 1)"
    )
    began = time.monotonic()
    status, words = run_python(code, number)  # the call would take a quarter of an hour
    assert status == 130 and "Traceback" not in words and "give the same command again" in words
    tried["seconds, longest wait after an interrupt"] = max(
        tried["seconds, longest wait after an interrupt"], round(time.monotonic() - began)
    )


@pytest.mark.fault("a13")
def test_loop_that_does_not_ask_gets_a_keyboard_interrupt(monkeypatch, tried):
    monkeypatch.setattr(interrupts, "PATIENCE", 0.05)
    tried["interrupts"] += 1
    with pytest.raises(KeyboardInterrupt):
        with interrupts.interrupts():
            signal.raise_signal(signal.SIGINT)
            for _ in range(100):
                time.sleep(0.05)


@pytest.mark.fault("a13")
def test_loop_that_asks_is_left_alone(monkeypatch, tried):
    monkeypatch.setattr(interrupts, "PATIENCE", 0.05)
    tried["interrupts"] += 1
    with interrupts.interrupts() as asked:
        assert asked() is None
        signal.raise_signal(signal.SIGTERM)
        assert asked() == "SIGTERM"
        try:
            time.sleep(0.2)
        except KeyboardInterrupt:
            pytest.fail("interrupted, though the loop asks")
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)


@pytest.mark.fault("a13")
def test_hangup_is_an_interrupt_but_under_nohup(physics, tmp_path, tried):
    """A terminal that closes, or a connection that ends."""
    run_case(CASE, tmp_path / "reference")
    tried["interrupts"] += 2
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    try:
        physics.before_step = interrupt_at(3, [signal.SIGHUP])
        outcome = run_case(CASE, tmp_path / "a")
        assert (outcome.state, outcome.reason) == ("interrupted", "stopped by SIGHUP.")
        signal.signal(signal.SIGHUP, signal.SIG_IGN)
        assert run_case(CASE, tmp_path / "a").state == "finished"
    finally:
        signal.signal(signal.SIGHUP, before)
    assert_same(tmp_path / "a", tmp_path / "reference")


@pytest.mark.fault("a13")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_retries_hear_an_interrupt(physics, tmp_path, tried, number):
    """A step that is retried asks ``pause`` in between; the state before it is stored."""
    tried["interrupts"] += 1
    run_case(CASE, tmp_path / "reference")
    advance = physics.advance

    def retried(self, state, until, pause):
        if state.steps == 3:
            signal.raise_signal(number)
            for _ in range(1000):
                pause()
            raise AssertionError("the interrupt was not heard")
        return advance(self, state, until, pause)

    physics.advance = retried
    try:
        outcome = run_case(CASE, tmp_path / "a")
    finally:
        physics.advance = advance
    assert (outcome.state, outcome.steps) == ("interrupted", 3) and number.name in outcome.reason
    assert RunDirectory(tmp_path / "a").read_checkpoint()["steps"] == 3
    run_case(CASE, tmp_path / "a")
    assert_same(tmp_path / "a", tmp_path / "reference")


def _hears(process, number):
    """Wait until the process has set its handler of the signal; before that the interpreter itself ends it."""
    caught = Path(f"/proc/{process}/status")
    while caught.exists():
        mask = int(re.search(r"SigCgt:\s*(\w+)", caught.read_text()).group(1), 16)
        if mask >> (number - 1) & 1:
            return True
        time.sleep(0.002)
    time.sleep(0.5)  # a system that does not tell
    return True


@pytest.mark.fault("a13")
@pytest.mark.parametrize("number, delay", MOMENTS)
def test_interrupt_at_some_moment_of_a_real_run(tmp_path, tried, number, delay):
    (tmp_path / "q.yaml").write_text(AUTO)
    command = [sys.executable, "-m", "vesdyn", "run", tmp_path / "q.yaml", "--out", tmp_path / "r"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)
    assert process.poll() is None and _hears(process.pid, signal.SIGTERM)
    time.sleep(delay)
    tried["interrupts"] += 1
    sent = time.monotonic()
    process.send_signal(number)
    _, words = process.communicate(timeout=60)
    waited = time.monotonic() - sent
    assert process.returncode in (130, 0) and "Traceback" not in words, words
    what = "seconds, longest wait after an interrupt"
    tried[what] = max(tried[what], round(waited))


@pytest.mark.fault("n16")
def test_scheduler_without_workers_is_told_and_hears_an_interrupt(tmp_path, capfd, monkeypatch, tried):
    from distributed import LocalCluster

    monkeypatch.setattr(batch, "_PATIENCE", 0.3)
    monkeypatch.setattr(batch, "_ELSEWHERE", 0.1)
    tried["interrupts"] += 1
    looks, look = itertools.count(), batch._Cluster.tell_if_none

    def look_and_interrupt(cluster, wanted):
        told = cluster._told
        look(cluster, wanted)
        if cluster._told > told or next(looks) == 100:  # once: a second interrupt would stop at once
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(batch._Cluster, "tell_if_none", look_and_interrupt)
    with LocalCluster(n_workers=0, dashboard_address=None, processes=False) as cluster:
        cases = [CASE.model_copy(update={"name": name}) for name in "ab"]
        results = batch.run_batch(cases, tmp_path, scheduler=cluster.scheduler_address)
    assert [outcome.state for _, outcome in results] == 2 * ["interrupted"]
    words = capfd.readouterr().err
    assert "has no workers yet; waiting for some." in words and "Traceback" not in words


@pytest.mark.verify
@pytest.mark.fault("n16")
def test_killed_scheduler_is_one_sentence(tmp_path, tried):
    scheduler = subprocess.Popen(
        [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard",
         "--scheduler-file", tmp_path / "s.json"], stderr=subprocess.DEVNULL,
    )  # fmt: skip
    import json

    while not (tmp_path / "s.json").exists() or not (tmp_path / "s.json").read_text():
        time.sleep(0.1)
    address = json.loads((tmp_path / "s.json").read_text())["address"]
    (tmp_path / "q.yaml").write_text(AUTO)
    process = subprocess.Popen(
        [sys.executable, "-m", "vesdyn", "batch", tmp_path / "q.yaml", "--out", tmp_path / "r", "--scheduler", address],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    time.sleep(6.0)
    tried["neighbours"] += 1
    scheduler.kill()
    scheduler.wait()
    _, words = process.communicate(timeout=120)
    assert process.returncode == 1 and "Traceback" not in words
    assert "the scheduler was lost" in words and len(words.splitlines()) <= 4
