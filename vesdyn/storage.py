"""What a run leaves on disk, and how it is found again.

    case.yaml                 the case as resolved, and under ``provenance`` what computed it
    status.yaml               running, interrupted, finished or failed, and why
    history.csv               a row per coupling step
    frames.h5, frames.xdmf    the shapes at the asked times; ParaView opens the second
    checkpoint.h5             the state to go on from; the one before it in checkpoint_previous.h5

A run may be killed at any moment: a file is either replaced in one atomic move or, like the history, grows
by whole rows.
"""

import csv
import datetime
import fcntl
import hashlib
import os
import platform
import shutil
import subprocess
import warnings
import xml.etree.ElementTree as ElementTree
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path

import h5py
import numpy as np
import yaml

import vesdyn
from vesdyn.case_file import load_case
from vesdyn.errors import CaseError


_LONGEST_ROW = 4096  # bytes


class RunDirectoryError(ValueError):
    """A directory that cannot take or continue the run; one sentence that says what to do."""


class DamagedRunError(RunDirectoryError):
    """A run of the right case that cannot be gone on with, because what it left is not whole or not ours."""


class RunDirectory:
    """The directory of one run.

    Times [a0^2/D]; arrays are stored as given, in the units of the package. Methods that read return what
    is there; nothing is created before ``claim``.
    """

    def __init__(self, path):
        self.path = Path(path)
        self.case_file = self.path / "case.yaml"
        self.status_file = self.path / "status.yaml"
        self.history_file = self.path / "history.csv"
        self.frames_file = self.path / "frames.h5"
        self.xdmf_file = self.path / "frames.xdmf"
        self.checkpoint_file = self.path / "checkpoint.h5"
        self.checkpoint_previous = self.path / "checkpoint_previous.h5"
        self.summary_file = self.path / "summary.png"

    # Whose it is

    @contextmanager
    def claim(self, case, restart=False, decisions=()):
        """Hold the directory for a run of ``case`` while the context lasts; create it if need be.

        ``decisions`` (`vesdyn.planning`) are stored beside it. With ``restart`` an earlier run in it is removed first, whatever its case.

        Raises RunDirectoryError if another process holds it, if it has files that are no run's, or if it
        holds a run of another case.
        """
        self.path.mkdir(parents=True, exist_ok=True)
        with self._lock() as held:
            if not held:
                raise RunDirectoryError(
                    f"{self.path}: another process is running in it; wait for that one or choose another --out."
                )
            origin = self.origin()
            if origin is None and any(self.path.iterdir()):
                raise RunDirectoryError(f"{self.path}: has files but no run in it; choose another --out.")
            if origin is None or restart:
                self.status_file.unlink(missing_ok=True)
                self.clear_results()
                self._write_case(case, provenance() | {"warnings": case.warnings(), "decisions": list(decisions)})
            else:
                self.check_same(case)
                if self.status().get("state") != "finished":
                    self._note_versions(case, origin)
            yield self

    def origin(self):
        """Return the provenance stored with the case, or None if the directory holds no run."""
        if not self.case_file.exists():
            return None
        stored = yaml.safe_load(self.case_file.read_text())
        return stored.get("provenance") if isinstance(stored, dict) else None

    def busy(self):
        """Return whether a process is running in the directory."""
        with self._lock() as held:
            return not held

    @contextmanager
    def _lock(self):
        """Lock the directory itself, yielding whether that worked; a killed process leaves no lock behind."""
        handle = os.open(self.path, os.O_RDONLY)
        try:
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                held = True
            except BlockingIOError:
                held = False
            except OSError:  # some network file systems cannot lock a directory
                held = True
            yield held
        finally:
            os.close(handle)

    def check_same(self, case):
        """Raise RunDirectoryError unless the stored run is one of ``case``."""
        try:
            stored = load_case(self.case_file)
        except CaseError:
            raise RunDirectoryError(
                f"{self.path}: holds a run whose case this version cannot read; start it anew with --restart"
                " or choose another --out."
            ) from None
        if stored != case:
            there, here = _flat(stored.resolved()), _flat(case.resolved())
            differences = ", ".join(f"{k} {there[k]} there, {here[k]} here" for k in here if there[k] != here[k])
            raise RunDirectoryError(
                f"{self.path}: holds a run of a different case ({differences}); replace it with --restart"
                " or choose another --out."
            )

    def _note_versions(self, case, origin):
        """Warn and note in case.yaml if the run goes on with other versions than it had so far."""
        now = provenance()
        so_far = {**origin, **(origin.get("resumed_with") or [{}])[-1]}
        changed = [key for key, value in now.items() if key != "date" and value != so_far.get(key)]
        if changed:
            warnings.warn(
                f"{self.path}: goes on with another {', '.join(changed)}, so the result may differ in its last bits"
                " from that of an uninterrupted run.",
                stacklevel=4,
            )
            origin.setdefault("resumed_with", []).append(now)
            self._write_case(case, origin)

    def _write_case(self, case, origin):
        with _replacing(self.case_file) as part:
            part.write_text(case.to_yaml() + yaml.safe_dump({"provenance": origin}, sort_keys=False, width=110))

    def clear_results(self):
        """Remove what an earlier run computed; case and status stay."""
        for file in (
            self.history_file,
            self.frames_file,
            self.xdmf_file,
            self.checkpoint_file,
            self.checkpoint_previous,
            self.summary_file,
        ):
            file.unlink(missing_ok=True)

    def rewind(self, time):
        """Drop the rows of the history and the frames that are later than ``time``.

        Raises DamagedRunError if the history ends before ``time``.
        """
        lines = self.history_file.read_text().splitlines(keepends=True) if self.history_file.exists() else []
        lines = [line for line in lines if line.endswith("\n")]  # a killed run may leave half a row
        header, rows = lines[:1], lines[1:]
        rows = [row for row in rows if float(row.split(",", 1)[0]) <= time]
        reached = float(rows[-1].split(",", 1)[0]) if rows else 0.0
        if reached != time:
            raise DamagedRunError(
                f"{self.history_file}: ends at t = {reached:g}, before the checkpoint at t = {time:g};"
                " start anew with --restart."
            )
        with _replacing(self.history_file) as part:
            part.write_text("".join(header + rows))
        if any(t > time for t in self.frame_times()):
            with _replacing(self.frames_file) as part:
                shutil.copyfile(self.frames_file, part)
                with h5py.File(part, "r+") as file:
                    for name in [name for name in _frames(file) if file[name].attrs["time"] > time]:
                        del file[name]
        self._write_xdmf()

    # Status

    def status(self):
        """Return the stored status: ``state``, ``reason``, ``wall_time`` [s]; empty before the first run."""
        return yaml.safe_load(self.status_file.read_text()) if self.status_file.exists() else {}

    def write_status(self, state, reason="", wall_time=0.0):
        """Store ``state`` (running, interrupted, finished or failed), the reason and the wall time [s] spent."""
        with _replacing(self.status_file) as part:
            part.write_text(
                yaml.safe_dump({"state": state, "reason": reason, "wall_time": float(wall_time)}, sort_keys=False)
            )

    # History

    def append_history(self, row):
        """Append ``row``, a dict of column name to number that begins with ``time``, and flush it.

        Numbers are written so that they read back to the same bits. Raises RunDirectoryError if the file
        has other columns.
        """
        header = ",".join(row) + "\n"
        with open(self.history_file, "a+") as file:
            if file.tell() == 0:
                file.write(header)
            else:
                file.seek(0)
                if file.readline() != header:
                    raise RunDirectoryError(
                        f"{self.history_file}: has other columns, written by another version;"
                        " start anew with --restart."
                    )
            values = (repr(int(v) if isinstance(v, (int, np.integer)) else float(v)) for v in row.values())
            file.write(",".join(values) + "\n")

    def last_row(self):
        """Return the last whole row of the history, column to number, reading no other; empty if none."""
        if not self.history_file.exists():
            return {}
        with open(self.history_file, "rb") as file:
            columns = file.readline().decode().strip().split(",")
            file.seek(max(file.tell(), os.path.getsize(self.history_file) - _LONGEST_ROW))
            whole = file.read().decode().split("\n")[:-1]
        values = whole[-1].split(",") if whole else []
        return dict(zip(columns, map(float, values))) if len(values) == len(columns) else {}

    def history(self):
        """Return the history as a dict of column name to array (n_steps,); empty before the first step."""
        if not self.history_file.exists():
            return {}
        with open(self.history_file, newline="") as file:
            header, *rows = list(csv.reader(file)) or [[]]
        rows = [row for row in rows if len(row) == len(header)]  # a killed run may leave half a row
        return dict(zip(header, np.array(rows, dtype=float).T))

    # Frames

    def write_frame(self, time, connectivity, node_arrays, cell_arrays):
        """Store the shape at ``time`` as the next frame.

        ``connectivity`` (n_elements, 3) is the same for all frames; ``node_arrays`` maps names to arrays
        (n_nodes,) or, for ``position`` [a0], (n_nodes, 3); ``cell_arrays`` to arrays (n_elements,).

        Raises ValueError if the connectivity is not that of the earlier frames.
        """
        with _replacing(self.frames_file) as part:
            if self.frames_file.exists():
                shutil.copyfile(self.frames_file, part)
            with h5py.File(part, "a") as file:
                if "connectivity" not in file:
                    file.attrs["units"] = "length a0, time a0^2/D, energy kT, density c_r0"
                    file["connectivity"] = np.asarray(connectivity, dtype=np.int64)
                elif not np.array_equal(file["connectivity"], connectivity):
                    raise ValueError("the connectivity of a frame differs from that of the frames before it")
                group = file.create_group(f"frame_{len(_frames(file)):04d}")
                group.attrs["time"] = time
                for center, arrays in (("Node", node_arrays), ("Cell", cell_arrays)):
                    for name, values in arrays.items():
                        group[name] = np.asarray(values, dtype=np.float64)
                        group[name].attrs["center"] = center
        self._write_xdmf()

    def frame_times(self):
        """Return the times of the stored frames, in order."""
        if not self.frames_file.exists():
            return []
        with h5py.File(self.frames_file, "r") as file:
            return [float(file[name].attrs["time"]) for name in _frames(file)]

    def _write_xdmf(self):
        """Describe frames.h5 for ParaView: a series in time of triangles with node and cell values."""
        from vesdyn.kinds import kind_of  # here: the kernels are slow to import, and only a run needs them

        root = ElementTree.Element("Xdmf", Version="3.0")
        series = ElementTree.SubElement(ElementTree.SubElement(root, "Domain"), "Grid")
        series.attrib.update(Name="vesicle", GridType="Collection", CollectionType="Temporal")

        def add_data(parent, dataset):
            item = ElementTree.SubElement(parent, "DataItem", Format="HDF", Precision="8")
            item.attrib["NumberType"] = "Int" if dataset.dtype.kind == "i" else "Float"
            item.attrib["Dimensions"] = " ".join(map(str, dataset.shape))
            item.text = f"{self.frames_file.name}:{dataset.name}"

        with h5py.File(self.frames_file, "r") as file:
            connectivity = file["connectivity"]
            element, coordinates = kind_of(connectivity.shape[1]).XDMF
            for name in _frames(file):
                grid = ElementTree.SubElement(series, "Grid", Name=name, GridType="Uniform")
                ElementTree.SubElement(grid, "Time", Value=repr(float(file[name].attrs["time"])))
                corners = str(connectivity.shape[1])
                topology = ElementTree.SubElement(grid, "Topology", TopologyType=element, NodesPerElement=corners)
                topology.attrib["NumberOfElements"] = str(len(connectivity))
                add_data(topology, connectivity)
                add_data(ElementTree.SubElement(grid, "Geometry", GeometryType=coordinates), file[name]["position"])
                for dataset in file[name].values():
                    if dataset.ndim == 1:
                        attribute = ElementTree.SubElement(grid, "Attribute", AttributeType="Scalar")
                        attribute.attrib.update(Name=dataset.name.split("/")[-1], Center=dataset.attrs["center"])
                        add_data(attribute, dataset)
        ElementTree.indent(root)
        with _replacing(self.xdmf_file) as part:
            ElementTree.ElementTree(root).write(part, encoding="utf-8", xml_declaration=True)

    # Checkpoints

    def write_checkpoint(self, state):
        """Store ``state``, a dict of names to arrays, floats and ints, bit for bit; keep the one before it."""
        if self.history_file.exists():  # the rows must not reach the disk after the checkpoint that implies them
            with open(self.history_file, "rb+") as file:
                os.fsync(file.fileno())
        with _replacing(self.checkpoint_file) as part:
            with h5py.File(part, "w") as file:
                for name, value in state.items():
                    file[name] = value
                file.attrs["checksum"] = _checksum(state)
            if self.checkpoint_file.exists():
                os.replace(self.checkpoint_file, self.checkpoint_previous)

    def read_checkpoint(self):
        """Return the latest checkpoint that is whole, or None if there is none yet.

        Warns if that is not the last one written. Raises DamagedRunError if all are damaged.
        """
        files = [file for file in (self.checkpoint_file, self.checkpoint_previous) if file.exists()]
        for file in files:
            try:
                return _read_checkpoint(file)
            except (OSError, KeyError, ValueError, RuntimeError):
                warnings.warn(f"{file}: is damaged and left aside.", stacklevel=2)
        if files:
            raise DamagedRunError(f"{self.path}: no checkpoint in it is whole; start anew with --restart.")
        return None


def provenance():
    """Return what computes here and now: date, versions, and the commit of the source tree if it is one."""
    return {
        "date": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        "vesdyn": vesdyn.__version__,
        "commit": _commit(),
        "python": platform.python_version(),
        **{package: version(package) for package in ("numba", "numpy", "scipy")},
        "machine": platform.machine(),
    }


def _commit():
    """Return the git commit of the package's sources, ``-dirty`` if changed since, or None if not under git."""

    def git(*arguments):
        command = ["git", "-C", Path(__file__).parent, *arguments]
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=10).stdout.strip()

    try:
        git("ls-files", "--error-unmatch", Path(__file__).name)  # an installed copy inside another project's tree
        return git("describe", "--always", "--dirty", "--abbrev=40", "--exclude=*")
    except (OSError, subprocess.SubprocessError):
        return None


@contextmanager
def _replacing(file):
    """Yield a path to write to; what is there in the end takes the place of ``file`` in one atomic move."""
    part = file.with_name(file.name + ".part")
    part.unlink(missing_ok=True)
    try:
        yield part
        with open(part, "rb+") as handle:
            os.fsync(handle.fileno())
        os.replace(part, file)
    finally:
        part.unlink(missing_ok=True)


def _frames(file):
    """Return the names of the frames of an open frames.h5, in order."""
    return sorted((name for name in file if name.startswith("frame_")), key=lambda name: int(name[6:]))


def _read_checkpoint(path):
    """Return the state in ``path``; raise one of the errors of h5py, or ValueError if the checksum is wrong."""
    with h5py.File(path, "r") as file:
        state = {name: dataset[()] for name, dataset in file.items()}
        if file.attrs["checksum"] != _checksum(state):
            raise ValueError("wrong checksum")
    return {name: value if isinstance(value, np.ndarray) else value.item() for name, value in state.items()}


def _checksum(state):
    digest = hashlib.sha256()
    for name in sorted(state):
        value = np.asarray(state[name])
        digest.update(f"{name} {value.dtype.str} {value.shape};".encode())
        digest.update(value.tobytes())
    return digest.hexdigest()


def _flat(nested, prefix=""):
    """Return a nested dict as one of dotted keys."""
    flat = {}
    for key, value in nested.items():
        flat |= _flat(value, f"{prefix}{key}.") if isinstance(value, dict) else {f"{prefix}{key}": value}
    return flat
