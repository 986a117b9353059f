"""A batch: many cases at once, on the cores of this machine or on a Dask cluster.

A case is carried out by one worker at a time, in DIR/<name>: planned, if it leaves something to be chosen, and run.
What is finished is kept, what was interrupted goes on from its checkpoint, and what no checkpoint can continue is
computed anew. The workers share nothing but the file system, on which a file tells them to stop, by its words or its absence.

A batch never mixes versions: a run of the same case by another version or other sources (`vesdyn.provenance`) is
computed anew, and said so; a worker of another version or other sources is refused. A run of another case is left
alone; that case of the batch fails. A case that another process is computing is waited for.

A Dask network must be trusted: whoever reaches its scheduler can run code on every worker.
"""

import functools
import logging
import multiprocessing
import os
import signal
import socket
import sys
import threading
import time
import uuid
import warnings
from collections import Counter, defaultdict, deque
from collections.abc import Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Future, ProcessPoolExecutor, wait
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

from vesdyn.case import Case, check_is_case
from vesdyn.case_file import load_sweep
from vesdyn.errors import CaseError, RunError
from vesdyn.files import WriteError, make_directory, replace_file, why_no_directory
from vesdyn.interrupts import Forgiving, interrupts, on_terminal
from vesdyn.planning import needs_planning, plan
from vesdyn.provenance import cores, identity
from vesdyn.refusals import LONGEST, printable
from vesdyn.run import Outcome, run_case
from vesdyn.storage import BusyError, DamagedRunError, RunDirectory, RunDirectoryError

_ATTEMPTS = 3  # after as many deaths of its worker process a case is given up
_REFRESH = 0.2  # [s]
_PATIENCE = 10.0  # with a scheduler that does not answer, or has no workers [s]
_DEAF = 1.5  # with workers of this machine after an interrupt [s]
_ELSEWHERE = 1.0  # between two looks at a case that another process computes [s]


class BatchError(CaseError):
    """A batch that cannot begin; one sentence that says what to do."""


def read_cases(configs, overrides=()):
    """Read and validate the cases of the files ``configs``, their sweeps expanded.

    ``overrides`` as for `vesdyn.case_file.load_case`. Raises vesdyn.errors.CaseError with a sentence for each fault of any
    file, and for each name that several cases have.
    """
    cases, faults, files = [], [], defaultdict(list)
    for path in configs:
        try:
            for case in load_sweep(path, overrides):
                cases.append(case)
                files[case.name].append(str(path))
        except CaseError as error:
            faults.append(str(error))
    faults += [
        f"{', '.join(dict.fromkeys(paths))}: name: {name} is the name of {len(paths)} cases of this batch;"
        " give each its own."
        for name, paths in files.items()
        if len(paths) > 1
    ]
    if faults:
        raise CaseError("\n".join(faults))
    return cases


def run_batch(
    cases: Sequence[Case],
    out: str | Path = "runs",
    jobs: int | None = None,
    scheduler: str | None = None,
    restart: bool = False,
    show: bool = True,
    pictures: bool = True,
) -> list[tuple[Case, Outcome]]:
    """Run each of ``cases`` in ``out``/<name>; return a list of (case, `vesdyn.run.Outcome`) in their order.

    ``jobs`` worker processes (by default one a core) on this machine, or the workers of the Dask scheduler at the
    address ``scheduler``, which must see the same files. ``restart`` computes finished runs anew as well. ``show``
    keeps a table on stderr, or a line for each case where that is no terminal; ``pictures`` draws a summary of each
    run, and leaves results.csv and results.png of all in ``out`` (`vesdyn.comparison`). A case that fails is an outcome
    and does not stop the others. An interrupt (SIGINT, SIGTERM, SIGHUP) stores checkpoints and stops; a second one
    stops at once. Processes are spawned: a script that calls this needs its ``if __name__ == "__main__"``.

    Raises `BatchError` if cases share a name, if there is no such cluster, or if one of its workers has another version
    or other sources, and vesdyn.files.WriteError if the results cannot be written.
    """
    for case in cases:
        check_is_case(case)
    if several := [name for name, count in Counter(case.name for case in cases).items() if count > 1]:
        raise BatchError(f"{several[0]}: is the name of several cases of this batch; give each its own.")
    out = RunDirectory(out).path.absolute()
    check_directory(out)
    make_directory(out)
    outcomes, deaths, running, waiting, elsewhere = {}, Counter(), {}, deque(cases), []
    with ExitStack() as stack:
        sign = stack.enter_context(_sign(out))
        asked = stack.enter_context(interrupts())
        workers = stack.enter_context(_local(jobs) if scheduler is None else _Cluster(scheduler))
        free = workers.executors(len(cases))
        stack.push(lambda error, *_: error and sign.stop("an error of the batch"))
        tell = stack.enter_context(_display(cases, out, outcomes, show))
        stopped = None
        while waiting or running or elsewhere:
            if (reason := asked()) and stopped is None:
                sign.stop(reason)  # and all that is left ends by itself
                stopped = time.monotonic()
            if reason and (waiting or elsewhere):
                left = [*waiting, *(case for case, _ in elsewhere)]
                outcomes |= {case.name: Outcome("interrupted", f"not begun, stopped by {reason}.") for case in left}
                waiting.clear(), elsewhere.clear()
                for case in left:
                    tell(case)
            if stopped is not None and time.monotonic() - stopped > _DEAF:
                for future, (case, worker) in running.items():
                    if not sign.heard(case):  # it plans, compiles kernels, or waits for a worker
                        workers.end(future, worker)
            now = time.monotonic()
            waiting += [case for case, later in elsewhere if now >= later]
            elsewhere = [(case, later) for case, later in elsewhere if now < later]
            while waiting and free:
                case, worker = waiting.popleft(), free.pop()
                anew = restart and not (case.name in outcomes and outcomes[case.name].state == "elsewhere")
                running[_submit(worker, case, out / case.name, anew, sign, identity(), pictures)] = case, worker
            if not running:  # all that is left runs elsewhere
                time.sleep(_REFRESH)
            done, _ = wait(running, timeout=_REFRESH, return_when=FIRST_COMPLETED)
            for future in done:
                case, worker = running.pop(future)
                free.append(worker)
                if isinstance(_error(future), BrokenExecutor) and not reason:
                    worker.renew()
                    deaths[case.name] += 1
                    if deaths[case.name] < _ATTEMPTS:
                        waiting.appendleft(case)
                        continue
                outcomes[case.name], doubts = _result(future, reason)
                for sentence in doubts:
                    warnings.warn(f"{case.name}: {sentence}", stacklevel=2)
                if outcomes[case.name].state == "elsewhere":
                    elsewhere.append((case, time.monotonic() + _ELSEWHERE))
                else:
                    tell(case)
            workers.tell_if_none(show)
            tell()
    if pictures and stopped is None:
        from vesdyn.comparison import leave_results  # and matplotlib, which only this needs here

        leave_results([out / case.name for case in cases], out)
    return [(case, outcomes[case.name]) for case in cases]


def check_directory(out):
    """Raise BatchError if no directories can be made in ``out``: it is a file, or may not be written."""
    if fault := why_no_directory(out):
        raise BatchError(f"{printable(str(out), LONGEST)}: {fault}")


class _Sign(NamedTuple):
    """A file on which the batch tells its workers to stop, and others on which they tell that they have heard."""

    file: Path

    def stop(self, reason):
        replace_file(self.file.parent, self.file.name, reason.encode())

    def stopped_by(self, case):
        """Why the worker of ``case`` is to stop, or None; the batch learns that it has heard."""
        try:
            reason = self.file.read_text()
        except FileNotFoundError:
            return "the end of its batch"
        except OSError:  # a network file system that is away for a while
            return None
        if reason:
            with suppress(OSError):
                self._answer(case).touch()
        return reason or None

    def heard(self, case):
        return self._answer(case).exists()

    def _answer(self, case):
        return self.file.with_name(f"{self.file.name}-{case.name}"[:250])


@contextmanager
def _sign(out):
    """Yield a `_Sign` in ``out`` that lasts as long as the batch."""
    here = f".batch-{socket.gethostname()}-"
    for file in out.glob(f"{here}*"):
        if not _lives(file.name.removeprefix(here).split("-")[0]):  # a batch that was killed left it
            file.unlink(missing_ok=True)
    sign = _Sign(out / f"{here}{os.getpid()}-{uuid.uuid4().hex[:8]}")
    sign.stop("")
    try:
        yield sign
    finally:
        for file in out.glob(f"{sign.file.name}*"):
            file.unlink(missing_ok=True)


def _lives(pid):
    try:
        os.kill(int(pid), 0)
    except (ProcessLookupError, ValueError):
        return False
    except OSError:  # another user's
        pass
    return True


def _error(future):
    """What went wrong in the worker, or None."""
    try:
        future.result()
    except CancelledError as error:  # no Exception
        return error
    except Exception as error:
        return error


def _result(future, stopped):
    """What `_carry_out` returned, or a failure in its place; ``stopped`` is by what the batch was stopped, or None."""
    match _error(future):
        case None:
            return future.result()
        case BrokenExecutor() | CancelledError() if stopped:
            return Outcome("interrupted", f"stopped at once by {stopped}."), []
        case BrokenExecutor():
            reason = f"its process died {_ATTEMPTS} times; is there memory for so many --jobs?"
        case CancelledError():
            reason = "the scheduler was lost; give the same command to another one, to go on."
        case RunError() as error:
            reason = str(error)
        case error:
            reason = f"{type(error).__name__}: {error}"
    return Outcome("failed", reason, disturbed=True), []


# In the worker -------------------------------------------------------------------------------------------


def _carry_out(case, path, restart, sign, wanted, picture=True):
    """Plan and run one case in the directory ``path``; return its outcome and the sentences it warned of.

    ``sign`` (`_Sign`) tells when to stop; ``wanted`` is the `vesdyn.provenance.identity` of the batch;
    ``picture`` says whether a summary is drawn.
    """
    stop = functools.partial(sign.stopped_by, case)
    if reason := stop():
        return Outcome("interrupted", f"not begun, stopped by {reason}."), []
    if _named(identity()) != _named(wanted):
        reason = f"its worker has {_named(identity())}, the batch {_named(wanted)}."
        return Outcome("failed", reason, disturbed=True), []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            outcome = _compute(case, path, restart, stop, picture)
        except BusyError:
            outcome = Outcome("elsewhere", "another process computes it.")
        except (CaseError, RunError) as error:
            outcome = Outcome("failed", str(error), disturbed=isinstance(error, (WriteError, RunDirectoryError)))
    return outcome, [str(doubt.message) for doubt in caught if doubt.category is UserWarning]


def _compute(case, path, restart, stop, picture):
    case, decisions = plan(case) if needs_planning(case) else (case, ())
    restart = restart or _is_of_others(case, RunDirectory(path))
    run = functools.partial(run_case, case, path, progress=False, decisions=decisions, stop=stop, picture=picture)
    try:
        return run(restart=restart)
    except DamagedRunError as damage:
        warnings.warn(f"{damage} The batch does.")
        return run(restart=True)


def _is_of_others(case, directory):
    """True, and said, where the directory holds a run of ``case`` that another version or other sources computed."""
    if (origin := directory.origin()) is None:
        return False
    try:
        directory.check_same(case)
    except DamagedRunError:
        return False  # found again, and told, by `run_case`
    parts = [origin, *(origin.get("resumed_with") or [])]
    others = [part for part in parts if _named(part) != _named(identity())]
    if not others:
        return False
    warnings.warn(
        f"{directory.path}: holds a run by {_named(others[0])}; {_named(identity())} computes it anew."
    )
    return True


def _named(identity):
    """Version and sources in words."""
    return f"vesdyn {identity.get('vesdyn')} (sources {str(identity.get('sources'))[:12]})"


# Workers -------------------------------------------------------------------------------------------------


class _Process:
    """An executor of one process, so that its death concerns one case only."""

    def __init__(self):
        self.children = set()
        self.renew()

    def renew(self):
        self.executor = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), _end_with_parent)

    def submit(self, *task):
        before = set(multiprocessing.active_children())
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # a process begun here leaves Ctrl-C to this one
        try:
            return self.executor.submit(*task)
        finally:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
            self.children |= set(multiprocessing.active_children()) - before

    def kill(self):
        for child in self.children:
            child.kill()


def _end_with_parent():
    """Let this process die with its parent, however that ends."""

    def watch():
        multiprocessing.parent_process().join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


class _Local:
    """Worker processes of this machine, each of which takes one case at a time."""

    def __init__(self, jobs):
        self.workers = [_Process() for _ in range(jobs)]

    def executors(self, n_cases):
        return list(self.workers)

    def end(self, future, worker):
        worker.kill()

    def tell_if_none(self, wanted):
        pass


@contextmanager
def _local(jobs):
    """Yield the worker processes; those that are still busy when an error or interrupt leads out are killed."""
    workers = _Local(jobs or cores())
    try:
        yield workers
    except BaseException:
        for worker in workers.workers:
            worker.kill()
        raise
    finally:
        for worker in workers.workers:
            worker.executor.shutdown()


class _Cluster:
    """The workers of a Dask scheduler, which queues the cases and replaces lost workers."""

    def __init__(self, address):
        self.address = address
        self._began = self._next_look = time.monotonic()
        self._told, self._checked = False, set()

    def __enter__(self):
        try:
            from distributed import Client
        except ImportError:
            raise BatchError("--scheduler: needs the package distributed; `pip install 'vesdyn[cluster]'`.") from None
        loggers = (logging.getLogger(name) for name in list(logging.root.manager.loggerDict))
        self._levels = {
            logger: logger.level for logger in loggers if logger.name.split(".")[0] in ("distributed", "tornado", "asyncio")
        }
        for logger in self._levels:
            logger.setLevel(logging.CRITICAL + 1)  # a lost scheduler is told in one sentence
        try:
            self.client = Client(self.address, timeout=_PATIENCE)
        except (OSError, ValueError) as error:
            self._restore_loggers()
            raise BatchError(f"--scheduler {self.address}: no answer ({error}); give that of a dask scheduler.") from None
        try:
            self._check_workers()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        lost = self.client.status != "running"
        self.client.close(timeout=2)
        if not lost:  # else its attempts to connect again are told until the process ends
            self._restore_loggers()

    def _restore_loggers(self):
        for logger, level in self._levels.items():
            logger.setLevel(level)

    def _workers(self):
        try:
            return set(self.client.nthreads()) if self.client.status == "running" else set()
        except OSError:
            return set()

    def _check_workers(self):
        """Compare version and sources of each worker that has come since with this process's own."""
        new = self._workers() - self._checked
        if not new:
            return

        def look():  # nested, so that it is sent as it is and not looked up in another version
            try:
                from vesdyn.provenance import identity
            except ImportError:
                try:
                    from vesdyn import __version__
                except ImportError:
                    return None
                return {"vesdyn": __version__, "sources": "unknown"}
            return identity()

        ours = identity()
        try:
            answers = self.client.run(look, workers=sorted(new), on_error="return")
        except OSError as error:
            raise BatchError(f"--scheduler {self.address}: was lost ({error}); give the command again.") from None
        for worker, theirs in answers.items():
            if not isinstance(theirs, dict):
                raise BatchError(f"--scheduler: the worker {worker} has no vesdyn; install {ours['vesdyn']} there.")
            for part in ("vesdyn", "sources"):
                if theirs[part] != ours[part]:
                    raise BatchError(
                        f"--scheduler: the worker {worker} has {_named(theirs)}, this process {_named(ours)};"
                        " install the same on both."
                    )
            others = [f"{part} {theirs[part]} for {ours[part]}" for part in ours if theirs.get(part) != ours[part]]
            if others:
                warnings.warn(f"the worker {worker} has {', '.join(others)}; last bits may differ.", stacklevel=2)
        self._checked |= new

    def executors(self, n_cases):
        return [self.client.get_executor(pure=False)] * n_cases

    def end(self, future, worker):
        future.cancel()

    def tell_if_none(self, wanted):
        """Say so if the scheduler has had no workers for long, and look at those that came."""
        if time.monotonic() < self._next_look:
            return
        self._next_look = time.monotonic() + _ELSEWHERE
        if self._workers():
            self._check_workers()
        elif not self._told and time.monotonic() - self._began > _PATIENCE:
            self._told = True
            if wanted:
                print(f"vesdyn: the scheduler {self.address} has no workers yet; waiting for some.", file=sys.stderr)


def _submit(worker, *task):
    """Hand ``task`` to ``worker``; a process that died idle shows in the future, as one that dies busy."""
    try:
        return worker.submit(_carry_out, *task)
    except BrokenExecutor as error:
        future = Future()
        future.set_exception(error)
        return future


# On the terminal -----------------------------------------------------------------------------------------


@contextmanager
def _display(cases, out, outcomes, wanted):
    """Yield a function to call now and then, and with each case that is done."""
    if not wanted:
        yield lambda case=None: None
    elif not on_terminal(sys.stderr):
        words = Forgiving(sys.stderr)
        yield lambda case=None: case and print(_line(case, outcomes[case.name]), file=words, flush=True)
    else:
        from rich.console import Console
        from rich.live import Live

        began = time.time()
        with Live(console=Console(file=Forgiving(sys.stderr)), auto_refresh=False) as live:
            yield lambda case=None: live.update(_table(cases, out, outcomes, began), refresh=True)


def _line(case, outcome):
    figures = f"t = {outcome.time:g}, binding area {outcome.binding_area:.4f}, {outcome.wall_time:.1f} s"
    return f"{case.name}: {outcome.state}, {figures}" + (f"; {outcome.reason}" if outcome.reason else "")


def _table(cases, out, outcomes, began):
    from rich.table import Table
    from rich.text import Text

    table = Table("case", "state", "t", "of", "binding area", "wall time [s]", "")
    for case in cases:
        o = outcomes.get(case.name) or _standing(RunDirectory(out / case.name), began)
        figures = (f"{o.time:.4f}", f"{case.time.end:g}", f"{o.binding_area:.4f}", f"{o.wall_time:.1f}")
        table.add_row(*map(Text, (case.name, o.state, *figures, o.reason)))
    return table


def _standing(directory, began):
    """The outcome so far of a case that is not done, read from its directory."""
    try:
        touched = directory.status_file.stat().st_mtime
    except OSError:
        touched = 0.0
    row, status = directory.last_row(), directory.status()
    if touched < began or not status:
        return Outcome("waiting", "")
    wall_time = status["wall_time"] + time.time() - touched
    return Outcome("running", "", row.get("time", 0.0), 0, wall_time, row.get("binding_area", 0.0))
