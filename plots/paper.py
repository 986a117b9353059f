"""The paper's curves as computed here, each with an error, and the look its Figs. 3 to 7 have in common.

A curve is a case of configs/, run at its own accuracy wish and once more at a quarter of it. Errors fall with
the wish (README, "Accuracy"), so the difference of the two runs is three quarters of the error of the first; what is
given as the error is the largest relative one of all t >= 0.01, mesh, step and tolerance together.
"""

import numpy as np
import study
from study import DARK, GREEN, LIGHT, RED

from vesdyn.case_file import load_case

FINER = 0.25  # wish of the second run / wish of the first
START = 0.01  # errors are those after this time [a0^2/D]
LOOKS = (
    (DARK, "-"),
    (RED, "--"),
    (GREEN, "-."),
    (LIGHT, (0, (4, 1, 1, 1, 1, 1))),
    ("0.5", ":"),
)  # from dark to light
ON_MERIDIAN = {"model": "axisymmetric", "mesh.front_edge": "auto", "mesh.far_edge": "auto", "time.step": "auto"}
TIME = "time $t$ [$a_0^2/D$]"
AREA = "binding area $A$ [$a_0^2$]"
RADIUS = "contact radius $r$ [$a_0$]"
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


def wished(name, changes):
    """The case of a curve as asked for, before anything that is `auto` is chosen."""
    return load_case(study.CONFIGS / f"{name}.yaml", [f"{key}={value}" for key, value in changes.items()])


def both_runs(name, changes):
    """What a curve is made from: pairs of a case of configs/ and its changes."""
    return (name, changes), (name, {**changes, "accuracy": wished(name, changes).accuracy * FINER})


class Curve:
    """A case of configs/ with ``changes``, a dict of dotted keys, run at its accuracy wish and at a quarter of it.

    One that is only to be compared with another in the wish's own accuracy takes its relative errors from that
    curve, ``like``, and is run once.
    """

    def __init__(self, name, changes, like=None):
        self.name, self.changes, self.like = name, changes, like
        self.case = wished(name, changes)
        own, finer = both_runs(name, changes)
        self.rows = study.history(*own)
        self.finer = self.rows if like else study.history(*finer)

    def value(self, key):
        """What the case says of ``key``, a dotted key."""
        found = self.case
        for part in key.split("."):
            found = getattr(found, part)
        return found

    def error(self, column="binding_area"):
        """Estimated relative error of a column of the history."""
        if self.like:
            return self.like.error(column)
        use = self.rows["time"] >= min(START, self.rows["time"][-1])
        exact = study.value_at(self.finer, column, self.rows["time"][use])
        return float(np.max(np.abs(self.rows[column][use] / exact - 1.0)) / (1.0 - FINER))

    def at(self, times, column="binding_area"):
        """A column of the history at ``times`` [a0^2/D], its last value once the run has ended."""
        return study.value_at(self.rows, column, times)

    @property
    def final(self):
        """Binding area [a0^2] at the end."""
        return float(self.rows["binding_area"][-1])

    def time_of(self, part):
        """Time [a0^2/D] at which ``part`` of the final binding area is reached."""
        return time_of(self.rows, part)

    def time_error(self, part):
        """Estimated error of `time_of` [a0^2/D]."""
        if self.like:
            return self.like.time_error(part)
        return abs(time_of(self.rows, part) - time_of(self.finer, part)) / (1.0 - FINER)

    def slope(self, times):
        """Local exponent d ln A / d ln t at ``times``, the slope from t/1.1 to 1.1 t of the finer run."""
        ahead, behind = (np.log(study.area_at(self.finer, times * factor)) for factor in (1.1, 1.0 / 1.1))
        return (ahead - behind) / (2.0 * np.log(1.1))

    def label(self, key):
        """The value of ``key`` with its symbol, and the error of the curve."""
        return f"{SYMBOLS[key]} = {self.value(key):g}  ($\\pm${100 * self.error():.1f} %)"


def time_of(rows, part):
    """Time [a0^2/D] at which ``part`` of the final binding area is reached first."""
    area = np.maximum.accumulate(rows["binding_area"])
    return float(np.interp(part * rows["binding_area"][-1], area, rows["time"]))


def curves(names, changes=None):
    """The curves of the cases ``names``, with the same ``changes`` or each with its own; run if need be."""
    changes = changes if isinstance(changes, list) else [changes or {}] * len(names)
    study.prepare([run for name, change in zip(names, changes) for run in both_runs(name, change)])
    return [Curve(name, change) for name, change in zip(names, changes)]


def varied(some, changes):
    """The curves of ``some`` with further ``changes``, to be compared with them."""
    if not changes:
        return some
    study.prepare([(curve.name, {**curve.changes, **changes}) for curve in some])
    return [Curve(curve.name, {**curve.changes, **changes}, like=curve) for curve in some]


def common_times(some, n=200):
    """Times [a0^2/D] (n,) at equal ratios, from the first that errors count to the end of the longest run."""
    last = max(curve.rows["time"][-1] for curve in some)
    return np.geomspace(min(START, 0.5 * last), last, n)


def separation(lower, upper, times):
    """Relative difference of two curves at ``times``, and what their errors together allow."""
    return upper.at(times) / lower.at(times) - 1.0, lower.error() + upper.error()


def holds_from(lower, upper):
    """Time [a0^2/D] from which ``upper`` stays above ``lower`` by more than their errors; inf if never to stay."""
    times = common_times([lower, upper])
    apart, allowed = separation(lower, upper, times)
    late = np.flatnonzero(apart <= allowed)
    if not len(late):
        return float(times[0])
    return float(times[late[-1] + 1]) if late[-1] + 1 < len(times) else np.inf


def draw_areas(ax, some, key, until=None):
    """A(t) of ``some`` curves in bands of their errors; one that came to rest before the end stays where it is."""
    end = until or max(curve.rows["time"][-1] for curve in some)
    for curve, (color, line) in zip(some, LOOKS):
        t, area = curve.rows["time"], curve.rows["binding_area"]
        t, area = np.concatenate([[0.0], t, [max(end, t[-1])]]), np.concatenate([[0.0], area, area[-1:]])
        ax.plot(t, area, color=color, linestyle=line, label=curve.label(key))
        ax.fill_between(
            t, area * (1 - curve.error()), area * (1 + curve.error()), color=color, alpha=0.25, linewidth=0
        )
    ax.set(xlabel=TIME, ylabel=AREA, xlim=(0.0, end), ylim=(0.0, None))
    ax.legend(loc="lower right", title=UNITS.get(key) and f"{SYMBOLS[key]} in {UNITS[key]}", title_fontsize=7)


def draw_separations(ax, some, key):
    """Relative distance of each curve from its neighbour, beside what the errors of the two allow."""
    times = common_times(some)
    for lower, upper, (color, line) in zip(some, some[1:], LOOKS):
        if upper.final < lower.final:
            lower, upper = upper, lower
        apart, allowed = separation(lower, upper, times)
        ax.loglog(times, np.where(apart > 0, apart, np.nan), color=color, linestyle=line,
                  label=f"{upper.value(key):g} above {lower.value(key):g}")  # fmt: skip
        ax.axhline(allowed, color=color, linestyle=line, linewidth=0.6, alpha=0.7)
    ax.set(xlabel=TIME, ylabel="distance of neighbouring curves / $A$")
    study.plain(ax.xaxis, (0.01, 0.03, 0.1, 0.3, 1.0, 3.0))
    study.plain(ax.yaxis, (0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0))
    study.as_percent(ax.yaxis)
    ax.legend(
        loc="lower center", bbox_to_anchor=(0.5, 0.12), title="thin: errors of the two together", title_fontsize=7
    )


def draw_slopes(ax, some, key=None):
    """Local exponents of A(t) until 99 % of the final area, beside the 1 of a front that diffusion alone feeds."""
    for curve, (color, line) in zip(some, LOOKS):
        times = np.geomspace(0.006, max(0.01, curve.time_of(0.99)), 120)
        ax.semilogx(
            times,
            curve.slope(times),
            color=color,
            linestyle=line,
            label=key and f"{SYMBOLS[key]} = {curve.value(key):g}",
        )
    ax.axhline(1.0, color="0.6", linewidth=0.7)
    ax.annotate("infinite medium", (0.99, 1.0), xycoords=("axes fraction", "data"), xytext=(0, 2), textcoords="offset points",
                ha="right", color="0.35", fontsize=7)  # fmt: skip
    ax.set(xlabel=TIME, ylabel=r"local exponent $\mathrm{d}\ln A\,/\,\mathrm{d}\ln t$", ylim=(0.0, 1.15))
    study.plain(ax.xaxis, (0.006, 0.01, 0.03, 0.1, 0.3, 1.0))


def draw_family(number, names, key, out):
    """Figure ``number``: A(t) of the cases ``names``, which differ in ``key``, and what sets them apart."""
    some = curves(names)
    tabulate(f"Fig. {number}", some, key)

    def fill(areas, distances):
        draw_areas(areas, some, key, until=1.2)
        draw_separations(distances, some, key)

    study.panels(fill, f"figure{number}", out, size=(7.2, 3.4))


def tabulate(figure, some, key):
    """Print what the curves of a figure come to."""
    study.table(
        f"{figure}: areas [a0^2] and times [a0^2/D]",
        [key, "error", *(f"A({t:g})" for t in (0.008, 0.044, 0.128)), "A at the end", "t of 95 %", "t of 99 %", "end"],
        [
            (c.value(key), c.error(), *(float(c.at(t)) for t in (0.008, 0.044, 0.128)), c.final, c.time_of(0.95),
             c.time_of(0.99), float(c.rows["time"][-1]))
            for c in some
        ],
    )  # fmt: skip
    study.table(
        "neighbours: time from which their order holds beyond their errors, relative distance at the end, errors",
        ["", "from", "distance", "errors"],
        [
            (f"{a.value(key):g}, {b.value(key):g}", min(holds_from(a, b), holds_from(b, a)),
             b.final / a.final - 1.0, a.error() + b.error())
            for a, b in zip(some, some[1:])
        ],
    )  # fmt: skip
