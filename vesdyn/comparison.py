"""Runs side by side: a row of numbers for each, the keys in which they differ, and their curves in one picture."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import matplotlib.style
import numpy as np
from matplotlib.figure import Figure

from vesdyn.case import KEYS
from vesdyn.errors import CaseError, RunError
from vesdyn.files import replace_file
from vesdyn.pictures import BINDING_AREA, LOOKS, TIME, store_figure
from vesdyn.results import History, Run, open_run
from vesdyn.units import Scales, beside

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
    cases = [run.case for run in runs]
    return [key for key in KEYS if key != "name" and any(case.get(key) != cases[0].get(key) for case in cases[1:])]


def histories(runs: Sequence[Run]) -> list[History | None]:
    """The histories of ``runs``; None for one that is not as it was written."""
    found = []
    for run in runs:
        try:
            found.append(run.history)
        except RunError:
            found.append(None)
    return found


def measured(history: History | None) -> dict[str, float]:
    """The `MEASURES` of a run with this ``history``, as far as it has come; nan where it has no step, or is damaged."""
    row = dict.fromkeys(MEASURES, np.nan)
    if not history:
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


def rows(runs: Sequence[Run], found: Sequence[History | None]) -> list[dict]:
    """A row for each of ``runs`` with the histories ``found``: name, state, the keys in which they differ, `MEASURES`."""
    keys, told = differing_keys(runs), []
    for run, history in zip(runs, found):
        state = "damaged" if history is None else run.status.get("state", "not begun")
        told.append({"name": run.case.name, "state": state} | {key: _given(run.case, key) for key in keys} | measured(history))
    return told


def _given(case, key):
    """The value of the dotted ``key``, as a quantity where it was given as one."""
    return case.quantities.get(key, case.get(key))


def as_csv(found: Sequence[dict]) -> str:
    """The `rows` as text of a CSV file, numbers in full."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(found[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(found)
    return text.getvalue()


def as_text(found: Sequence[dict], scales: Sequence[Scales | None]) -> str:
    """The `rows` as a table to read, with units; lengths and times also in SI where a run has ``scales``, its own."""

    def shown(name, value, own):
        if not isinstance(value, float):
            return str(value)
        return f"{value:.4g}" + (beside(value, MEASURES[name][0], own) if name in MEASURES and np.isfinite(value) else "")

    units = {name: f" [{unit}]" for name, (unit, _) in MEASURES.items() if unit != "1"}
    table = [[f"{name}{units.get(name, '')}" for name in found[0]]]
    table += [[shown(name, value, own) for name, value in row.items()] for row, own in zip(found, scales)]
    widths = [max(map(len, column)) for column in zip(*table)]
    return "\n".join("  ".join(f"{cell:<{width}}" for cell, width in zip(line, widths)).rstrip() for line in table)


def draw(runs: Sequence[Run], found: Sequence[History | None], directory: str | Path, name: str = PICTURE) -> None:
    """Draw the binding areas of ``runs`` over time, each with the error it believes in, as ``name`` in ``directory``.

    ``found`` are their histories; a run without a step, or a damaged one, has no curve.

    Raises vesdyn.files.WriteError if it cannot be written.
    """
    keys = differing_keys(runs)
    with matplotlib.style.context(["default", LOOKS]):
        figure = Figure(figsize=(6.4, 4.2), dpi=150, layout="constrained")
        axes = figure.subplots()
        colors = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.9, len(runs)))
        for run, history, color in zip(runs, found, colors):
            if not history:
                continue
            time, area = history["time"], history["binding_area"]
            error = np.nan_to_num(history["area_error"]) if "area_error" in history else 0.0 * area
            given = ", ".join(f"{key} {_given(run.case, key)}" for key in keys)
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
        store_figure(figure, Path(directory), name)


def leave_results(paths: Sequence[str | Path], directory: str | Path) -> None:
    """Write RESULTS and PICTURE of the runs in ``paths`` that have a step into ``directory``.

    Raises vesdyn.files.WriteError if they cannot be written.
    """
    runs = []
    for path in paths:
        with suppress(CaseError, RunError):  # its outcome has told
            runs.append(open_run(path))
    begun = [(run, history) for run, history in zip(runs, histories(runs)) if history]
    if begun:
        runs, found = zip(*begun)
        replace_file(Path(directory), RESULTS, as_csv(rows(runs, found)).encode())
        draw(runs, found, directory)
