"""The runs behind the figures, computed once and kept in runs/study/, and the style they are drawn in.

A run is named by a case of configs/ and what is changed in it, as `vesdyn run --set` takes it. Stored runs are
used again whatever the version that computed them: remove runs/study/ to measure anew.
"""
import argparse
import csv
import re
import time
import warnings
from pathlib import Path

import matplotlib.style
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator
from scipy.interpolate import CubicSpline

from vesdyn.case import load_case
from vesdyn.planning import needs_planning, plan
from vesdyn.run import run_case
from vesdyn.spreading import Spreading
from vesdyn.stepping import is_steady, step
from vesdyn.storage import RunDirectory

ROOT = Path(__file__).resolve().parents[1]
RUNS = ROOT / "runs" / "study"
OUT = ROOT / "plots" / "out"
REFERENCE = ROOT / "tests" / "data" / "spreading_reference.csv"
REFERENCE_CASE = {"typical": "typical", "fig9-base": "fig9"}  # a case of configs/: its name in REFERENCE
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
    """The case configs/``scene``.yaml with ``changes``, a dict of dotted keys; it stops at the listed times.

    What it leaves to be chosen (`auto`) is planned. Returns the case and the decisions.
    """
    end = changes.get("time.end", load_case(ROOT / "configs" / f"{scene}.yaml").time.end)
    stops = [t for t in listed(scene)[0].tolist() if t <= end]
    overrides = {"output.frames": stops, **changes}
    case = load_case(ROOT / "configs" / f"{scene}.yaml", [f"{key}={value}" for key, value in overrides.items()])
    return plan(case)[:2] if needs_planning(case) else (case, ())


def run_directory(scene, changes):
    """Where the run of ``scene`` with ``changes`` is kept."""
    values = [f"{key.split('.')[-1]}={value}" for key, value in changes.items()]
    return RUNS / re.sub(r"[^A-Za-z0-9.,=_-]+", "", ",".join([scene, *values]))


def note_file(what, changes, suffix):
    """Where figures that are not the history of a run are kept."""
    RUNS.mkdir(parents=True, exist_ok=True)
    return RUNS / f"{run_directory(what, changes).name}.{suffix}"


def history(scene, changes):
    """Columns of the history of ``scene`` with ``changes``, as arrays (n_steps,); run if need be."""
    directory = run_directory(scene, changes)
    if RunDirectory(directory).status().get("state") != "finished":
        case, decisions = case_of(scene, changes)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # coarse on purpose
            outcome = run_case(case, directory, progress=False, decisions=decisions)
        if outcome.state != "finished":
            raise SystemExit(f"{directory.name}: {outcome.state}, {outcome.reason}")
    return RunDirectory(directory).history()


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
    changes = {"model": model, "mesh.front_edge": 0.05, "mesh.far_edge": 0.1, "time.end": 0.008, "time.step": 0.001}
    _time_steps(case_of("quick", changes)[0])


def _time_steps(case):
    sim = Spreading(case)
    began = time.process_time()
    while sim.time < case.time.end and not (case.time.step == "auto" and is_steady(sim)):
        step(sim, next(t for t in case.stops if t > sim.time))
    return time.process_time() - began


# Binding areas -------------------------------------------------------------------------------------------


def listed(scene):
    """Times [a0^2/D] and binding areas [a0^2] of the independent computation (tests/data/README.md)."""
    with open(REFERENCE, newline="") as file:
        wanted = REFERENCE_CASE.get(scene, "typical")
        rows = [row for row in csv.DictReader(file) if row["case"] == wanted]
    return tuple(np.array([float(row[key]) for row in rows]) for key in ("time", "binding_area"))


def area_at(rows, times):
    """Binding area [a0^2] at ``times``, which are times of steps or lie densely between them.

    Between the steps A is interpolated by a cubic spline in sqrt(t), in which it is smooth at the start.
    """
    return CubicSpline(np.sqrt(rows["time"]), rows["binding_area"])(np.sqrt(times))


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


def panels(draw, name, out, size):
    """Let ``draw(a, b)`` fill two panels and store it as ``out``/``name``.png and .pdf."""
    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    with matplotlib.style.context(["default", _STYLE]):
        figure = Figure(figsize=size, layout="constrained")
        axes = figure.subplots(1, 2)
        draw(*axes)
        for letter, ax in zip("ab", axes):
            ax.set_title(f"({letter})", fontweight="bold")
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


def out_directory():
    """The directory given by --out on the command line."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--out", type=Path, default=OUT, metavar="DIR", help="where the figure goes")
    return parser.parse_args().out
