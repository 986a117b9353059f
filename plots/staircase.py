"""The staircase of the front: r(t) about its trend, before and after what was done against it; typical case.

Before: the front is interpolated straight between the nodes and, on a surface, the rows of the mesh are rings, so
that a whole row lands at once. After: the front is found at its kink (`vesdyn.body.set_shares_below`) and the rows
are scalloped. The trend is a polynomial in sqrt(t). The level far above the plane, where the membrane is smooth,
tells how much of the staircase is in the motion itself.
"""

import looks
import numpy as np
from looks import DARK, GREEN, LIGHT, RED
from matplotlib.ticker import MultipleLocator

from vesdyn.body import set_shares_below
from vesdyn.diagnostics import BINDING_GAP
from vesdyn.front import contact_radius
from vesdyn.spreading import Spreading
from vesdyn.stepping import march

EDGES = {"axisymmetric": (0.02, 0.01, 0.005), "surface": (0.03, 0.02, 0.0125)}
STEP = {"time.step": "auto", "accuracy": 0.005}
END = 0.2
HIGH = 0.3  # of the cutoff: the other level
START, DEGREE = 0.005, 7  # of the trend
CURVES = {  # body, layout, how the front is read
    "axisymmetric, straight": ("axisymmetric", "rings", "straight", LIGHT, "^", ":"),
    "axisymmetric, kink": ("axisymmetric", "rings", "kink", DARK, "o", "-"),
    "surface, rings, straight": ("surface", "rings", "straight", RED, "v", "-."),
    "surface, scalloped, kink": ("surface", "scalloped", "kink", GREEN, "s", "--"),
}
OTHERS = {
    "surface, rings, kink": ("surface", "rings", "kink"),
    "surface, scalloped, straight": ("surface", "scalloped", "straight"),
    "axisymmetric, at 0.3 cutoff": ("axisymmetric", "rings", "high"),
    "surface, rings, at 0.3 cutoff": ("surface", "rings", "high"),
    "surface, scalloped, at 0.3 cutoff": ("surface", "scalloped", "high"),
}


def straight_shares(x, edges, level):
    """The part of each edge that lies below ``level``, interpolated from node to node."""
    low, high = np.sort(x[edges, -1], axis=1).T
    return np.where(high < level, 1.0, np.clip((level - low) / np.where(high > low, high - low, 1.0), 0.0, 1.0))


def radii(study, model, layout, edge, end):
    """Times (n_steps,) and the front's radius [a0] as read in each way, step by step; computed once, then kept."""
    changes = {"model": model, "mesh.layout": layout, "mesh.front_edge": edge, "mesh.far_edge": 4 * edge, **STEP}
    changes |= {
        "membrane.thickness": 0.0,
        "time.end": end,
        "output.frames": [],
    }  # the kink is sharpest without bending
    store = study.file("staircase", changes, "npz")
    if not store.exists():
        sim = Spreading(study.planned("typical", changes)[0])
        low, high = (part * sim.case.adhesion.cutoff for part in (BINDING_GAP, HIGH))
        edges, rows = sim.body.edges, []
        for state in march(sim):
            kink = np.zeros(len(edges))
            set_shares_below(sim.body.topology, state.x, low, kink)
            shares = (straight_shares(state.x, edges, low), kink, straight_shares(state.x, edges, high))
            rows.append([state.time, *(contact_radius(state.x, edges, share) for share in shares)])
        np.savez(store, **dict(zip(("time", "straight", "kink", "high"), np.array(rows).T)))
    return dict(np.load(store))


def about_trend(t, r, end):
    """sqrt(t) at equal distances, and r(t) [a0] there less its trend."""
    s = np.linspace(np.sqrt(START), np.sqrt(end), 600)
    sampled = np.interp(s, np.sqrt(t), r)
    return s, sampled - np.polynomial.Polynomial.fit(s, sampled, DEGREE)(s)


def measure(study, edges=EDGES, end=END):
    """By curve and front edge: sqrt(t), and r(t) about its trend in edges."""
    ways = {name: way[:3] for name, way in {**CURVES, **OTHERS}.items()}
    measured = {}
    for name, (model, layout, how) in ways.items():
        for edge in edges[model]:
            rows = radii(study, model, layout, edge, end)
            s, off = about_trend(rows["time"], rows[how], end)
            measured[name, edge] = s, off / edge
    return measured


def draw(measured, out=looks.OUT):
    rms = {key: float(np.sqrt(np.mean(off**2))) for key, (_, off) in measured.items()}
    end = max(s[-1] for s, _ in measured.values()) ** 2
    looks.table(
        f"rms of r(t) about its trend / front edge, {START:g} < t < {end:g}",
        ["body, rows, front", "front edge", "rms / edge", "rms [a0]"],
        [(name, edge, value, value * edge) for (name, edge), value in rms.items()],
    )

    def fill(in_time, by_edge):
        for k, (name, (*_, color, marker, line)) in enumerate(CURVES.items()):
            edges = [edge for curve, edge in measured if curve == name]
            edge = edges[min(1, len(edges) - 1)]
            s, off = measured[name, edge]
            in_time.axhline(-k, color="0.8", linewidth=0.6)
            in_time.plot(s**2, off - k, color=color, linewidth=0.9)
            place = {"xycoords": ("axes fraction", "data"), "textcoords": "offset points", "xytext": (0, 17)}
            in_time.annotate(f"{name}, edge {edge:g}", (1.0, -k), **place, ha="right", color=color, fontsize=7)
            by_edge.loglog(
                edges, [rms[name, e] for e in edges], color=color, marker=marker, linestyle=line, label=name
            )
        in_time.set(
            xlabel=looks.TIME,
            ylabel="$r(t)$ about its trend [front edges], shifted by 1",
            ylim=(0.4 - len(CURVES), 0.6),
        )
        in_time.xaxis.set_major_locator(MultipleLocator(0.05))
        in_time.set_yticks(
            [-k + d for k in range(len(CURVES)) for d in (-0.25, 0, 0.25)], [-0.25, 0, 0.25] * len(CURVES)
        )
        by_edge.set(xlabel="front edge [$a_0$]", ylabel="rms of $r(t)$ about its trend / front edge")
        looks.plain(by_edge.xaxis, (0.005, 0.01, 0.02, 0.03))
        looks.plain(by_edge.yaxis, (0.005, 0.01, 0.02, 0.05, 0.1, 0.2))
        looks.legend_below(by_edge, columns=2)

    looks.panels(fill, "staircase", out, size=(7.2, 3.8))


if __name__ == "__main__":
    looks.command_line(measure, draw, every=looks.INDEPENDENT)
