"""A run: the case is carried from where the directory left it to its end, and may be stopped at any time.

The times of the steps follow from the case alone, so an interrupted run and an uninterrupted one give the
same bits.
"""

import copy
import signal
import sys
import threading
import time
import warnings
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from vesdyn.planning import compression_note
from vesdyn.relaxation import RelaxationError
from vesdyn.spreading import Spreading
from vesdyn.stepping import is_steady, step
from vesdyn.storage import DamagedRunError, RunDirectory


@dataclass(frozen=True)
class Outcome:
    """How a run ended, and its figures so far.

    ``state`` is finished, interrupted or failed, ``reason`` a sentence; ``time`` [a0^2/D] and ``steps`` from
    t = 0; ``wall_time`` [s] over all sittings; ``binding_area`` [a0^2] is the last, ``volume_error`` and
    ``receptor_number_error`` the largest relative ones of any step; ``note`` what the body could not show.
    """

    state: str
    reason: str
    time: float = 0.0
    steps: int = 0
    wall_time: float = 0.0
    binding_area: float = 0.0
    volume_error: float = 0.0
    receptor_number_error: float = 0.0
    note: str | None = None

    @property
    def exit_status(self):
        return {"finished": 0, "failed": 1, "interrupted": 130}[self.state]


def run_case(case, directory, progress=True, restart=False, decisions=(), stop=lambda: None):
    """Run ``case`` in ``directory`` (a path) from where it stands there to its end; return the ``Outcome``.

    An interrupt (SIGINT, SIGTERM) lets the step in hand finish, stores a checkpoint and stops; a second one
    stops at once, and what was done since the last checkpoint is done again later. ``progress`` shows a bar
    if stderr is a terminal. ``restart`` removes an earlier run first. ``decisions`` are stored with the case.
    ``stop`` is asked after each step for a reason to stop there, as if interrupted.

    Raises vesdyn.storage.RunDirectoryError if the directory cannot take the run. A relaxation that fails is
    no exception but an outcome.
    """
    directory = RunDirectory(directory)
    with directory.claim(case, restart, decisions):
        if directory.status().get("state") == "finished":
            if not directory.summary_file.exists():
                _draw(directory)
            return _outcome(case, directory, "is finished already; `vesdyn run --restart` computes it anew.")
        for sentence in case.warnings():
            warnings.warn(sentence, stacklevel=2)
        with interrupts() as received:
            _advance(case, directory, lambda: received[0] if received else stop(), progress)
        if directory.status()["state"] == "finished":
            _draw(directory)
        return _outcome(case, directory)


def _advance(case, directory, interruption, progress):
    """Take the coupling steps that are left, until ``interruption()``; the last status written says how it ended."""
    began = time.monotonic() - directory.status().get("wall_time", 0.0)

    front_moves = case.perturbation.front > 0

    def settle(state, reason=""):
        directory.write_status(state, reason, time.monotonic() - began)

    settle("running")
    try:
        sim = _start(case, directory)
        saved = time.monotonic()
        with _progress_bar(sim.time, case.time.end, progress) as show:
            done = _is_over(case, sim)
            while not done:
                last_good = copy.deepcopy(sim.state())
                if front_moves and sim.time == case.perturbation.at:
                    sim.perturb_front()  # no part of the state stored at that time: neither lost nor done twice
                try:
                    step(sim, next(t for t in case.stops if t > sim.time))
                except RelaxationError as failure:
                    directory.write_checkpoint(last_good)
                    return settle("failed", str(failure))
                row = sim.history_row()
                directory.append_history(row)
                show(row)
                done = _is_over(case, sim)
                if sim.time in case.output.frames or (done and sim.time < case.time.end):
                    directory.write_frame(sim.time, *sim.frame())
                interrupted_by = interruption()
                if done or interrupted_by or time.monotonic() - saved >= 60 * case.output.checkpoint_minutes:
                    directory.write_checkpoint(sim.state())
                    settle("running")
                    saved = time.monotonic()
                if interrupted_by and not done:
                    return settle("interrupted", f"stopped by {interrupted_by}.")
        settle("finished", f"steady at t = {sim.time:.4g}." if sim.time < case.time.end else "")
    except KeyboardInterrupt:
        settle("interrupted", "stopped at once by a second interrupt.")
    except Exception as error:
        settle("failed", f"{type(error).__name__}: {error}")
        raise


def _is_over(case, sim):
    """True where the time of the run is up, or nothing moves any more nor will be moved."""
    if case.perturbation.front > 0 and sim.time <= case.perturbation.at:
        return False
    steady = case.time.step == "auto" and case.time.stop_when_steady and is_steady(sim)
    return steady or sim.time == case.time.end


def _start(case, directory):
    """Return the simulation as the directory left it: at its checkpoint, or else at t = 0."""
    sim = Spreading(case)
    checkpoint = directory.read_checkpoint()
    if checkpoint is None:
        directory.clear_results()
        directory.write_frame(sim.time, *sim.frame())
    else:
        try:
            sim.restore(checkpoint)
        except ValueError as error:
            raise DamagedRunError(f"{directory.path}: {error}; start it anew with --restart.") from None
        directory.rewind(sim.time)
    return sim


def _outcome(case, directory, reason=None):
    """Return the outcome that the stored status and history tell."""
    status, history = directory.status(), directory.history()

    def last(column):
        return float(history[column][-1]) if history else 0.0

    def largest(column):
        return float(np.max(np.abs(history[column]))) if history else 0.0

    return Outcome(
        state=status["state"],
        reason=reason or status["reason"],
        time=last("time"),
        steps=len(history.get("time", ())),
        wall_time=status["wall_time"],
        binding_area=last("binding_area"),
        volume_error=largest("volume_error"),
        receptor_number_error=largest("receptor_number_error"),
        note=compression_note(case, history),
    )


def _draw(directory):
    from vesdyn.pictures import summary  # here: matplotlib is slow to import, and only a finished run needs it

    summary(directory.path)


@contextmanager
def interrupts():
    """Yield a list that receives the name of the first SIGINT or SIGTERM; a second signal acts as ever."""
    received = []
    if threading.current_thread() is not threading.main_thread():  # only the main thread may handle signals
        yield received
        return
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}

    def restore():
        for number, handler in before.items():
            signal.signal(number, handler)

    def receive(number, _):
        received.append(signal.Signals(number).name)
        restore()

    for number in before:
        signal.signal(number, receive)
    try:
        yield received
    finally:
        restore()


@contextmanager
def _progress_bar(start, end, wanted):
    """Yield a function that shows a row of the history: t, binding area, residual, time left."""
    if not (wanted and sys.stderr.isatty()):
        yield lambda row: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("t = {task.fields[time]:.4f}"),
        BarColumn(),
        TextColumn("binding area {task.fields[binding_area]:.4f}  residual {task.fields[residual]:.1e}"),
        TimeRemainingColumn(),
        TextColumn("left"),
    )
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task("", total=end, completed=start, time=start, binding_area=0.0, residual=0.0)

        def show(row):
            bar.update(task, completed=row["time"], **{k: row[k] for k in ("time", "binding_area", "residual")})

        yield show
