"""A batch: many cases at once, on the cores of this machine or on a Dask cluster.

A case is carried out by one worker at a time, in DIR/<name>: planned, if it leaves something to be chosen, and run.
What is finished is kept, what was interrupted goes on from its checkpoint, and what no checkpoint can continue is
computed anew. The workers share nothing but the file system, on which a file tells them to stop.

A batch never mixes versions: a run of the same case by another ``vesdyn.__version__`` is computed anew, and said so.
A run of another case is left alone; that case of the batch fails.
"""

import functools
import multiprocessing
import os
import signal
import sys
import threading
import time
import uuid
import warnings
from collections import Counter, defaultdict, deque
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Future, ProcessPoolExecutor, wait
from contextlib import ExitStack, contextmanager
from pathlib import Path

import vesdyn
from vesdyn.case_file import load_sweep
from vesdyn.errors import CaseError
from vesdyn.planning import needs_planning, plan
from vesdyn.run import Outcome, interrupts, run_case
from vesdyn.storage import DamagedRunError, RunDirectory, RunDirectoryError

_ATTEMPTS = 3  # after as many deaths of its worker process a case is given up
_REFRESH = 0.2  # [s]
_PATIENCE = 10.0  # with a scheduler that does not answer [s]


class BatchError(ValueError):
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


def run_batch(cases, out="runs", jobs=None, scheduler=None, restart=False, show=True):
    """Run each of ``cases`` in ``out``/<name>; return a list of (case, `vesdyn.run.Outcome`) in their order.

    ``jobs`` worker processes (by default one a core) on this machine, or the workers of the Dask scheduler at the
    address ``scheduler``, which must see the same files. ``restart`` computes finished runs anew as well. ``show``
    keeps a table on stderr, or a line for each case where that is no terminal. A case that fails is an outcome and
    does not stop the others. An interrupt (SIGINT, SIGTERM) lets the steps in hand finish and stores checkpoints.
    Processes are spawned: a script that calls this needs its ``if __name__ == "__main__"``.

    Raises `BatchError` if there is no such cluster.
    """
    out = Path(out).resolve()
    out.mkdir(parents=True, exist_ok=True)
    outcomes, deaths, running, waiting = {}, Counter(), {}, deque(cases)
    with ExitStack() as stack:
        stop_file = out / f".stop-{uuid.uuid4().hex}"
        stack.callback(stop_file.unlink, missing_ok=True)
        free = stack.enter_context(_local(jobs) if scheduler is None else _cluster(scheduler, len(cases)))
        stack.push(lambda error, *_: error and stop_file.write_text("an error of the batch"))
        tell = stack.enter_context(_display(cases, out, outcomes, show))
        received = stack.enter_context(interrupts())
        while waiting or running:
            if received:
                stop_file.write_text(received[0])  # and all that is left ends by itself
            while waiting and free:
                case, worker = waiting.popleft(), free.pop()
                running[_submit(worker, case, out / case.name, restart, stop_file)] = case, worker
            done, _ = wait(running, timeout=_REFRESH, return_when=FIRST_COMPLETED)
            for future in done:
                case, worker = running.pop(future)
                free.append(worker)
                if isinstance(_error(future), BrokenExecutor):
                    worker.renew()
                    deaths[case.name] += 1
                    if deaths[case.name] < _ATTEMPTS:
                        waiting.appendleft(case)
                        continue
                outcomes[case.name], doubts = _result(future)
                for sentence in doubts:
                    warnings.warn(f"{case.name}: {sentence}", stacklevel=2)
                tell(case)
            tell()
    return [(case, outcomes[case.name]) for case in cases]


def _error(future):
    """What went wrong in the worker, or None."""
    try:
        future.result()
    except Exception as error:
        return error


def _result(future):
    """What `_carry_out` returned, or a failure in its place."""
    match _error(future):
        case None:
            return future.result()
        case BrokenExecutor():
            reason = f"its process died {_ATTEMPTS} times; is there memory for so many --jobs?"
        case CancelledError():
            reason = "the scheduler was lost; give the same command to another one, to go on."
        case error:
            reason = f"{type(error).__name__}: {error}"
    return Outcome("failed", reason), []


# In the worker -------------------------------------------------------------------------------------------


def _carry_out(case, path, restart, stop_file):
    """Plan and run one case in the directory ``path``; return its outcome and the sentences it warned of."""

    def stop():
        return stop_file.read_text() if stop_file.exists() else None

    if reason := stop():
        return Outcome("interrupted", f"not begun, stopped by {reason}."), []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            outcome = _compute(case, path, restart, stop)
        except (CaseError, RunDirectoryError) as error:
            outcome = Outcome("failed", str(error))
    return outcome, [str(doubt.message) for doubt in caught if doubt.category is UserWarning]


def _compute(case, path, restart, stop):
    case, decisions = plan(case) if needs_planning(case) else (case, ())
    directory = RunDirectory(path)
    if not restart and (origin := directory.origin()) is not None:
        directory.check_same(case)
        restart = origin.get("vesdyn") != vesdyn.__version__
        if restart:
            theirs, ours = origin.get("vesdyn"), vesdyn.__version__
            warnings.warn(f"{path}: holds a run by vesdyn {theirs}; {ours} computes it anew.")
    run = functools.partial(run_case, case, path, progress=False, decisions=decisions, stop=stop)
    try:
        return run(restart=restart)
    except DamagedRunError as damage:
        warnings.warn(f"{damage} The batch does.")
        return run(restart=True)


# Workers -------------------------------------------------------------------------------------------------


class _Process:
    """An executor of one process, so that its death concerns one case only."""

    def __init__(self):
        self.renew()

    def renew(self):
        self.executor = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), _end_with_parent)

    def submit(self, *task):
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # a process begun here leaves Ctrl-C to this one
        try:
            return self.executor.submit(*task)
        finally:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def _end_with_parent():
    """Let this process die with its parent, however that ends."""

    def watch():
        multiprocessing.parent_process().join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@contextmanager
def _local(jobs):
    """Yield a list of ``jobs`` processes, each of which takes one case at a time."""
    workers = [_Process() for _ in range(jobs or len(os.sched_getaffinity(0)))]
    try:
        yield list(workers)
    finally:
        for worker in workers:
            worker.executor.shutdown()


@contextmanager
def _cluster(address, n_cases):
    """Yield ``n_cases`` times the executor of the Dask scheduler, which queues them and replaces lost workers."""
    try:
        from distributed import Client
    except ImportError:
        raise BatchError("--scheduler: needs the package distributed; `pip install 'vesdyn[cluster]'`.") from None
    try:
        client = Client(address, timeout=_PATIENCE)
    except (OSError, ValueError) as error:
        raise BatchError(f"--scheduler {address}: no answer ({error}); give that of a dask scheduler.") from None
    with client:
        yield [client.get_executor(pure=False)] * n_cases


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
    elif not sys.stderr.isatty():
        yield lambda case=None: case and print(_line(case, outcomes[case.name]), file=sys.stderr, flush=True)
    else:
        from rich.console import Console
        from rich.live import Live

        began = time.time()
        with Live(console=Console(stderr=True), auto_refresh=False) as live:
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
    touched = directory.status_file.stat().st_mtime if directory.status_file.exists() else 0.0
    if touched < began:
        return Outcome("waiting", "")
    row, status = directory.last_row(), directory.status()
    wall_time = status["wall_time"] + time.time() - touched
    return Outcome("running", "", row.get("time", 0.0), 0, wall_time, row.get("binding_area", 0.0))
