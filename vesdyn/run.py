"""A run: the case is carried from where the directory left it to its end, and may be stopped at any time.

The times of the steps follow from the case alone, so an interrupted run and an uninterrupted one give the
same bits.
"""

import math
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vesdyn.balance import NoBalanceError
from vesdyn.budget import FIXED_STEP_ERROR, WISHED_FROM
from vesdyn.case import Case, check_is_case
from vesdyn.diagnostics import COLUMNS, Column, Moment, own_columns
from vesdyn.files import WriteError
from vesdyn.interrupts import Forgiving, interrupts, on_terminal
from vesdyn.kinds import KINDS
from vesdyn.planning import compression_note, needs_planning, plan
from vesdyn.spreading import Spreading
from vesdyn.stepping import is_over, march
from vesdyn.storage import RunDirectory

_ROUNDED = 1.1  # of the wish: edges are chosen to two digits
_NEARNESS_TOLD = 0.25  # of the binding area: more that touches nothing is told
_ASSUMED_RADIUS = 0.15  # [a0] of the front when the wish begins to count, before that is known; the paper's: 0.1 to 0.3


@dataclass(frozen=True)
class Outcome:
    """How a run ended, and its figures so far.

    ``state`` is finished, interrupted or failed, ``reason`` a sentence; ``time`` [a0^2/D] and ``steps`` from
    t = 0; ``wall_time`` [s] over all sittings; ``binding_area`` [a0^2] is the last and ``area_error`` the relative
    error that it is believed to have, NaN where that is not known; ``volume_error`` and ``receptor_number_error`` are
    the largest relative ones of any step; ``note`` is what the run could not show or keep. A failure is ``disturbed``
    where the scene has no part in it, but a full disk, a lost process or the like.
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
    area_error: float = math.nan
    disturbed: bool = False

    @property
    def exit_status(self):
        return {"finished": 0, "failed": 1, "interrupted": 130}[self.state]


def simulate(case: Case, columns: Sequence[Column] = ()) -> Iterator[Moment]:
    """Compute ``case`` step by step: an iterator of a `Moment` after each coupling step; nothing is stored.

    What the case leaves to be chosen (`auto`) is planned first. ``columns`` are further `vesdyn.Column`.
    Raises CaseError for a case or columns that cannot be used, and on the way RunError where no balance is found.
    """
    check_is_case(case)
    columns = own_columns(columns)
    sim = Spreading(plan(case).case if needs_planning(case) else case)
    return (Moment(sim, state, columns) for state in march(sim))


def run_case(
    case: Case,
    directory: str | Path,
    on_step: Callable[[Moment], object] = lambda moment: None,
    columns: Sequence[Column] = (),
    progress: bool = True,
    restart: bool = False,
    decisions: Sequence[str] = (),
    stop: Callable[[], str | None] = lambda: None,
    picture: bool = True,
) -> Outcome:
    """Run ``case`` in ``directory`` (a path) from where it stands there to its end; return the ``Outcome``.

    What the case leaves to be chosen (`auto`) is planned first. ``on_step`` is called with a
    `vesdyn.diagnostics.Moment` after each step and may return a reason to stop there, as if interrupted (a few words, or
    True); ``columns`` are further `vesdyn.Column` of the history.

    An interrupt (SIGINT, SIGTERM, SIGHUP) gives the step in hand up, stores a checkpoint and stops; a second one
    stops at once, and what was done since the last checkpoint is done again later. ``progress`` shows a bar
    if stderr is a terminal. ``restart`` removes an earlier run first. ``decisions`` are stored with the case.
    ``stop`` is asked every few tenths of a second for a reason to stop. Without ``picture`` no summary is drawn.

    Raises CaseError for a case that cannot be used, vesdyn.storage.RunDirectoryError if the directory cannot take
    the run, and vesdyn.files.WriteError if a file cannot be written. A step for which no balance is found is no
    exception but an outcome.
    """
    check_is_case(case)
    columns = own_columns(columns)
    directory = RunDirectory(directory)
    directory.check_usable()
    if needs_planning(case):
        case, decisions = plan(case)
    with directory.claim(case, restart, decisions):
        if directory.status().get("state") == "finished":
            directory.verify(directory.finished_marks())
            for name in directory.mend(_described(case, columns)):
                warnings.warn(f"{directory.path}: {name} was damaged or gone and is made anew.", stacklevel=2)
            if picture and not directory.summary_file.exists():
                _draw(directory)
                status = directory.status()
                directory.write_status("finished", status["reason"], status["wall_time"])
            return _outcome(case, directory, "is finished already; `vesdyn run --restart` computes it anew.")
        for sentence in [*case.warnings(), *missed_wish(case)]:
            warnings.warn(sentence, stacklevel=2)
        with interrupts() as asked:
            _advance(case, directory, columns, on_step, lambda: asked() or stop(), progress, picture)
        return _outcome(case, directory)


def _advance(case, directory, columns, on_step, interruption, progress, picture):
    """Take the coupling steps that are left, until ``interruption()``; the last status written says how it ended."""
    began = time.monotonic() - directory.status().get("wall_time", 0.0)

    def settle(state, reason=""):
        directory.write_status(state, reason, time.monotonic() - began)

    def pause():
        if reason := interruption():
            raise _Interrupted(reason)

    try:
        sim, state = _start(case, directory, columns)
        settle("running")
        saved = time.monotonic()
        reason, failure = None, None
        with _progress_bar(state.time, case.time.end, progress) as show:
            try:
                for state in march(sim, state, pause):
                    moment, done = Moment(sim, state, columns), is_over(sim, state)
                    row = moment.row()
                    directory.append_history(row)
                    show(row)
                    if state.time in case.output.frames or done:
                        directory.write_frame(state.time, *moment.frame())
                    reason = on_step(moment)
                    reason = None if done else interruption() or _in_words(reason)
                    if reason:
                        break
                    if time.monotonic() - saved >= 60 * case.output.checkpoint_minutes:
                        directory.write_checkpoint(sim.stored(state))
                        settle("running")
                        saved = time.monotonic()
            except _Interrupted as interrupted:
                reason = str(interrupted)
            except NoBalanceError as error:
                failure = error
        directory.write_checkpoint(sim.stored(state))
        if failure:
            settle("failed", str(failure))
        elif reason:
            settle("interrupted", f"stopped by {reason}.")
        else:
            rest = _rest(case, directory, Moment(sim, state))
            if picture:
                _draw(directory)
            settle("finished", rest)
    except KeyboardInterrupt:
        settle("interrupted", "stopped at once by an interrupt.")
    except WriteError as error:
        with suppress(WriteError):  # the disk may still be full
            settle("failed", str(error))
        raise
    except Exception as error:
        settle("failed", f"{type(error).__name__}: {error}")
        raise


def _in_words(reason):
    """What ``on_step`` returned as a reason to stop, or None."""
    return reason if not reason or isinstance(reason, str) else "on_step"


class _Interrupted(Exception):
    """The step in hand is given up; the reason."""


def _start(case, directory, columns):
    """Return the scene and its state as the directory left it: at its checkpoint, or else at t = 0."""
    sim = Spreading(case)
    checkpoint = directory.restore(case)
    directory.write_columns(_described(case, columns))
    if checkpoint is None:
        state = sim.start()
        directory.write_frame(state.time, *Moment(sim, state).frame())
        return sim, state
    try:
        return sim, sim.restored(checkpoint)
    except ValueError as error:
        raise directory.remedy(error) from None


def _described(case, columns):
    """Name, unit and meaning of each column of the history, and the unit in SI where the case gives its scales."""
    described = [(column.name, column.unit, column.meaning) for column in (*COLUMNS, *columns)]
    scales = case.scales
    return [(*one, scales.in_si(one[1])) for one in described] if scales else described


def _rest(case, directory, moment):
    """Store the frames that are left, all of the resting state; return a sentence on it, or nothing."""
    if moment.time == case.time.end:
        return ""
    left = [t for t in case.output.frames if t > moment.time]
    for t in left:
        directory.write_frame(t, *moment.frame())
    directory.write_series()
    shown = f"; the frames at {', '.join(f'{t:g}' for t in left)} show this resting state" if left else ""
    return f"steady at t = {moment.time:.4g}{shown}."


def missed_wish(case, history=None):
    """Return a sentence for each of the given mesh and step that cannot keep the accuracy that was given.

    ``history`` maps columns to arrays and tells where the front was when the wish began to count; without it a radius
    is assumed.
    """
    if case.mesh.file is not None:
        return []
    early = [] if history is None else history["contact_radius"][_counts(history)]
    radius = early[0] if len(early) and early[0] > 0.0 else _ASSUMED_RADIUS
    mesh_error = KINDS[case.model].mesh_error(case.mesh, case.membrane.thickness > 0.0)
    step_error = 0.0 if case.time.step == "auto" else FIXED_STEP_ERROR[case.time.order] * case.time.step
    return case.missed_wish(mesh_error.at(case.mesh.front_edge, radius), step_error)


def _counts(history):
    """Whether the accuracy wish holds at each step: from WISHED_FROM of the last binding area on."""
    return history["binding_area"] >= WISHED_FROM * history["binding_area"][-1]


def _notes(case, history):
    """What the run could not show or keep, in one sentence, or None."""
    notes = [compression_note(case, history)]
    if "contact_radius" in history and len(history["time"]):
        notes += missed_wish(case, history)
    if "area_error" in history and len(history["time"]):
        believed = np.max(history["area_error"][_counts(history)])
        if believed > case.accuracy * _ROUNDED:
            notes.append(
                f"the binding area is believed to be off by up to {believed:.2g} of itself, more than the wish of"
                f" {case.accuracy:.2g}; give a smaller accuracy with edges and step `auto`, or finer ones"
            )
    if "near_area" in history and len(history["time"]):
        near, area = history["near_area"][-1], history["binding_area"][-1]
        if near > _NEARNESS_TOLD * area:
            notes.append(
                f"{near:.3g} a0^2 of the binding area, {near / area:.0%} of it, is membrane that is closer than 0.02 of the"
                " cutoff and touches nothing"
            )
    return "; ".join(note.rstrip(".") for note in notes if note) or None


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
        note=_notes(case, history),
        area_error=last("area_error") if "area_error" in history else math.nan,
    )


def _draw(directory):
    """Draw the picture of a run that came to its end; a failure to do so is warned of."""
    from vesdyn.pictures import summary  # here: matplotlib is slow to import, and only a finished run needs it

    try:
        summary(directory.path)
    except WriteError:
        raise
    except Exception as error:
        warnings.warn(f"{directory.path}: no picture could be drawn ({type(error).__name__}: {error}).", stacklevel=3)


@contextmanager
def _progress_bar(start, end, wanted):
    """Yield a function that shows a row of the history: t, binding area, residual, time left."""
    if not (wanted and on_terminal(sys.stderr)):
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
    with Progress(*columns, console=Console(file=Forgiving(sys.stderr))) as bar:
        task = bar.add_task("", total=end, completed=start, time=start, binding_area=0.0, residual=0.0)

        def show(row):
            bar.update(task, completed=row["time"], **{k: row[k] for k in ("time", "binding_area", "residual")})

        yield show
