"""Runs side by side: a row of numbers for each, the keys in which they differ, and their curves in one picture."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path

import matplotlib.style
import numpy as np
from matplotlib.figure import Figure

from vesdyn.case import SECTIONS
from vesdyn.errors import CaseError, RunError
from vesdyn.files import replace_file
from vesdyn.pictures import BINDING_AREA, LOOKS, TIME
from vesdyn.results import Run, open_run

RESULTS, PICTURE = "results.csv", "results.png"  # that a batch leaves
MEASURES = {  # of a run: unit and meaning
    "time": ("a0^2/D", "how far the run has come"),
    "binding_area": ("a0^2", "binding area then"),
    "area_error": ("1", "its relative error, as the run believes"),
    "contact_radius": ("a0", "contact radius then"),
    "t50": ("a0^2/D", "when half of that binding area was reached"),
    "t95": ("a0^2/D", "when 95 % of it were reached"),
    "density_max": ("c_r0", "largest receptor density of all times"),
}
_MOST_CURVES = 12  # in one picture, with a legend


def open_runs(paths: Sequence[str | Path]) -> list[Run]:
    """Open the runs in the directories ``paths``; raise CaseError or RunError where one is none, or damaged."""
    if not paths:
        raise CaseError("compare: no run is named; give the directories of runs.")
    return [open_run(path) for path in paths]


def differing_keys(runs: Sequence[Run]) -> list[str]:
    """Dotted keys, the name aside, whose values are not the same in all of ``runs``."""
    values = [run.case.resolved() for run in runs]
    keys = [(section, key) for section, keys in SECTIONS.items() for key in keys or [None] if section != "name"]

    def value(one, section, key):
        return one[section] if key is None else one[section][key]

    return [
        section if key is None else f"{section}.{key}"
        for section, key in keys
        if any(value(one, section, key) != value(values[0], section, key) for one in values[1:])
    ]


def measured(run: Run) -> dict[str, float | str]:
    """Name, state and the `MEASURES` of ``run``, as far as it has come; nan where it has no step.

    Raises vesdyn.storage.DamagedRunError if its history is not as it was written.
    """
    history = run.history
    row = {"name": run.case.name, "state": run.status.get("state", "not begun")} | dict.fromkeys(MEASURES, np.nan)
    if not len(history.get("time", ())):
        return row
    time, area = (np.concatenate([[0.0], history[name]]) for name in ("time", "binding_area"))
    row |= {name: history[name][-1] for name in ("time", "binding_area", "area_error", "contact_radius") if name in history}
    row |= {f"t{share}": _first_time(time, area, share / 100.0 * area[-1]) for share in (50, 95)}
    return row | {"density_max": history["density_max"].max()}


def _first_time(time, area, level):
    """When ``area`` first comes to ``level``, linear between steps."""
    if not level > 0.0:
        return np.nan
    k = int(np.argmax(area >= level))
    return float(np.interp(level, area[k - 1 : k + 1], time[k - 1 : k + 1])) if k else float(time[0])


def rows(runs: Sequence[Run]) -> list[dict]:
    """A row for each of ``runs``: name, state, the keys in which they differ, `MEASURES`."""
    keys, found = differing_keys(runs), []
    for run in runs:
        try:
            row = measured(run)
        except RunError:
            row = {"name": run.case.name, "state": "damaged"} | dict.fromkeys(MEASURES, np.nan)
        given = {key: run.case.quantities.get(key, run.case.get(key)) for key in keys}
        found.append({"name": row.pop("name"), "state": row.pop("state")} | given | row)
    return found


def as_csv(found: Sequence[dict]) -> str:
    """The `rows` as text of a CSV file, numbers in full."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(found[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(found)
    return text.getvalue()


def as_text(found: Sequence[dict], scales=None) -> str:
    """The `rows` as a table to read, with units; times and areas also in SI where there are ``scales``."""

    def shown(name, value):
        if not isinstance(value, float):
            return str(value)
        told = scales.shown(value, MEASURES[name][0]) if scales and name in MEASURES and np.isfinite(value) else None
        return f"{value:.4g}" + (f" = {told}" if told else "")

    units = {name: f" [{unit}]" for name, (unit, _) in MEASURES.items() if unit != "1"}
    table = [[f"{name}{units.get(name, '')}" for name in found[0]]]
    table += [[shown(name, value) for name, value in row.items()] for row in found]
    widths = [max(map(len, column)) for column in zip(*table)]
    return "\n".join("  ".join(f"{cell:<{width}}" for cell, width in zip(line, widths)).rstrip() for line in table)


def draw(runs: Sequence[Run], directory: str | Path, name: str = PICTURE) -> None:
    """Draw the binding areas of ``runs`` over time, each with the error it believes in, as ``name`` in ``directory``.

    Raises vesdyn.files.WriteError if it cannot be written.
    """
    keys = differing_keys(runs)
    with matplotlib.style.context(["default", LOOKS]):
        figure = Figure(figsize=(6.4, 4.2), dpi=150, layout="constrained")
        axes = figure.subplots()
        colors = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.9, len(runs)))
        for run, color in zip(runs, colors):
            history = run.history
            time, area = history["time"], history["binding_area"]
            error = np.nan_to_num(history["area_error"]) if "area_error" in history else 0.0 * area
            given = ", ".join(f"{key} {run.case.quantities.get(key, run.case.get(key))}" for key in keys)
            label = run.case.name if len(given) > 40 or not given else given
            axes.fill_between(time, area * (1.0 - error), area * (1.0 + error), color=color, alpha=0.2, lw=0)
            axes.plot(time, area, color=color, label=label if len(runs) <= _MOST_CURVES else None)
        axes.set(xlabel=TIME, ylabel=BINDING_AREA)
        axes.set_xlim(left=0.0)
        axes.set_ylim(bottom=0.0)
        if len(runs) <= _MOST_CURVES:
            axes.legend(loc="lower right")
        else:
            axes.set_title(f"{len(runs)} runs, from dark to light in the order of the table")
        picture = io.BytesIO()
        figure.savefig(picture, format="png")
    replace_file(Path(directory), name, picture.getvalue())


def leave_results(paths: Sequence[str | Path], directory: str | Path) -> None:
    """Write RESULTS and PICTURE of the runs in ``paths`` that have a step into ``directory``.

    Raises vesdyn.files.WriteError if they cannot be written.
    """
    runs = []
    for path in paths:
        try:
            run = open_run(path)
            if len(run.history.get("time", ())):
                runs.append(run)
        except (CaseError, RunError):
            continue  # its outcome has told
    if runs:
        replace_file(Path(directory), RESULTS, as_csv(rows(runs)).encode())
        draw(runs, directory)
