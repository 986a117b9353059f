"""What a run leaves on disk, and how it is found again.

    case.yaml                 the case as resolved, and under ``provenance`` what computed it
    status.yaml               running, interrupted, finished or failed, and why
    history.csv               a row per coupling step
    columns.csv               unit and meaning of each of its columns
    frames/0000.h5, ...       a shape each, at t = 0, at the asked times and at the end
    frames.xdmf, frames.h5    all shapes as one series: for ParaView, and as links for readers of HDF5
    checkpoint.h5             the state to go on from; the one before it in checkpoint_previous.h5
    summary.png               the picture of a finished run

A run may be killed at any moment, and any write may fail: a file is either replaced in one atomic move or, like the
history, grows by whole rows (`vesdyn.files`). A frame costs the same, whether it is the first or the thousandth; the
two series that name them all are written with each checkpoint.

Nothing damaged or foreign is gone on with. A checkpoint holds its case, the hash of the sources that computed it, and
the checksums of the history and of the frames up to it; so does the status of a finished run. All of them are compared
before a run goes on, or is said to be finished.
"""

import csv
import fcntl
import hashlib
import io
import os
import re
import socket
import tempfile
import threading
import time
import uuid
import warnings
from collections.abc import Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

import h5py
import numpy as np
import psutil
import yaml

from vesdyn import files, plain_yaml
from vesdyn.case import continuation_conflicts, flattened
from vesdyn.case_file import LARGEST_FILE, load_case
from vesdyn.errors import CaseError, RunError
from vesdyn.files import Damage, WriteError
from vesdyn.provenance import provenance, sources_hash
from vesdyn.refusals import LONGEST, argument, printable, shown

STATES = ("running", "interrupted", "finished", "failed")
UNITS = "length a0, time a0^2/D, energy kT, density c_r0"
_LONGEST_ROW = 4096  # bytes
_LOCK_IS_STALE = 120.0  # a lock file that its owner has not touched for so long [s]
_LOCK_IS_TOUCHED = 10.0  # how often its owner does [s]


class RunDirectoryError(RunError):
    """A directory that cannot take or continue the run; one sentence that says what to do."""

    exit_status = 2  # of the command line: the command cannot be carried out as given


class BusyError(RunDirectoryError):
    """A directory in which another process is running."""


class DamagedRunError(RunDirectoryError):
    """A run that cannot be gone on with, because what it left is not whole or not its own."""


class Marks(NamedTuple):
    """How far history and frames are known to be right: bytes, frames, and the checksum of each."""

    history_size: int
    history_checksum: str
    frames: int
    frames_checksum: str


class Checkpoint(NamedTuple):
    """A state to go on from, and what it belongs to."""

    state: dict  # names to arrays, floats and ints
    case_text: str  # case.yaml as it was
    sources: str  # hash of what computed it
    marks: Marks


class Frame(NamedTuple):
    """A stored shape."""

    time: float  # [a0^2/D]
    connectivity: np.ndarray  # (n_elements, 3) triangles, or (n_elements, 2) segments of a meridian
    nodes: dict  # names to arrays (n_nodes,), ``position`` (n_nodes, 3 or 2) [a0]
    cells: dict  # names to arrays (n_elements,)

    @property
    def position(self):
        """Positions (n_nodes, 3) [a0], or (n_nodes, 2) of a meridian: distance from the axis and height."""
        return self.nodes["position"]

    @property
    def density(self):
        """Receptor density (n_nodes,) [c_r0]."""
        return self.nodes["density"]


class RunDirectory:
    """The directory of one run.

    Times [a0^2/D]; arrays are stored as given, in the units of the package. Methods that read return what is there
    and change nothing; those that write are for the process that holds the directory (`claim`).
    """

    def __init__(self, path):
        try:
            self.path = Path(path)
            if b"\0" in os.fsencode(self.path):
                raise ValueError
        except (TypeError, ValueError):
            raise RunDirectoryError(f"{shown(path)}: is not a path; give that of a directory.") from None
        self.case_file = self.path / "case.yaml"
        self.status_file = self.path / "status.yaml"
        self.history_file = self.path / "history.csv"
        self.columns_file = self.path / "columns.csv"
        self.frames_folder = self.path / "frames"
        self.frames_file = self.path / "frames.h5"
        self.xdmf_file = self.path / "frames.xdmf"
        self.checkpoint_file = self.path / "checkpoint.h5"
        self.checkpoint_previous = self.path / "checkpoint_previous.h5"
        self.summary_file = self.path / "summary.png"
        self._lock_file = self.path / ".lock"
        self._held = None  # device and number of the directory, once it is claimed
        self._case = self._columns = None  # case.yaml as it then is, and columns.csv
        self._history = self._header = None  # the open file, its running checksum and its size; its first line
        self._written = None  # a `_Written` for each frame
        self._indexed = None  # how many of them the series name

    def __str__(self):
        return printable(str(self.path), LONGEST)

    # Whose it is

    def check_usable(self):
        """Raise RunDirectoryError if no run can be stored here, whatever its case: it is a file, or not ours."""
        if fault := files.why_no_directory(self.path):
            raise RunDirectoryError(f"{self}: {fault}")
        if os.path.exists(self.path) and not self.holds_run() and any(self._foreign()):
            raise RunDirectoryError(f"{self}: has files but no run in it; choose another --out.")

    def check_there(self):
        """Raise RunDirectoryError if there is no directory that can be read."""
        advice = "give the directory of a run, or begin one by `vesdyn run CASE`"
        try:
            os.stat(self.path)
        except OSError as error:
            raise RunDirectoryError(f"{self}: {error.strerror}; {advice}.") from None
        if not os.path.isdir(self.path):
            raise RunDirectoryError(f"{self}: is no directory; {advice}.")
        if not os.access(self.path, os.R_OK | os.X_OK):
            raise RunDirectoryError(f"{self}: may not be read; allow it.")

    def holds_run(self):
        """True where a run was begun here, be it damaged."""
        if self.origin() is not None:
            return True
        left = [file for file in self._own_files() if os.path.exists(file)]
        return len(left) > 1 and bool({self.status_file, self.checkpoint_file, self.checkpoint_previous} & set(left))

    def _foreign(self):
        """Files that no run writes by itself."""
        return (
            file for file in self.path.iterdir() if not file.name.endswith(files.PART) and file != self._lock_file
        )

    @contextmanager
    def claim(self, case, restart=False, decisions=()):
        """Hold the directory for a run of ``case`` while the context lasts; create it if need be.

        ``decisions`` (`vesdyn.planning`) are stored beside it. With ``restart`` an earlier run in it is removed first,
        whatever its case. A run may go on under a case that changes nothing that was computed
        (`vesdyn.case.continuation_conflicts`); the change is noted in case.yaml.

        Raises RunDirectoryError if another process holds it (`BusyError`), if it has files that are no run's, or if
        it holds a run of another case.
        """
        self.check_usable()
        files.make_directory(self.path)
        with self._lock() as held:
            if not held:
                raise BusyError(
                    f"{self}: another process is running in it; wait for that one or choose another --out."
                )
            self.check_usable()
            try:
                self._held = _identity(self.path)
                if restart or not self.holds_run():
                    self.clear_results()
                    self._write_case(case, provenance() | {"warnings": case.warnings(), "decisions": list(decisions)})
                else:
                    self._go_on(case)
                self._case = _small_text(self.case_file)
                yield self
            finally:
                self._close_history()
                self._held = self._case = self._columns = None

    def origin(self):
        """Return the provenance stored with the case, or None if there is none that can be read."""
        try:
            stored = plain_yaml.read(_small_text(self.case_file), self.case_file)
        except (OSError, ValueError):
            return None
        origin = stored.get("provenance") if isinstance(stored, dict) else None
        return origin if isinstance(origin, dict) else None

    def busy(self):
        """Return whether a process is running in the directory."""
        try:
            with self._lock() as held:
                return not held
        except WriteError:  # nobody can run where nothing can be written
            return False

    @contextmanager
    def _lock(self):
        """Lock the directory itself, yielding whether that worked; a killed process leaves no lock behind."""
        try:
            handle = os.open(self.path, os.O_RDONLY)
        except OSError as error:
            raise files.write_error(self.path, ".", error) from None
        try:
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                yield False
                return
            except OSError:  # a file system without such locks
                with _lock_by_file(self._lock_file) as held:
                    yield held
                return
            yield True
        finally:
            with suppress(OSError):
                os.close(handle)

    def _check_held(self):
        """Raise vesdyn.files.WriteError if, since the directory was claimed, it or its history became another one.

        A run whose directory was moved, removed or replaced would go on in a new one of the old name.
        """
        if self._held is None:
            return
        changed = None
        if _identity(self.path) != self._held:
            changed = "the directory"
        elif self._history is not None and _identity(self.history_file) != _identity(self._history[0]):
            changed = self.history_file.name
        elif self._history is not None and os.fstat(self._history[0]).st_size != self._history[2]:
            changed = self.history_file.name
        if changed:
            raise WriteError(
                f"{self}: {changed} was changed, moved or removed while the run went on; put it back as it was and"
                " give the same command again."
            )

    def stored_case(self):
        """Return the case of the run, from case.yaml or, where that is damaged, from a checkpoint.

        Warns in the second case, and where case.yaml was changed after the run had finished. Raises DamagedRunError
        if neither can be read.
        """
        self.check_there()
        if self.origin() is not None and not self._case_was_changed():
            with suppress(CaseError):
                return load_case(self.case_file)
        for checkpoint in self._checkpoints():
            with suppress(Damage):
                case = _case_of(checkpoint.case_text)
                warnings.warn(
                    f"{self}: case.yaml is changed, damaged or gone; the case is taken from the checkpoint.", stacklevel=2
                )
                return case
        if self._case_was_changed():
            raise self._damaged(self.case_file, "was changed after the run had finished; put it back as it was, or")
        if self.origin() is not None:
            raise DamagedRunError(
                f"{self}: holds a run whose case this version cannot read; replace it by `{self._restart('CASE')}` or"
                " choose another --out."
            )
        if not self.holds_run():
            raise RunDirectoryError(f"{self}: holds no run; `vesdyn run CASE --out {argument(self.path)}` begins one.")
        raise self._damaged(self.case_file, "is damaged or gone, and no checkpoint tells the case;")

    def check_same(self, case):
        """Raise RunDirectoryError unless the stored run is one of ``case``, or can go on under it."""
        stored = self.stored_case()
        if not _differences(stored, case):
            return
        reached = max((c.state.get("time", 0.0) for c in self._checkpoints()), default=0.0)
        if conflicts := continuation_conflicts(stored, case, reached):
            raise RunDirectoryError(
                f"{self}: holds a run of a different case ({', '.join(conflicts)}); replace it by"
                f" `{self._restart('CASE')}` or choose another --out."
            )

    def _go_on(self, case):
        """Take up the run that is there: note what is other than it was, restore a damaged case.yaml."""
        self.check_same(case)
        origin, stored = self.origin(), self.stored_case()
        if origin is None or self._case_was_changed():
            texts = [checkpoint.case_text for checkpoint in self._checkpoints()]
            origin = plain_yaml.read(texts[0], self.case_file)["provenance"]
            self._write_case(stored, origin)
        finished = self.status().get("state") == "finished"
        changes = [f"{key}: {old} -> {new}" for key, old, new in _differences(stored, case)]
        if finished and not _asks_for_more(stored, case):
            self._tell_other_sources(origin)
            return
        now = provenance()
        so_far = _latest(origin)
        others = [key for key, value in now.items() if key != "date" and value != so_far.get(key)]
        if others:
            warnings.warn(
                f"{self}: goes on with another {', '.join(others)}, so the result may differ in its last bits"
                " from that of an uninterrupted run.",
                stacklevel=4,
            )
        if changes:
            warnings.warn(f"{self}: goes on with a changed case ({', '.join(changes)}).", stacklevel=4)
        if others or changes:
            origin.setdefault("resumed_with", []).append(now | ({"changes": changes} if changes else {}))
            self._write_case(case, origin)
        if finished:
            self.write_status("running", wall_time=self.status()["wall_time"])

    def sources(self):
        """Return the hash of the sources that computed the run last, or None where that is not known."""
        origin = self.origin() or {}
        return _latest(origin).get("sources")

    def _tell_other_sources(self, origin):
        last = _latest(origin)
        if last.get("sources") != sources_hash():
            warnings.warn(
                f"{self}: was computed by other sources (vesdyn {last.get('vesdyn')}, commit"
                f" {last.get('commit')}); `{self._restart()}` computes it by these.",
                stacklevel=4,
            )

    def _write_case(self, case, origin):
        text = case.to_yaml() + yaml.safe_dump({"provenance": origin}, sort_keys=False, width=110)
        files.replace_file(self.path, self.case_file.name, text.encode())

    def _case_text(self):
        try:
            return _without_provenance(_small_text(self.case_file))
        except (OSError, ValueError):
            return None

    def _case_was_changed(self):
        """Whether case.yaml is not that of the finished run beside it."""
        text, of_run = self._case_text(), self.status().get("case")
        return None not in (text, of_run) and files.checksum(text.encode()) != of_run

    def _own_files(self):
        """The files that a run may leave, frames excepted; those that speak for others come first."""
        return [
            self.status_file,
            self.checkpoint_file,
            self.checkpoint_previous,
            self.history_file,
            self.columns_file,
            self.frames_file,
            self.xdmf_file,
            self.summary_file,
            self.case_file,
        ]

    def clear_results(self):
        """Remove what an earlier run computed; the case stays."""
        self._close_history()
        self._written, self._indexed = [], 0
        for file in self._own_files()[:-1]:
            files.remove_file(self.path, file.name)
        self._remove_frames(0)
        with suppress(OSError):  # it holds something else
            self.frames_folder.rmdir()
        for part in self.path.glob(f"*{files.PART}"):
            if part.name.removesuffix(files.PART) in {file.name for file in self._own_files()}:
                files.remove_file(self.path, part.name)

    def _remove_frames(self, first):
        """Remove the frames from the ``first`` on (a number), and what was left of one that was being written."""
        for file in self.frames_folder.glob("*") if os.path.isdir(self.frames_folder) else ():
            number = re.fullmatch(rf"(\d{{4,}})\.h5({re.escape(files.PART)})?", file.name)
            if number and (int(number[1]) >= first or number[2]):
                files.remove_file(self.path, f"frames/{file.name}")

    # Status

    def status(self):
        """Return the stored status; empty before the first run and where it is damaged or of another version.

        It has ``state``, ``reason``, ``wall_time`` [s] and, once finished, the `Marks`, and the checksums of case,
        columns and picture.
        """
        try:
            body, _, last = _small_text(self.status_file).rpartition("checksum: ")
            if files.checksum(body.encode()) + "\n" != last:
                return {}
            status = plain_yaml.read(body, self.status_file)
            status["reason"], status["wall_time"] = str(status["reason"]), float(status["wall_time"])
            if status["state"] == "finished":
                status["marks"] = Marks(**status["marks"])
        except (OSError, KeyError, TypeError, ValueError):
            return {}
        return status if status["state"] in STATES else {}

    def write_status(self, state, reason="", wall_time=0.0):
        """Store ``state`` (one of `STATES`), the reason and the wall time [s] spent.

        Raises DamagedRunError where a run that finished is not on the disk as it was written.
        """
        self._check_held()
        status = {"state": state, "reason": reason, "wall_time": float(wall_time)}
        if state == "finished":
            marks = self._marks()
            self.verify(marks)  # what is told to be finished is there
            self._put_back()
            status["marks"] = marks._asdict()
            if (text := self._case_text()) is not None:
                status["case"] = files.checksum(text.encode())
            for name, file in (("columns", self.columns_file), ("summary", self.summary_file)):
                if os.path.exists(file):
                    status[name] = files.checksum(self._read(file))
        text = yaml.safe_dump(status, sort_keys=False, width=110)
        files.replace_file(
            self.path, self.status_file.name, f"{text}checksum: {files.checksum(text.encode())}\n".encode()
        )

    def _put_back(self):
        """Write case.yaml and columns.csv again, where they are not what this process has written or taken up."""
        for file, text in ((self.case_file, self._case), (self.columns_file, self._columns)):
            if text is not None and not _holds(file, text.encode()):
                files.replace_file(self.path, file.name, text.encode())
                warnings.warn(f"{self}: {file.name} was changed or removed while the run went on, and is put back.", stacklevel=2)

    # Is it whole?

    def verify(self, marks):
        """Raise DamagedRunError unless history and frames are as they were when ``marks`` were taken."""
        self.verify_history(marks)
        self._written = self._read_frames(marks.frames)
        if _frames_checksum(self._written) != marks.frames_checksum:
            raise self._not_the_runs()

    def _not_the_runs(self):
        return DamagedRunError(f"{self}: a frame in frames is another run's, or in the place of another; {self._anew()}.")

    def verify_history(self, marks=None):
        """Raise DamagedRunError unless the history is as it was at ``marks``, by default the latest there are."""
        marks = marks or self._latest_marks()
        if marks is not None:
            content = self._read(self.history_file) if marks.history_size else b""
            if files.checksum(content[: marks.history_size]) != marks.history_checksum:
                raise self._damaged(self.history_file)

    def _latest_marks(self):
        return self.finished_marks() or next((checkpoint.marks for checkpoint in self._checkpoints()), None)

    def faults(self):
        """Return a sentence for each thing that keeps the run from going on, or a finished one from being right."""
        marks, found = self.finished_marks(), []
        try:
            if marks is None and self._checkpoint_files():
                marks = next((checkpoint.marks for checkpoint in self._checkpoints()), None)
                if marks is None:
                    raise DamagedRunError(f"{self}: no checkpoint in it is whole; {self._anew()}.")
            if marks is not None:
                self.verify(marks)
        except DamagedRunError as damage:
            found.append(str(damage))
        return found

    def finished_marks(self):
        """Return the `Marks` of a finished run, or None."""
        return self.status().get("marks")

    def mend(self, columns):
        """Write anew what of a finished run, which is verified, follows from the rest; return what was not right.

        These are the series frames.xdmf and frames.h5, and columns.csv where ``columns`` (as for `write_columns`) are
        those of the history. What stands after the last row or frame is dropped; a damaged picture is removed, to be
        drawn again.
        """
        mended, marks, text = [], self.finished_marks(), _columns_text(columns).encode()
        if files.checksum(text) == self.status().get("columns") and not _holds(self.columns_file, text):
            files.replace_file(self.path, self.columns_file.name, text)
            mended.append(self.columns_file.name)
        if self.history_file.stat().st_size != marks.history_size:
            content = self._read(self.history_file)[: marks.history_size]
            files.replace_file(self.path, self.history_file.name, content)
            mended.append(self.history_file.name)
        self._remove_frames(marks.frames)
        for file, content in self._series().items():
            if not _holds(file, content):
                files.replace_file(self.path, file.name, content)
                mended.append(file.name)
        if os.path.exists(self.summary_file) and not _is_of(self.summary_file, self.status().get("summary")):
            files.remove_file(self.path, self.summary_file.name)
            mended.append(self.summary_file.name)
        return mended

    def _read(self, file):
        """The bytes of ``file``; raise DamagedRunError where it cannot be read."""
        try:
            return files.read(file)
        except FileNotFoundError:
            raise self._damaged(file, "is gone") from None
        except OSError as error:
            raise self._damaged(file, f"cannot be read ({error.strerror}); allow it, or") from None

    def _damaged(self, file, fault="is damaged;"):
        fault = fault if fault.endswith((";", "or")) else f"{fault};"
        return DamagedRunError(f"{self}: {file.relative_to(self.path)} {fault} {self._anew()}.")

    def _anew(self):
        """The remedy where a run cannot go on."""
        return f"start anew by `{self._restart()}`"

    def _restart(self, case=None):
        """The command that replaces the run, by the one of its own case where none is named."""
        case = case or ("CASE" if self.origin() is None else argument(self.case_file))
        return f"vesdyn run {case} --out {argument(self.path)} --restart"

    def remedy(self, fault):
        """The DamagedRunError of a ``fault`` (a clause) that only a new start mends."""
        return DamagedRunError(f"{self}: {fault}; {self._anew()}.")

    def _marks(self):
        """How far history and frames are right, from what this process has written."""
        self._open_history()
        _, digest, size = self._history
        if self._written is None:
            self._written = self._read_frames(None)
        return Marks(size, digest.hexdigest(), len(self._written), _frames_checksum(self._written))

    # History

    def _open_history(self, header=None):
        """Open the history for more rows, and begin it with ``header`` where it is empty."""
        if self._history is None:
            self._header = None
            try:
                handle = os.open(self.history_file, os.O_RDWR | os.O_APPEND | os.O_CREAT, 0o666)
                content = files.read(self.history_file)
                self._history = handle, hashlib.sha256(content), len(content)
                files.sync_directory(self.path)
            except OSError as error:
                raise files.write_error(self.path, self.history_file.name, error) from None
            if content:
                self._header = content[: content.index(b"\n") + 1] if b"\n" in content else b""
        if header and self._header is None:
            self._grow_history(header)
            self._header = header
        if header and self._header != header:
            there, here = (set(line.decode(errors="replace").strip().split(",")) for line in (self._header, header))
            others = ", ".join(sorted(there ^ here)) or "in another order"
            raise RunDirectoryError(
                f"{self}: history.csv has other columns ({others}); go on by the script that began it, or"
                f" {self._anew()}."
            )

    def _grow_history(self, content):
        handle, digest, size = self._history
        try:
            files.write_all(handle, content)
        except OSError as error:
            raise files.write_error(self.path, self.history_file.name, error) from None
        digest.update(content)
        self._history = handle, digest, size + len(content)

    def _close_history(self):
        if self._history is not None:
            with suppress(OSError):  # whatever was of account has been synced
                os.close(self._history[0])
            self._history = None

    def append_history(self, row):
        """Append ``row``, a dict of column name to number that begins with ``time``.

        Numbers are written so that they read back to the same bits. Raises RunDirectoryError if the file has other
        columns, vesdyn.files.WriteError if it cannot be written.
        """
        self._open_history((",".join(row) + "\n").encode())
        values = (repr(int(v) if isinstance(v, (int, np.integer)) else float(v)) for v in row.values())
        self._grow_history((",".join(values) + "\n").encode())

    def write_columns(self, columns):
        """Store the unit and meaning of each column of the history, (name, unit, meaning[, unit in SI]) each."""
        self._columns = _columns_text(columns)
        files.replace_file(self.path, self.columns_file.name, self._columns.encode())

    def described_columns(self):
        """Return a dict of ``column``, ``unit`` and ``meaning`` for each column of the history that is described.

        Raises DamagedRunError where those of a finished run are not as they were written.
        """
        of_run = self.status().get("columns")
        if of_run is not None and files.checksum(self._read(self.columns_file)) != of_run:
            raise self._damaged(self.columns_file, f"is damaged; give `vesdyn resume {argument(self.path)}`, which writes it again, or")
        try:
            rows = list(csv.DictReader(io.StringIO(files.read(self.columns_file).decode())))
        except (OSError, ValueError, csv.Error):
            return []
        return [row for row in rows if row.keys() >= {"column", "unit", "meaning"}]

    def last_row(self):
        """Return the last whole row of the history, column to number, reading no other; empty if none."""
        try:
            files.check_regular(self.history_file)
            with open(self.history_file, "rb") as file:
                columns = file.readline().decode().strip().split(",")
                file.seek(max(file.tell(), os.path.getsize(self.history_file) - _LONGEST_ROW))
                whole = file.read().decode(errors="replace").split("\n")[:-1]
            values = [float(value) for value in whole[-1].split(",")] if whole else []
        except (OSError, ValueError):
            return {}
        return dict(zip(columns, values)) if len(values) == len(columns) else {}

    def history(self):
        """Return the history as a dict of column name to array (n_steps,); empty before the first step.

        It ends before the first row that is not whole: a killed run leaves half a row, a power cut worse.
        """
        try:
            content = files.read(self.history_file)
        except OSError:
            return {}
        header, *lines = content.split(b"\n")[:-1] or [b""]
        columns, rows = header.decode(errors="replace").split(","), []
        for line in lines:
            try:
                values = [float(value) for value in line.split(b",")]
            except ValueError:
                break
            if len(values) != len(columns):
                break
            rows.append(values)
        return dict(zip(columns, np.array(rows).T)) if rows else {}

    # Frames

    def write_frame(self, time, connectivity, node_arrays, cell_arrays):
        """Store the shape at ``time`` as the next frame.

        ``connectivity`` (n_elements, 3) is the same for all frames; ``node_arrays`` maps names to arrays
        (n_nodes,) or, for ``position`` [a0], (n_nodes, 3); ``cell_arrays`` to arrays (n_elements,). For a meridian
        the second dimensions are 2.

        Raises ValueError if the connectivity is not that of the earlier frames.
        """
        if self._written is None:
            self._written = self._read_frames(None)
        connectivity = np.asarray(connectivity, dtype=np.int64)
        if self._written and files.checksum(connectivity.tobytes()) != self._written[0].mesh:
            raise ValueError("the connectivity of a frame differs from that of the frames before it")
        arrays = {"connectivity": connectivity}
        for center, given in (("Node", node_arrays), ("Cell", cell_arrays)):
            arrays |= {name: (np.asarray(v, dtype=np.float64), {"center": center}) for name, v in given.items()}
        attributes = {"time": float(time), "units": UNITS}
        content = files.image(arrays, attributes, head=f"time {float(time)!r}")
        self._check_held()
        files.make_directory(self.path, self.frames_folder.name)
        number = len(self._written)
        files.replace_file(self.path, f"frames/{number:04d}.h5", content)
        self._written.append(_written(number, content))

    def frame_times(self):
        """Return the times of the stored frames, in order, reading no more than these."""
        times = []
        for file in self._frame_files():
            try:
                times.append(float(files.read_head(file).removeprefix("time ")))
            except (OSError, ValueError):
                break
        return times

    def frames(self):
        """Return the stored `Frame`s, a sequence that reads each when it is asked for.

        Raises DamagedRunError where one is gone, or is not the one that the run stored, by the checksum it carries.
        """
        count = len(self._frame_files())
        if marks := self._latest_marks():
            heads = [self._head(number) for number in range(marks.frames)]
            if files.checksum("".join(heads).encode()) != marks.frames_checksum:
                raise self._not_the_runs()
            count = marks.frames if self.finished_marks() else count
        return _Frames(self, count)

    def _head(self, number):
        """The checksum that a frame carries."""
        file = self.frames_folder / f"{number:04d}.h5"
        try:
            return files.carried_checksum(file)
        except FileNotFoundError:
            raise self._damaged(file, "is gone") from None
        except (OSError, Damage):
            raise self._damaged(file) from None

    def read_frame(self, number):
        """Return the `Frame` of that number; raise DamagedRunError if it is not whole."""
        file = self.frames_folder / f"{number:04d}.h5"
        content = self._read(file)
        try:
            arrays, beside, attributes = files.read_image(content)
            connectivity = arrays.pop("connectivity")
        except (Damage, KeyError):
            raise self._damaged(file) from None
        nodes = {name: v for name, v in arrays.items() if beside[name]["center"] == "Node"}
        cells = {name: v for name, v in arrays.items() if beside[name]["center"] == "Cell"}
        return Frame(attributes["time"], connectivity, nodes, cells)

    def _frame_files(self):
        """Files of the frames from the first on, as long as none is missing."""
        found = []
        while os.path.exists(file := self.frames_folder / f"{len(found):04d}.h5"):
            found.append(file)
        return found

    def _read_frames(self, count):
        """A `_Written` for each of the first ``count`` frames (None: all), each compared with its checksum."""
        written = []
        for number in range(len(self._frame_files()) if count is None else count):
            file = self.frames_folder / f"{number:04d}.h5"
            try:
                written.append(_written(number, self._read(file)))
            except Damage:
                raise self._damaged(file) from None
        return written

    def _series(self):
        """The two files that name all frames, and what is in them."""
        grids = "".join(frame.grid for frame in self._written)
        memory = io.BytesIO()
        with h5py.File(memory, "w") as file:
            file.attrs["units"] = UNITS
            for number, frame in enumerate(self._written):
                file[f"frame_{number:04d}"] = h5py.ExternalLink(f"frames/{number:04d}.h5", "/")
            if self._written:
                file["connectivity"] = h5py.ExternalLink("frames/0000.h5", "/connectivity")
        return {self.xdmf_file: _XDMF.format(grids).encode(), self.frames_file: memory.getvalue()}

    def write_series(self):
        """Write frames.xdmf, which ParaView opens, and frames.h5, unless they name all frames already."""
        if self._written is None:
            self._written = self._read_frames(None)
        if self._indexed != len(self._written):
            for file, content in self._series().items():
                files.replace_file(self.path, file.name, content)
            self._indexed = len(self._written)

    # Checkpoints

    def write_checkpoint(self, state):
        """Store ``state``, a dict of names to arrays, floats and ints, bit for bit; keep the one before it.

        What the state implies reaches the disk before it.
        """
        marks = self._marks()
        self._check_held()
        try:
            files.sync(self._history[0])
        except OSError as error:
            raise files.write_error(self.path, self.history_file.name, error) from None
        self.write_series()
        text = self._case if self._case is not None else _small_text(self.case_file) if os.path.exists(self.case_file) else ""
        attributes = {"case": text, "sources": sources_hash(), **marks._asdict()}
        content = files.image(state, attributes)
        files.replace_file(self.path, self.checkpoint_file.name, content, kept_as=self.checkpoint_previous.name)

    def read_checkpoint(self):
        """Return the state of the latest checkpoint that is whole, or None if there is none yet.

        Warns if that is not the last one written. Raises DamagedRunError if all are damaged.
        """
        for file in self._checkpoint_files():
            try:
                return _read_checkpoint(file).state
            except (OSError, Damage):
                warnings.warn(f"{self}: {file.name} is damaged and left aside.", stacklevel=2)
        if self._checkpoint_files():
            raise DamagedRunError(f"{self}: no checkpoint in it is whole; {self._anew()}.")
        return None

    def _checkpoint_files(self):
        return [file for file in (self.checkpoint_file, self.checkpoint_previous) if os.path.exists(file)]

    def _checkpoints(self):
        """Those checkpoints that are whole, the latest first."""
        for file in self._checkpoint_files():
            with suppress(OSError, Damage):
                yield _read_checkpoint(file)

    def restore(self, case):
        """Return the state from which a run of ``case`` goes on, and remove what is later; None at the very start.

        It is that of the latest checkpoint that is whole, of this case, and agrees with history and frames; those
        left aside are warned of. Raises DamagedRunError if there are checkpoints, but none of that kind.
        """
        fault = None
        for file in self._checkpoint_files():
            try:
                checkpoint = _read_checkpoint(file)
                self._check_case(file, checkpoint, case)
                self.verify(checkpoint.marks)
            except (OSError, Damage):
                fault = fault or DamagedRunError(f"{self}: no checkpoint in it is whole; {self._anew()}.")
                warnings.warn(f"{self}: {file.name} is damaged and left aside.", stacklevel=2)
            except DamagedRunError as error:
                fault = error
                if file != self._checkpoint_files()[-1]:
                    warnings.warn(f"{error} The checkpoint before it is tried.", stacklevel=2)
            else:
                known = {entry.get("sources") for entry in [*(self.origin() or {}).get("resumed_with", ()), self.origin() or {}]}
                if checkpoint.sources != sources_hash() and checkpoint.sources not in known:
                    warnings.warn(
                        f"{self}: {file.name} was computed by other sources; the result may differ from that of one run by these.",
                        stacklevel=2,
                    )
                self._rewind(checkpoint.marks)
                return checkpoint.state
        if fault:
            raise fault
        self.clear_results()
        return None

    def _check_case(self, file, checkpoint, case):
        if self._case_text() == _without_provenance(checkpoint.case_text):
            return  # `claim` has compared that one
        stored = _case_of(checkpoint.case_text)
        if conflicts := continuation_conflicts(stored, case, checkpoint.state.get("time", 0.0)):
            raise DamagedRunError(
                f"{self}: {file.name} is of another case ({', '.join(conflicts)}); put the case back as it was, or {self._anew()}."
            )

    def _rewind(self, marks):
        """Drop what was stored after ``marks`` were taken."""
        self._close_history()
        content = self._read(self.history_file) if marks.history_size else b""
        if len(content) > marks.history_size or not marks.history_size:
            files.replace_file(self.path, self.history_file.name, content[: marks.history_size])
        self._remove_frames(marks.frames)
        self._indexed = None
        self.write_series()


class _Frames(Sequence):
    """Frames of a directory, each read when it is asked for."""

    def __init__(self, directory, count):
        self._directory, self._count = directory, count

    def __len__(self):
        return self._count

    def __getitem__(self, number):
        if isinstance(number, slice):
            return [self[i] for i in range(*number.indices(len(self)))]
        if not -len(self) <= number < len(self):
            raise IndexError(number)
        return self._directory.read_frame(number % len(self))


# Cases ---------------------------------------------------------------------------------------------------


def _small_text(file):
    """The text of the regular ``file``, if it is no longer than a case may be; else OSError or ValueError."""
    if os.path.getsize(file) > LARGEST_FILE:
        raise ValueError("is too large")
    return files.read(file).decode()


def _holds(file, content):
    """Whether the ``content`` (bytes) is what is in ``file``."""
    with suppress(OSError):
        return files.read(file) == content
    return False


def _is_of(file, checksum):
    """Whether what is in ``file`` can be read and has the ``checksum``."""
    with suppress(OSError):
        return files.checksum(files.read(file)) == checksum
    return False


def _columns_text(columns):
    text, header = io.StringIO(), ("column", "unit", "meaning", "unit_in_si")
    csv.writer(text, lineterminator="\n").writerows([header[: len(columns[0])], *columns])
    return text.getvalue()


def _identity(place):
    """Device and number of the file at ``place`` (a path or a descriptor); None where there is none."""
    with suppress(OSError):
        status = os.stat(place)
        return status.st_dev, status.st_ino


def _case_of(text):
    """The case in the text of a case.yaml; raise `Damage` if there is none."""
    try:
        with tempfile.TemporaryDirectory(prefix="vesdyn-") as folder, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            file = Path(folder) / "case.yaml"
            file.write_text(text, encoding="utf-8")
            return load_case(file)
    except CaseError:
        raise Damage("holds no case") from None
    except OSError as error:
        raise files.write_error(Path(tempfile.gettempdir()), "a copy of case.yaml", error) from None


def _without_provenance(text):
    return text.partition("\nprovenance:")[0]


def _latest(origin):
    """The provenance of what computed last, of a stored ``origin``."""
    resumed = origin.get("resumed_with")
    return {**origin, **(resumed[-1] if isinstance(resumed, list) and resumed and isinstance(resumed[-1], dict) else {})}


def _differences(stored, wanted):
    there, here = flattened(stored.resolved()), flattened(wanted.resolved())
    return [(key, there.get(key), here[key]) for key in here if there.get(key) != here[key]]


def _asks_for_more(stored, wanted):
    """True where a finished run of ``stored`` has not all that ``wanted`` asks for."""
    return any(key in ("time.end", "output.frames") for key, *_ in _differences(stored, wanted))


# Files ---------------------------------------------------------------------------------------------------


def _read_checkpoint(file):
    """The `Checkpoint` in ``file``; raise `Damage` unless it is whole."""
    state, _, attributes = files.read_image(files.read(file))
    try:
        marks = Marks(*(kind(attributes[name]) for name, kind in Marks.__annotations__.items()))
        return Checkpoint(state, attributes["case"], attributes["sources"], marks)
    except (KeyError, TypeError, ValueError):
        raise Damage("was written by another version") from None


class _Written(NamedTuple):
    """What is kept in mind of a stored frame."""

    checksum: str
    mesh: str  # checksum of the connectivity
    grid: str  # its part of frames.xdmf


def _frames_checksum(written):
    return files.checksum("".join(frame.checksum for frame in written).encode())


_XDMF = """\
<?xml version='1.0' encoding='utf-8'?>
<Xdmf Version="3.0">
  <Domain>
    <Grid Name="vesicle" GridType="Collection" CollectionType="Temporal">
{}    </Grid>
  </Domain>
</Xdmf>
"""


def _written(number, content):
    """The `_Written` of the frame whose file has ``content``; raise `Damage` if that is not whole."""
    from vesdyn.kinds import kind_of  # here: the kernels are slow to import, and only a run needs them

    arrays, beside, attributes = files.read_image(content)
    name = f"frames/{number:04d}.h5"

    def item(array):
        value = arrays[array]
        kind = "Int" if value.dtype.kind == "i" else "Float"
        shape = " ".join(map(str, value.shape))
        return f'<DataItem Format="HDF" NumberType="{kind}" Precision="8" Dimensions="{shape}">{name}:/{array}</DataItem>'

    connectivity = arrays["connectivity"]
    element, coordinates = kind_of(connectivity.shape[1]).XDMF
    corners = f'NodesPerElement="{connectivity.shape[1]}"'
    lines = [
        f'<Grid Name="frame_{number:04d}" GridType="Uniform">',
        f'  <Time Value="{attributes["time"]!r}" />',
        f'  <Topology TopologyType="{element}" {corners} NumberOfElements="{len(connectivity)}">',
        f"    {item('connectivity')}",
        "  </Topology>",
        f'  <Geometry GeometryType="{coordinates}">',
        f"    {item('position')}",
        "  </Geometry>",
    ]
    for array, value in arrays.items():
        if value.ndim == 1:
            center = f'AttributeType="Scalar" Name={quoteattr(array)} Center="{beside[array]["center"]}"'
            lines += [f"  <Attribute {center}>", f"    {item(array)}", "  </Attribute>"]
    lines.append("</Grid>")
    mesh = files.checksum(np.asarray(connectivity, dtype=np.int64).tobytes())
    return _Written(files.image_checksum(content), mesh, "".join(f"      {line}\n" for line in lines))


# Locks without flock -------------------------------------------------------------------------------------


@contextmanager
def _lock_by_file(file):
    """Lock by the presence of ``file``, yielding whether that worked.

    It names its owner, who touches it now and then. One whose owner on this machine has ended is taken over, and one of
    another machine that is long untouched by the clock of the file system; an owner that is only stopped keeps it.
    """
    owner = f"{socket.gethostname()} {os.getpid()} {_began(os.getpid())}-{uuid.uuid4().hex}\n"
    if not _create(file, owner) and not (_is_stale(file) and _take_over(file, owner)):
        yield False
        return
    over = threading.Event()

    def touch():
        while not over.wait(_LOCK_IS_TOUCHED):
            with suppress(OSError):
                os.utime(file)

    threading.Thread(target=touch, daemon=True).start()
    try:
        yield True
    finally:
        over.set()
        with suppress(OSError):
            if file.read_text() == owner:
                file.unlink()


def _create(file, owner):
    try:
        handle = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666)
    except FileExistsError:
        return False
    except OSError as error:
        raise files.write_error(file.parent, file.name, error) from None
    try:
        files.write_all(handle, owner.encode())
    except OSError as error:
        raise files.write_error(file.parent, file.name, error) from None
    finally:
        os.close(handle)
    return True


def _take_over(file, owner):
    """Replace a stale lock; of several that try at once, one gets it."""
    aside = file.with_name(f"{file.name}-{uuid.uuid4().hex}{files.PART}")
    try:
        os.rename(file, aside)
    except FileNotFoundError:
        return False
    with suppress(OSError):
        aside.unlink()
    return _create(file, owner)


def _is_stale(file):
    try:
        untouched = abs(_now(file.parent) - file.stat().st_mtime)  # in the future it was touched by another clock
        host, pid, mark = files.read(file).decode().split()
        pid = int(pid)
    except FileNotFoundError:
        return True
    except (OSError, ValueError):  # its owner is writing its name, or died as it did
        with suppress(OSError):
            return abs(_now(file.parent) - file.stat().st_mtime) > _LOCK_IS_TOUCHED
        return True
    if host == socket.gethostname():
        if (began := _began(pid)) is None:
            return True
        if "-" in mark:
            return not mark.startswith(f"{began}-")  # else the number is another process's by now
    return untouched > _LOCK_IS_STALE


def _now(folder):
    """The time [s] by the clock of the file system of ``folder``, which may be another machine's."""
    with suppress(OSError), tempfile.TemporaryFile(dir=folder) as file:
        return os.fstat(file.fileno()).st_mtime
    return time.time()


def _began(pid):
    """When the process ``pid`` of this machine began, as text; None where there is none."""
    try:
        return f"{psutil.Process(pid).create_time():.1f}"
    except psutil.NoSuchProcess:
        return None
    except psutil.Error:  # another user's, of which nothing is told
        return "?"
