"""Looks: the style of the figures, what several of them draw alike, tables, and the command line of a script.

A script has constants, ``measure(study)``, which returns plain values, and ``draw(measured, out)``.
"""

import argparse
import csv
import sys
from pathlib import Path

import matplotlib.style
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator

from vesdyn.errors import CaseError, RunError
from vesdyn.pictures import store_figure
from vesdyn.study import SNAPSHOTS, UNCHANGED, Study, common_times, holds_from, separation

ROOT = Path(__file__).resolve().parents[1]
OUT = ROOT / "plots" / "out"
DRAWS = ROOT / "docs" / "inference-draws.csv"
DATA = ROOT / "tests" / "data"  # tables of independent computations
INDEPENDENT = {"drag": 0.07, "receptors.mobility": 2.1875}  # of the independent computation, and of all that is compared with it
TITLE = {"typical": "typical case", "fig9-base": "soft case of Fig. 9"}

# Told apart by lightness as well; beside it, every curve has a marker or a line of its own
DARK, RED, GREEN, LIGHT = "#12355b", "#b5382a", "#3f8f78", "#e0a030"
LINES = (
    (DARK, "-"),
    (RED, "--"),
    (GREEN, "-."),
    (LIGHT, (0, (4, 1, 1, 1, 1, 1))),
    ("0.5", ":"),
)  # from dark to light
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

TIME = "time $t$ [$a_0^2/D$]"
AREA = "binding area $A$ [$a_0^2$]"
SYMBOLS = {
    "membrane.shear_modulus": "$K$",
    "membrane.thickness": "$h$",
    "adhesion.traction": r"$T_\mathrm{max}$",
    "adhesion.cutoff": "$d_c$",
    "adhesion.ligand_ratio": "$c_l/c_{r0}$",
    "receptors.mobility": r"$\hat M$",
    "receptors.drift_number": r"$\Lambda$",
    "drag": r"$\eta$",
}
UNITS = {"membrane.shear_modulus": "$kT/a_0^2$", "adhesion.traction": "$kT/a_0^3$", "adhesion.cutoff": "$a_0$"}


# Scripts -------------------------------------------------------------------------------------------------


def command_line(measure, draw, out=OUT, every=UNCHANGED):
    """Carry out a script: what ``measure`` makes of a study is drawn into the folder that the command line names.

    ``every`` holds changes made to each run.
    """
    parser = argparse.ArgumentParser(description=sys.modules["__main__"].__doc__.split("\n")[0])
    parser.add_argument(
        "--out", type=Path, default=out, metavar="DIR", help="where the result goes (default: %(default)s)"
    )
    parser.add_argument(
        "--runs", type=Path, default=ROOT / "runs" / "study", metavar="DIR", help="where runs are kept"
    )
    parser.add_argument("--jobs", type=int, metavar="N", help="runs side by side (default: one a core)")
    arguments = parser.parse_args()
    try:
        draw(measure(Study(arguments.runs, jobs=arguments.jobs, show=True, every=every,
                           draws=drawn_parameters())), arguments.out)  # fmt: skip
    except (CaseError, RunError, OSError) as error:
        raise SystemExit(str(error)) from None
    except KeyboardInterrupt:
        raise SystemExit(130) from None


def drawn_parameters():
    """Changes of a case for each draw of the parameters from the posterior (`plots/calibration.py`)."""
    if not DRAWS.exists():
        return ()
    with open(DRAWS, newline="") as file:
        return tuple({key: float(value) for key, value in row.items()} for row in csv.DictReader(file))


def data(name):
    """Rows of tests/data/``name``.csv as dicts of text (tests/data/README.md)."""
    with open(DATA / f"{name}.csv", newline="") as file:
        return list(csv.DictReader(file))


def independent_areas(scene):
    """Times [a0^2/D] and binding areas [a0^2] of the independent computation of ``scene``, typical or fig9-base."""
    name = {"typical": "typical", "fig9-base": "fig9"}[scene]
    rows = [row for row in data("spreading_reference") if row["case"] == name]
    return tuple(np.array([float(row[key]) for row in rows]) for key in ("time", "binding_area"))


def table(title, header, rows):
    """Print a table; numbers to four digits."""
    cells = [[f"{v:.4g}" if isinstance(v, float) else str(v) for v in row] for row in rows]
    widths = [max(len(line[k]) for line in [header, *cells]) for k in range(len(header))]
    print(f"\n{title}")
    for line in [header, *cells]:
        print("  " + "  ".join(text.rjust(width) for text, width in zip(line, widths)))


# Pictures ------------------------------------------------------------------------------------------------


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
        for suffix, options in (("png", {"dpi": 300}), ("pdf", {"metadata": {"CreationDate": None}})):
            store_figure(figure, out, f"{name}.{suffix}", **options)
    print(f"\n{name}.png, {name}.pdf")


def as_percent(axis):
    """Label a logarithmic axis of relative errors in plain per cent."""
    axis.set_major_formatter(lambda v, _: f"{100 * v:g} %")


def legend_below(ax, title=None, columns=1):
    """Put the legend under the panel, where it hides nothing."""
    ax.legend(
        title=title,
        title_fontsize=7,
        loc="upper center",
        bbox_to_anchor=(0.5, -0.17),
        ncols=columns,
        columnspacing=1.0,
    )


def plain(axis, ticks):
    """Mark a logarithmic axis at ``ticks`` that are in sight, in plain numbers."""
    low, high = axis.get_view_interval()
    axis.set_major_locator(FixedLocator([t for t in ticks if low <= t <= high]))
    axis.set_major_formatter(lambda v, _: f"{v:g}")
    axis.set_minor_locator(NullLocator())


# Curves --------------------------------------------------------------------------------------------------


def tabulate(figure, curves, key):
    """Print what the ``curves`` of a figure come to."""
    times = SNAPSHOTS[:3]
    table(
        f"{figure}: areas [a0^2] and times [a0^2/D]",
        [key, "error", *(f"A({t:g})" for t in times), "A at the end", "t of 95 %", "t of 99 %", "end"],
        [
            (c.value(key), c.error(), *map(float, c.at(times)), c.final, c.time_of(0.95), c.time_of(0.99), c.end)
            for c in curves
        ],
    )
    if len(curves) > 1:
        table(
            "neighbours: time from which their order holds beyond their errors, relative distance at the end, errors",
            ["", "from", "distance", "errors"],
            [
                (f"{a.value(key):g}, {b.value(key):g}", min(holds_from(a, b), holds_from(b, a)),
                 b.final / a.final - 1.0, a.error() + b.error())
                for a, b in zip(curves, curves[1:])
            ],
        )  # fmt: skip


def draw_areas(ax, curves, key, until=None):
    """A(t) of ``curves`` in bands of their errors; one that came to rest before the end stays where it is.

    A second, faint band is where the curve may lie for what the prints leave open of drag, mobility, thickness and prestretch.
    """
    end = until or max(curve.end for curve in curves)
    for curve, (color, line) in zip(curves, LINES):
        t, area = curve.history["time"], curve.history["binding_area"]
        t, area = np.concatenate([[0.0], t, [max(end, t[-1])]]), np.concatenate([[0.0], area, area[-1:]])
        error = curve.error()
        label = f"{SYMBOLS[key]} = {curve.value(key):g}  ($\\pm${100 * error:.1f} %)"
        ax.plot(t, area, color=color, linestyle=line, label=label)
        ax.fill_between(t, area * (1 - error), area * (1 + error), color=color, alpha=0.25, linewidth=0)
        if (band := curve.band(times := np.linspace(0.0, end, 200)[1:])) is not None:
            ax.fill_between(times, *band, color=color, alpha=0.1, linewidth=0)
    ax.set(xlabel=TIME, ylabel=AREA, xlim=(0.0, end), ylim=(0.0, None))
    ax.legend(loc="lower right", title=UNITS.get(key) and f"{SYMBOLS[key]} in {UNITS[key]}", title_fontsize=7)


def draw_separations(ax, curves, key):
    """Relative distance of each curve from its neighbour, beside what the errors of the two allow."""
    times = common_times(curves)
    for lower, upper, (color, line) in zip(curves, curves[1:], LINES):
        if upper.final < lower.final:
            lower, upper = upper, lower
        apart, allowed = separation(lower, upper, times)
        ax.loglog(times, np.where(apart > 0, apart, np.nan), color=color, linestyle=line,
                  label=f"{upper.value(key):g} above {lower.value(key):g}")  # fmt: skip
        ax.axhline(allowed, color=color, linestyle=line, linewidth=0.6, alpha=0.7)
    ax.set(xlabel=TIME, ylabel="distance of neighbouring curves / $A$")
    plain(ax.xaxis, (0.01, 0.03, 0.1, 0.3, 1.0, 3.0))
    plain(ax.yaxis, (0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0))
    as_percent(ax.yaxis)
    legend_below(ax, "thin: errors of the two together")


def draw_exponents(ax, curves, key=None):
    """Local exponents of A(t), in bands of their errors, until 99 % of the final area.

    Beside them stands the exponent 1 of a front that diffusion alone feeds.
    """
    for curve, (color, line) in zip(curves, LINES):
        times = np.geomspace(0.006, max(0.01, curve.time_of(0.99)), 120)
        exponent, error = curve.exponent(times), curve.exponent_error(times)
        ax.semilogx(
            times, exponent, color=color, linestyle=line, label=key and f"{SYMBOLS[key]} = {curve.value(key):g}"
        )
        ax.fill_between(times, exponent - error, exponent + error, color=color, alpha=0.25, linewidth=0)
    ax.axhline(1.0, color="0.6", linewidth=0.7)
    place = {"xycoords": ("axes fraction", "data"), "xytext": (0, 2), "textcoords": "offset points", "ha": "right"}
    ax.annotate("infinite medium", (0.99, 1.0), **place, color="0.35", fontsize=7)
    ax.set(xlabel=TIME, ylabel=r"local exponent $\mathrm{d}\ln A\,/\,\mathrm{d}\ln t$", ylim=(0.0, 1.15))
    plain(ax.xaxis, (0.01, 0.03, 0.1, 0.3, 1.0))


def draw_family(figure, curves, key, out):
    """One figure: A(t) of ``curves``, which differ in ``key``, and what sets them apart."""
    tabulate(figure.replace("figure", "Fig. "), curves, key)

    def fill(areas, distances):
        draw_areas(areas, curves, key, until=1.2)
        draw_separations(distances, curves, key)

    panels(fill, figure, out, size=(7.2, 3.4))
