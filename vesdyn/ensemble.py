"""Curves of the cases of an inference at many points of its unknowns: run as batches, once, and kept.

A run leaves one small file, named by a hash of its case, in a folder named by a hash of the sources that computed it,
so nothing is ever taken from another version, and a batch that was stopped goes on, under other priors too. Where a
case leaves the body to be chosen it is chosen once, for the case as given, and is the same at all points; mesh and step
are those that each point needs for the accuracy wish.
"""

import csv
import hashlib
import io
import json
import shutil
import warnings
import zipfile
import zlib
from contextlib import suppress
from pathlib import Path

import numpy as np

from vesdyn import files
from vesdyn.batch import run_batch
from vesdyn.errors import RunError
from vesdyn.files import make_directory, replace_file
from vesdyn.planning import needs_planning, plan
from vesdyn.provenance import sources_hash
from vesdyn.quantities import COLUMNS
from vesdyn.storage import RunDirectory

_CHUNK = 128  # runs of one batch


class Ensemble:
    """The runs of ``inference`` (`vesdyn.inference_file.Inference`), kept in ``directory``.

    ``jobs``, ``scheduler`` and ``show`` as for `vesdyn.batch.run_batch`; ``runs`` counts those computed here.
    """

    def __init__(self, inference, directory, jobs=None, scheduler=None, show=True):
        self.inference, self.directory = inference, Path(directory)
        self.options = {"jobs": jobs, "scheduler": scheduler, "show": show}
        self.curves = self.directory / "curves" / sources_hash()[:12]
        self.runs = 0
        self._cases, self._bodies = {}, {}

    def quantities(self, places, accuracy):
        """Numbers (n_points, n_quantities) at ``places`` (n_points, n_unknowns); NaN where a run failed."""
        self._prepare(places, accuracy)
        names = list(self.inference.scenes)
        table = []
        for values in self.inference.values(places):
            rows = {name: _read(self._file(name, values, accuracy)) or {} for name in names}
            table.append([q.of(rows[q.case]) if rows[q.case] else np.nan for q in self.inference.quantities])
        return np.array(table).reshape(-1, len(self.inference.quantities))

    def remembered(self, stage):
        """Places (n, n_unknowns) that an earlier inference here noted for a ``stage`` and that lie in the priors."""
        keys = list(self.inference.unknowns)
        values = [values for noted, *values in self._noted() if noted == stage]
        places = self.inference.places(np.array(values).reshape(-1, len(keys)))
        return places[np.all((places >= 0.0) & (places <= 1.0), axis=1)]

    def remember(self, stage, places):
        """Note ``places`` (n, n_unknowns) for a ``stage``: once chosen they are used again, whatever data are added."""
        make_directory(self.curves)
        text = io.StringIO()
        more = [[stage, *map(float, values)] for values in self.inference.values(places)]
        csv.writer(text).writerows([["stage", *self.inference.unknowns], *self._noted(), *more])
        replace_file(self.curves, self._notes.name, text.getvalue().encode())

    def _noted(self):
        """Rows of stage and values of the unknowns, as far as they were noted whole."""
        keys, rows = list(self.inference.unknowns), []
        with suppress(OSError, ValueError, csv.Error):
            for row in csv.DictReader(io.StringIO(self._notes.read_text(encoding="utf-8"))):
                with suppress(KeyError, TypeError, ValueError):
                    rows.append([row["stage"], *(float(row[key]) for key in keys)])
        return rows

    @property
    def _notes(self):
        digest = hashlib.sha256(" ".join(self.inference.unknowns).encode()).hexdigest()[:8]
        return self.curves / f"places-{digest}.csv"

    def _prepare(self, places, accuracy):
        """Run what is missing, in batches; raise KeyboardInterrupt where one is interrupted."""
        wanted = {self._file(name, values, accuracy): (name, values)
                  for values in self.inference.values(places) for name in self.inference.scenes}  # fmt: skip
        missing = [(file, *run) for file, run in wanted.items() if _read(file) is None]
        make_directory(self.curves)
        for start in range(0, len(missing), _CHUNK):
            some = missing[start : start + _CHUNK]
            files = {file.stem: file for file, _, _ in some}
            cases = [self._case(name, values, accuracy).model_copy(update={"name": file.stem}) for file, name, values in some]
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # coarse on purpose, and checked
                outcomes = run_batch(cases, self.directory / "runs", pictures=False, **self.options)
            for case, outcome in outcomes:
                if outcome.state == "interrupted":
                    raise KeyboardInterrupt
                self._keep(RunDirectory(self.directory / "runs" / case.name), outcome, files[case.name])
            self.runs += len(some)

    def _keep(self, directory, outcome, file):
        """Store the columns of a finished run, or nothing of one that failed, and remove its directory.

        Raises vesdyn.errors.RunError where none was begun, which is no fault of the point.
        """
        if not directory.path.exists():
            raise RunError(f"{file.stem}: {outcome.reason}")
        rows = {}
        if outcome.state == "finished":
            history = directory.history()
            rows = {column: history[column] for column in ("time", *COLUMNS)}
        elif outcome.disturbed:  # it may succeed another time
            raise RunError(f"{file.stem}: {outcome.reason}")
        else:
            warnings.warn(f"{file.stem}: {outcome.reason} The point is left out.", stacklevel=2)
        content = io.BytesIO()
        np.savez_compressed(content, of=file.stem, **rows)
        replace_file(file.parent, file.name, content.getvalue())
        shutil.rmtree(directory.path, ignore_errors=True)

    def _file(self, name, values, accuracy):
        """Where the curve of the case ``name`` is kept, whether it is there or not; the priors have no part in it."""
        whole = json.dumps([self._given(name).to_yaml(), self.inference.settings(name, values), accuracy], sort_keys=True)
        return self.curves / f"{name}-{hashlib.sha256(whole.encode()).hexdigest()[:16]}.npz"

    def _case(self, name, values, accuracy):
        """The case as it is run: no frames, the body that the case as given has, a mesh of its own."""
        if name not in self._bodies:
            given = self._given(name)
            self._bodies[name] = (plan(given).case if needs_planning(given) else given).model
        case = self.inference.case(name, self.inference.settings(name, values), accuracy)
        output = case.output.model_copy(update={"frames": ()})
        return case.model_copy(update={"model": self._bodies[name], "output": output})

    def _given(self, name):
        """The case ``name`` with what its inference file sets in it."""
        if name not in self._cases:
            self._cases[name] = self.inference.case(name, self.inference.scenes[name].set, self.inference.design.accuracy)
        return self._cases[name]


def _read(file):
    """Columns of a kept curve, none where the run failed; None where there is no file, or it is damaged or another's."""
    try:
        with np.load(io.BytesIO(files.read(file))) as stored:
            columns = {column: stored[column] for column in stored.files}
    except (OSError, ValueError, EOFError, KeyError, NotImplementedError, zipfile.BadZipFile, zlib.error):
        return None
    return columns if str(columns.pop("of", "")) == file.stem else None
