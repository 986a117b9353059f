"""Beyond the paper's law: the double well that it names as future work, and a substrate with ligands in stripes.

Double well: bonds of short range, a glycocalyx that repels, a weak attraction of long range. Stripes: full density of
ligands in them, a tenth elsewhere. Each beside a solution made another way: the state without flux on the start shape,
c = C exp(phi) with C from the count of receptors, by quadrature over the sphere, which is uniform in height and azimuth;
and on the free membrane at the end of the run, where c exp(-phi) is one constant. (The static shapes stand against a
shooting solution in tests/verification/test_other_laws.py.)
"""

import looks
import matplotlib
import numpy as np
from looks import DARK, RED
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.tri import Triangulation

from vesdyn import adhesion, receptors
from vesdyn.body import edge_conductances
from vesdyn.diagnostics import BINDING_GAP
from vesdyn.spreading import Spreading
from vesdyn.study import area_at

LINEAR, WELL, STRIPES = "typical-auto", "double-well", "stripes"
ON_SURFACE = {
    "model": "surface",
    "mesh.front_edge": 0.015,
    "mesh.far_edge": 0.05,
    "accuracy": 0.04,
    "time.end": 0.6,
}
POINTS = (0.02, 0.05, 0.1, 0.2, 0.4)  # times of the points from the surface [a0^2/D]
SHOWN = 0.128  # time of the profiles and of the first view from below [a0^2/D]
CURVES = {LINEAR: (DARK, "-", "linear (the paper)"), WELL: (RED, "--", "double well")}
DENSITIES, TICKS = (0.4, 6.0), (0.5, 1.0, 2.0, 4.0)  # ends of the colours, and their marks [c_r0]
COLORS = matplotlib.colormaps["viridis"]
LONG_TIMES = (1e-2, 0.1, 1.0, 1e2, 1e4, 1e4)  # steps to the state without flux [a0^2/D]
QUADRATURE = 400, 720  # points in height and azimuth


def measure(study, on_surface=ON_SURFACE, shown=SHOWN):
    """Curves, shapes and density of the two laws; frames over the stripes; and what is known of each."""
    curves = dict(zip(CURVES, study.curves(tuple(CURVES))))
    frames = {name: study.frames(name) for name in (*CURVES, STRIPES)}
    early = {name: min(some, key=lambda frame: abs(frame["time"] - shown)) for name, some in frames.items()}
    cases = {name: study.planned(name)[0] for name in frames}
    known = {}
    for name in (WELL, STRIPES):
        end = frames[name][-1]
        constant = end["density"] / np.exp(exponents(cases[name], end["position"]))
        free = end["gap"] > cases[name].adhesion.cutoff * BINDING_GAP
        off = float(np.max(np.abs(constant[free] / np.mean(constant[free]) - 1.0)))
        known[name] = {"start shape": error_without_flux(cases[name]), "free membrane at the end": off}
    return {
        "curves": curves, "early": early, "last": {name: some[-1] for name, some in frames.items()}, "cases": cases,
        "surface": study.history(WELL, on_surface), "known": known,
    }  # fmt: skip


def exponents(case, x):
    """Boltzmann exponents phi (n_nodes,) of ``case`` at positions ``x`` (n_nodes, d) [a0]."""
    phi = np.zeros(len(x))
    adhesion.set_boltzmann_exponents(
        case.drift_number, pull(case), adhesion.ligand_density(case.ligands, x), x, phi
    )
    return phi


def pull(case):
    """The law of ``case`` with its strength, and with ligands enough for any density."""
    return adhesion.TractionSeparation(
        adhesion.LAWS[case.adhesion.law](case.adhesion), case.adhesion.traction, np.inf, False
    )


def error_without_flux(case):
    """Largest relative error of the density after a long time on the start shape of ``case``, a sphere."""
    sim = Spreading(case)
    x, body, number = sim.x_start, sim.body, sim.start().number.copy()
    area, ligands = sim.start().area, adhesion.ligand_density(case.ligands, sim.x_start)
    transport = receptors.transport(len(x), len(body.edges))
    edge_conductances(body.topology, x, transport.conductance)
    transport.exponent[:] = exponents(case, x)
    for dt in LONG_TIMES:
        if not receptors.step_receptors(body.edges, area, np.inf, ligands, dt, number, transport):
            raise ArithmeticError("no density was found")
    z, angle = np.stack(np.meshgrid(*((np.arange(n) + 0.5) / n for n in QUADRATURE), indexing="ij")).reshape(
        2, -1
    )
    r, angle = np.sqrt(z * (1.0 - z)), 2.0 * np.pi * angle  # of the sphere of diameter 1
    exact = np.exp(exponents(case, np.column_stack([r * np.cos(angle), r * np.sin(angle), z])))
    return float(np.max(np.abs(number / area / np.exp(transport.exponent) * exact.mean() - 1.0)))


# Panels --------------------------------------------------------------------------------------------------


def draw_laws(ax, cases):
    d = np.linspace(0.0, 1.0, 401)
    for name, (color, line, label) in CURVES.items():
        law = pull(cases[name]).law
        gap = d * cases[name].adhesion.cutoff
        ax.plot(d, [adhesion.shape(law, g) for g in gap], color=color, linestyle=line, label=label)
    ax.axhline(0.0, color="0.6", linewidth=0.6)
    ax.set(
        xlabel="gap $d/d_c$",
        ylabel=r"traction $T/T_\mathrm{max}$ at $c = c_{r0}$",
        xlim=(0, 1.05),
        ylim=(-0.3, 1.05),
    )
    ax.legend()


def draw_profiles(ax, measured):
    cutoff = measured["cases"][WELL].adhesion.cutoff
    for name, (color, line, _) in CURVES.items():
        for frame, width in ((measured["early"][name], 0.7), (measured["last"][name], 1.4)):
            ax.plot(*frame["position"].T, color=color, linestyle=line, linewidth=width)
    low, high = (
        measured["cases"][WELL].adhesion.well * cutoff,
        0.5 * (1.0 + measured["cases"][WELL].adhesion.well) * cutoff,
    )
    ax.axhspan(low, high, color="0.9", linewidth=0)
    ax.annotate(
        "repelled", (0.03, 0.5 * (low + high)), xycoords=("axes fraction", "data"), va="center", fontsize=7
    )
    ax.axhline(cutoff, color="0.6", linewidth=0.6)
    ax.annotate("$d_c$", (0.03, cutoff), xycoords=("axes fraction", "data"), va="bottom", fontsize=7)
    ax.set(xlabel="$r$ [$a_0$]", ylabel="$z$ [$a_0$]", xlim=(0.2, 0.56), ylim=(-0.004, 0.19))


def draw_curves(ax, measured):
    for name, (color, line, _) in CURVES.items():
        curve = measured["curves"][name]
        t, area, error = curve.history["time"], curve.history["binding_area"], curve.error()
        ax.plot(t, area, color=color, linestyle=line)
        ax.fill_between(t, area * (1 - error), area * (1 + error), color=color, alpha=0.25, linewidth=0)
    points = np.array([t for t in POINTS if t <= measured["surface"]["time"][-1]])
    ax.plot(
        points, area_at(measured["surface"], points), "o", color=RED, markerfacecolor="white", label="surface"
    )
    ax.set(xlabel=looks.TIME, ylabel=looks.AREA, xlim=(0, 0.8), ylim=(0, None))
    ax.legend(loc="lower right")


def draw_density(ax, measured):
    """The density of the double well at the end, and C exp(phi) on the free membrane."""
    case, frame = measured["cases"][WELL], measured["last"][WELL]
    x, density = frame["position"], frame["density"]
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(x, axis=0), axis=1))])
    phi, free = exponents(case, x), frame["gap"] > BINDING_GAP * case.adhesion.cutoff
    ax.plot(arc, density, color=RED)
    ax.plot(arc[free], np.mean(density[free] / np.exp(phi[free])) * np.exp(phi[free]), "o", color="k", markersize=2.2,
            markevery=2, label="no flux where it is free")  # fmt: skip
    ax.set(
        xlabel="arc from the middle [$a_0$]", ylabel="density $c$ [$c_{r0}$]", xlim=(0, 0.8), ylim=(0, None)
    )
    ax.legend(loc="lower right")


def draw_from_below(ax, case, frame, norm):
    """The side of the membrane that faces the substrate, seen from below, with the stripes and the rim of the contact."""
    x, faces = frame["position"], frame["elements"].astype(int)
    a, b, c = np.moveaxis(x[faces], 1, 0)
    faces = faces[np.cross(b - a, c - a)[:, 2] < 0.0][:, ::-1]
    half, period, w = 0.5 * case.ligands.width, case.ligands.period, 0.56
    for middle in period * np.arange(-2, 3):
        ax.axvspan(max(-w, middle - half), min(w, middle + half), color="0.85", linewidth=0, zorder=0)
        for side in (s for s in (middle - half, middle + half) if abs(s) < 0.99 * w):
            ax.plot((side, side), (-w, w), color="w", linewidth=0.5, linestyle=(0, (4, 3)), zorder=3)
    seen = Triangulation(-x[:, 0], x[:, 1], faces)
    ax.tripcolor(seen, frame["density"], norm=norm, cmap=COLORS, shading="gouraud", rasterized=True, zorder=2)
    ax.tricontour(
        seen, frame["gap"], [BINDING_GAP * case.adhesion.cutoff], colors="k", linewidths=0.8, zorder=4
    )
    ax.set(aspect="equal", xlim=(-w, w), ylim=(-w, w), xlabel="$-x$ [$a_0$]", ylabel="$y$ [$a_0$]")


def elongation(case, frame):
    """Length along the stripes over width across them, of the contact."""
    bound = frame["position"][frame["gap"] < BINDING_GAP * case.adhesion.cutoff]
    return float(np.ptp(bound[:, 1]) / np.ptp(bound[:, 0])) if len(bound) > 1 else np.nan


def draw(measured, out=looks.OUT):
    looks.table(
        "largest relative error against the state without flux",
        ["case", *measured["known"][WELL]],
        [(name, *known.values()) for name, known in measured["known"].items()],
    )
    points = np.array([t for t in POINTS if t <= measured["surface"]["time"][-1]])
    on_meridian, linear = (area_at(measured["curves"][name].history, points) for name in (WELL, LINEAR))
    on_surface = area_at(measured["surface"], points)
    looks.table(
        "double well: binding areas [a0^2]",
        ["t", "meridian", "surface", "off", "linear"],
        list(zip(points, on_meridian, on_surface, on_surface / on_meridian - 1.0, linear)),
    )
    stripes = measured["cases"][STRIPES]
    views = measured["early"][STRIPES], measured["last"][STRIPES]
    looks.table(
        "stripes: length of the contact / width",
        ["t", "ratio"],
        [(f["time"], elongation(stripes, f)) for f in views],
    )
    norm = LogNorm(*DENSITIES)

    def fill(figure):
        axes = figure.subplots(2, 3)
        laws, profiles, curves, density, *below = axes.ravel()
        draw_laws(laws, measured["cases"])
        draw_profiles(profiles, measured)
        draw_curves(curves, measured)
        draw_density(density, measured)
        for ax, frame in zip(below, views):
            draw_from_below(ax, stripes, frame, norm)
        for letter, ax in zip("abcdef", axes.ravel()):
            ax.set_title(f"({letter})", fontweight="bold")
        for ax, frame in zip(below, views):
            ax.set_title(f"  from below, $t$ = {frame['time']:.3g}", loc="right")
        bar = figure.colorbar(
            ScalarMappable(norm, COLORS), ax=below, shrink=0.8, ticks=TICKS, label="density $c$ [$c_{r0}$]"
        )
        bar.ax.minorticks_off()
        looks.plain(bar.ax.yaxis, TICKS)

    looks.picture(fill, "other_laws", out, size=(7.2, 4.6))


if __name__ == "__main__":
    looks.command_line(measure, draw)
