"""The runs behind the figures, computed once and kept in runs/study/, and the style they are drawn in.

A run is named by a case of configs/ and what is changed in it, as `vesdyn run --set` takes it; unchanged, it is the
one that `vesdyn run` keeps. Stored runs are used again whatever the version that computed them: remove runs/study/
to measure anew.
"""
import argparse
import csv
import os
import re
import time
import warnings
import zlib
from pathlib import Path

import h5py
import matplotlib.style
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator
from scipy.interpolate import CubicSpline

from vesdyn.batch import run_batch
from vesdyn.case_file import load_case
from vesdyn.planning import needs_planning, plan
from vesdyn.run import run_case
from vesdyn.spreading import Spreading
from vesdyn.stepping import is_steady, step
from vesdyn.storage import RunDirectory

ROOT = Path(__file__).resolve().parents[1]
RUNS = ROOT / "runs" / "study"
CONFIGS = ROOT / "configs"
OUT = ROOT / "plots" / "out"
REFERENCE = ROOT / "tests" / "data" / "spreading_reference.csv"
REFERENCE_CASE = {"typical": "typical", "fig9-base": "fig9"}  # a case of configs/: its name in REFERENCE
LONGEST_NAME = 90
JOBS = len(os.sched_getaffinity(0))  # runs side by side
EVERY_RUN = {}  # changes made to each run: the tests make them brief
TITLE = {"typical": "typical case", "fig9-base": "soft case of Fig. 9"}

# Told apart by lightness as well; beside it, every curve has a marker or a line of its own
DARK, RED, GREEN, LIGHT = "#12355b", "#b5382a", "#3f8f78", "#e0a030"
_STYLE = {
    "font.size": 8,
    "axes.titlesize": 8,
    "axes.titlelocation": "left",
    "legend.fontsize": 7,
    "legend.frameon": False,
    "legend.handlelength": 2.6,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "lines.linewidth": 1.1,
    "lines.markersize": 4.5,
    "pdf.fonttype": 42,
}


# Runs ----------------------------------------------------------------------------------------------------


def case_of(scene, changes):
    """The case configs/``scene``.yaml with ``changes``, a dict of dotted keys.

    A scene that was computed independently stops at the listed times. What the case leaves to be chosen (`auto`)
    is planned. Returns the case and the decisions.
    """
    file = CONFIGS / f"{scene}.yaml"
    if scene in REFERENCE_CASE:
        end = changes.get("time.end", load_case(file).time.end)
        stops = {"output.frames": [t for t in listed(scene)[0].tolist() if t <= end]}
    else:
        stops = {}
    overrides = {**stops, **changes, **EVERY_RUN, "name": run_directory(scene, changes).name}
    case = load_case(file, [f"{key}={value}" for key, value in overrides.items()])
    return plan(case)[:2] if needs_planning(case) else (case, ())


def run_directory(scene, changes):
    """Where the run of ``scene`` with ``changes`` is kept."""
    if not changes:
        return RUNS.parent / scene
    words = [f"{key.split('.')[-1]}={value}" for key, value in changes.items()]
    name = re.sub(r"[^A-Za-z0-9.=_-]+", "", "_".join([scene, *words]))
    if len(name) > LONGEST_NAME:
        name = f"{name[: LONGEST_NAME - 9]}-{zlib.crc32(name.encode()):08x}"
    return RUNS / name


def note_file(what, changes, suffix):
    """Where figures that are not the history of a run are kept."""
    RUNS.mkdir(parents=True, exist_ok=True)
    return RUNS / f"{run_directory(what, changes).name}.{suffix}"


def prepare(wanted):
    """Run those of ``wanted``, pairs of a scene and its changes, that are not stored yet, side by side."""
    missing = {run_directory(*run): run for run in wanted if not is_finished(run_directory(*run))}
    if min(JOBS, len(missing)) == 1:
        missing = {}  # `finished` does it without another process
    for out in {directory.parent for directory in missing}:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # coarse on purpose
            cases = [case_of(*run)[0] for directory, run in missing.items() if directory.parent == out]
            outcomes = run_batch(cases, out, jobs=min(JOBS, len(cases)), show=False)
        _check(outcomes)


def finished(scene, changes):
    """The directory of ``scene`` with ``changes``, run if need be."""
    directory = run_directory(scene, changes)
    if not is_finished(directory):
        case, decisions = case_of(scene, changes)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # coarse on purpose
            outcome = run_case(case, directory, progress=False, decisions=decisions)
        _check([(case, outcome)])
    return RunDirectory(directory)


def is_finished(directory):
    """True where ``directory`` holds a run that came to its end."""
    return RunDirectory(directory).status().get("state") == "finished"


def _check(outcomes):
    for case, outcome in outcomes:
        if outcome.state != "finished":
            raise SystemExit(f"{case.name}: {outcome.state}, {outcome.reason}")


def history(scene, changes):
    """Columns of the history of ``scene`` with ``changes``, as arrays (n_steps,)."""
    return finished(scene, changes).history()


def frames(scene, changes):
    """Stored shapes of ``scene`` with ``changes``, in order: dicts of time, elements and stored arrays."""
    with h5py.File(finished(scene, changes).frames_file, "r") as file:
        groups = sorted((file[name] for name in file if name != "connectivity"), key=lambda g: g.attrs["time"])
        elements = file["connectivity"][()]
        return [{"time": g.attrs["time"], "elements": elements, **{name: g[name][()] for name in g}} for g in groups]


def mesh_of(scene, changes):
    """Front edge and number of nodes of a stored run."""
    directory = RunDirectory(run_directory(scene, changes))
    case = load_case(directory.case_file)
    return case.mesh.front_edge, len(Spreading(case).x)


def seconds(scene, changes):
    """CPU time [s] of the coupling steps of a stored run, compiled code at hand; measured once, then kept."""
    directory = run_directory(scene, changes)
    note = directory / "cpu_time.txt"
    if not note.exists():
        case = load_case(directory / "case.yaml")
        compile_kernels(case.model)
        note.write_text(repr(_time_steps(case)))
    return float(note.read_text())


def compile_kernels(model):
    """Take a few steps of a coarse body, so that a measurement after it holds no compilation."""
    changes = {"model": model, "mesh.front_edge": 0.05, "mesh.far_edge": 0.1, "time.end": 0.008, "time.step": 0.001,
               "output.frames": []}  # fmt: skip
    _time_steps(case_of("quick", changes)[0])


def _time_steps(case):
    sim = Spreading(case)
    began = time.process_time()
    while sim.time < case.time.end and not (case.time.step == "auto" and is_steady(sim)):
        step(sim, next(t for t in case.marks if t > sim.time))
    return time.process_time() - began


# Binding areas -------------------------------------------------------------------------------------------


def listed(scene):
    """Times [a0^2/D] and binding areas [a0^2] of the independent computation (tests/data/README.md)."""
    with open(REFERENCE, newline="") as file:
        wanted = REFERENCE_CASE.get(scene, "typical")
        rows = [row for row in csv.DictReader(file) if row["case"] == wanted]
    return tuple(np.array([float(row[key]) for row in rows]) for key in ("time", "binding_area"))


def area_at(rows, times):
    """Binding area [a0^2] at ``times``, which are times of steps or lie densely between them."""
    return value_at(rows, "binding_area", times)


def value_at(rows, column, times):
    """A column of a history at ``times``; once the run has ended, its last value.

    Between the steps it is interpolated by a cubic spline in sqrt(t), in which it is smooth at the start.
    """
    return CubicSpline(np.sqrt(rows["time"]), rows[column])(np.sqrt(np.minimum(times, rows["time"][-1])))


def area_error(rows, finest, start=0.01, end=np.inf):
    """Largest relative error of the binding area over all steps with ``start`` <= t <= ``end``."""
    t = rows["time"]
    use = (t >= start) & (t <= min(end, finest["time"][-1]))
    exact = area_at(finest, t[use])
    return np.max(np.abs(rows["binding_area"][use] / exact - 1.0))


def fitted_order(lengths, errors):
    """Slope of log error against log length."""
    return np.polyfit(np.log(lengths), np.log(np.abs(errors)), 1)[0]


# Figures -------------------------------------------------------------------------------------------------


def table(title, header, rows):
    """Print a table; numbers to four digits."""
    cells = [[f"{v:.4g}" if isinstance(v, float) else str(v) for v in row] for row in rows]
    widths = [max(len(line[k]) for line in [header, *cells]) for k in range(len(header))]
    print(f"\n{title}")
    for line in [header, *cells]:
        print("  " + "  ".join(text.rjust(width) for text, width in zip(line, widths)))


def panels(draw, name, out, size, shape=(1, 2)):
    """Let ``draw(a, b, ...)`` fill ``shape`` rows and columns of panels; store ``out``/``name``.png and .pdf."""

    def filled(figure):
        axes = figure.subplots(*shape, squeeze=False).ravel()
        draw(*axes)
        for letter, ax in zip("abcdefgh", axes):
            ax.set_title(f"({letter})", fontweight="bold")

    picture(filled, name, out, size)


def picture(draw, name, out, size):
    """Let ``draw(figure)`` fill a figure of ``size`` [inch] and store it as ``out``/``name``.png and .pdf."""
    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    with matplotlib.style.context(["default", _STYLE]):
        figure = Figure(figsize=size, layout="constrained")
        draw(figure)
        figure.savefig(out / f"{name}.png", dpi=300)
        figure.savefig(out / f"{name}.pdf", metadata={"CreationDate": None})
    print(f"\n{name}.png, {name}.pdf")


def as_percent(axis):
    """Label a logarithmic axis of relative errors in plain per cent."""
    axis.set_major_formatter(lambda v, _: f"{100 * v:g} %")


def legend_below(ax, title=None, columns=1):
    """Put the legend under the panel, where it hides nothing."""
    ax.legend(
        title=title, title_fontsize=7, loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=columns, columnspacing=1.0
    )


def plain(axis, ticks):
    """Mark a logarithmic axis at ``ticks`` that are in sight, in plain numbers."""
    low, high = axis.get_view_interval()
    axis.set_major_locator(FixedLocator([t for t in ticks if low <= t <= high]))
    axis.set_major_formatter(lambda v, _: f"{v:g}")
    axis.set_minor_locator(NullLocator())


def command_line(default=OUT):
    """Read the command line of a script: set the number of runs side by side, return where the result goes."""
    global JOBS
    parser = argparse.ArgumentParser()
    parser.add_argument("--out", type=Path, default=default, metavar="DIR", help="where the result goes")
    parser.add_argument("--jobs", type=int, default=JOBS, metavar="N", help="runs side by side (default: one a core)")
    arguments = parser.parse_args()
    JOBS = arguments.jobs
    return arguments.out
