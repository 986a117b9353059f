"""The staircase of the front: r(t) about its trend, before and after what was done against it; typical case.

Before: the front is interpolated straight between the nodes and, on a surface, the rows of the mesh are rings, so
that a whole row lands at once. After: the front is found at its kink (`vesdyn.body.set_shares_below`) and the rows
are scalloped. The trend is a polynomial in sqrt(t). The level far above the plane, where the membrane is smooth,
tells how much of the staircase is in the motion itself.
"""
import numpy as np
import study
from matplotlib.ticker import MultipleLocator
from study import DARK, GREEN, LIGHT, RED

from vesdyn.body import set_shares_below
from vesdyn.front import contact_radius
from vesdyn.spreading import BINDING_GAP, Spreading
from vesdyn.stepping import step

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


def radii(model, layout, edge, end=END):
    """Times (n_steps,) and the front's radius [a0] as read in each way, step by step; computed once, then kept."""
    changes = {"model": model, "mesh.layout": layout, "mesh.front_edge": edge, "mesh.far_edge": 4 * edge, **STEP}
    changes["membrane.thickness"] = 0.0  # the kink is sharpest without bending
    store = study.note_file("staircase", changes | {"time.end": end}, "npz")
    if not store.exists():
        sim = Spreading(study.case_of("typical", changes | {"time.end": end})[0])
        low, high = (part * sim.adhesion.cutoff for part in (BINDING_GAP, HIGH))
        rows = []
        while sim.time < end:
            step(sim, end)
            x, edges = sim.x, sim.body.edges
            kink = np.zeros(len(edges))
            set_shares_below(sim.body, x, low, kink)
            shares = (straight_shares(x, edges, low), kink, straight_shares(x, edges, high))
            rows.append([sim.time, *(contact_radius(x, edges, share) for share in shares)])
        np.savez(store, **dict(zip(("time", "straight", "kink", "high"), np.array(rows).T)))
    return dict(np.load(store))


def about_trend(t, r, end=END):
    """sqrt(t) at equal distances, and r(t) [a0] there less its trend."""
    s = np.linspace(np.sqrt(START), np.sqrt(end), 600)
    sampled = np.interp(s, np.sqrt(t), r)
    return s, sampled - np.polynomial.Polynomial.fit(s, sampled, DEGREE)(s)


def main(out=study.OUT, edges=EDGES, end=END):
    rms = {}
    for name, (model, layout, how, *_) in {**CURVES, **OTHERS}.items():
        for edge in edges[model]:
            rows = radii(model, layout, edge, end)
            rms[name, edge] = np.sqrt(np.mean(about_trend(rows["time"], rows[how], end)[1] ** 2)) / edge
    study.table(
        f"rms of r(t) about its trend / front edge, {START:g} < t < {end:g}",
        ["body, rows, front", "front edge", "rms / edge", "rms [a0]"],
        [(name, edge, float(v), float(v * edge)) for (name, edge), v in rms.items()],
    )

    def draw(in_time, by_edge):
        for k, (name, (model, layout, how, color, marker, line)) in enumerate(CURVES.items()):
            edge = edges[model][min(1, len(edges[model]) - 1)]
            rows = radii(model, layout, edge, end)
            s, off = about_trend(rows["time"], rows[how], end)
            in_time.axhline(-k, color="0.8", linewidth=0.6)
            in_time.plot(s**2, off / edge - k, color=color, linewidth=0.9)
            in_time.annotate(f"{name}, edge {edge:g}", (1.0, -k), xycoords=("axes fraction", "data"), textcoords="offset points",
                             xytext=(0, 17), ha="right", color=color, fontsize=7)  # fmt: skip
            by_edge.loglog(edges[model], [rms[name, e] for e in edges[model]], color=color, marker=marker, linestyle=line, label=name)
        in_time.set(
            xlabel="time $t$ [$a_0^2/D$]", ylabel="$r(t)$ about its trend [front edges], shifted by 1", ylim=(0.4 - len(CURVES), 0.6)
        )
        in_time.xaxis.set_major_locator(MultipleLocator(0.05))
        in_time.set_yticks([-k + d for k in range(len(CURVES)) for d in (-0.25, 0, 0.25)], [-0.25, 0, 0.25] * len(CURVES))
        by_edge.set(xlabel="front edge [$a_0$]", ylabel="rms of $r(t)$ about its trend / front edge")
        study.plain(by_edge.xaxis, (0.005, 0.01, 0.02, 0.03))
        study.plain(by_edge.yaxis, (0.005, 0.01, 0.02, 0.05, 0.1, 0.2))
        study.legend_below(by_edge, columns=2)

    study.panels(draw, "staircase", out, size=(7.2, 3.8))


if __name__ == "__main__":
    main(study.command_line())
