"""Fig. 9: the front of the soft case after a random displacement of 2 % at t = 0.140, each beside its control.

Three meshes: as coarse as the paper's and irregular, finer and irregular, and symmetric under turns by 60°. The
control is the same run, stopped and taken up again at the same time, with nothing displaced. What the paper shows,
visible modulations of the front, has to be told from what the mesh does to an undisturbed front: the displacement's
own work is the difference of the two. The front is read in three ways: as the contour of bound membrane, cut at the
kink; as a contour well above the plane; and as the rim of the nodes that touch, which moves element by element.
"""

import numpy as np
import paper
import study
from study import DARK, RED

from vesdyn.body import set_shares_below
from vesdyn.front import front_radius
from vesdyn.spreading import BINDING_GAP
from vesdyn.surface import build_surface

MESHES = {"fig9-coarse": "irregular", "fig9-fine": "irregular", "fig9-rings": "symmetric"}
CONTROL = "-control"
TIMES = 0.144, 0.24, 0.696  # of Fig. 9 b to d
FOOTPRINT = 0.24  # drawn to scale
LEVELS = {"contact": BINDING_GAP, "above": 0.3}  # gap / d_c
NODES = "touching nodes"
ANGLES = np.linspace(-180.0, 180.0, 360, endpoint=False)


def front(frame, level):
    """Radius (360,) [a0] of the contour of a stored shape at the height ``level`` [a0], about its own centre."""
    body = build_surface(frame["position"], frame["elements"], shear_modulus=1.0)  # forces do not matter here
    share = np.zeros(len(body.edges))
    set_shares_below(body, frame["position"], level, share)
    return front_radius(frame["position"], body.edges, share)


def touching(frame):
    """Faces (n, 3) of a stored shape whose nodes all touch the plane."""
    return frame["elements"][(frame["gap"][frame["elements"]] <= 0.0).all(axis=1)]


def rim_of_nodes(frame):
    """Radius (360,) [a0] of the rim of the faces that touch, from node to node, about its own centre."""
    faces = touching(frame)
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    once, count = np.unique(edges, axis=0, return_counts=True)
    points = frame["position"][np.unique(once[count == 1]), :2]
    points = points - points.mean(axis=0)
    angle = np.degrees(np.arctan2(points[:, 1], points[:, 0]))
    order = np.argsort(angle)
    return np.interp(ANGLES, angle[order], np.hypot(*points.T)[order], period=360.0)


def spread(radius, mean=None):
    """Standard deviation of ``radius`` (n,) over the azimuth, of its mean."""
    return float(np.std(radius) / np.mean(radius if mean is None else mean))


def measure(name, times=TIMES, changes=None):
    """By way of reading and time: fronts of the displaced run and its control, (360,) each; the control's shapes."""
    runs = [(name + suffix, changes or {}) for suffix in ("", CONTROL)]
    study.prepare(runs)
    cutoff = paper.wished(*runs[0]).adhesion.cutoff
    frames = [study.frames(*run) for run in runs]
    near = [[min(some, key=lambda f: abs(f["time"] - t)) for t in times] for some in frames]
    ways = {level: lambda frame, gap=gap: front(frame, gap * cutoff) for level, gap in LEVELS.items()}
    ways[NODES] = rim_of_nodes
    fronts = {way: {t: tuple(map(read, pair)) for t, *pair in zip(times, *near)} for way, read in ways.items()}
    return fronts, near[1]


def modulations(name, fronts):
    """Rows of mesh, level, time and spreads over the azimuth: displaced, control, their difference, of r."""
    return [
        (name, level, t, spread(moved), spread(still), spread(moved - still, still))
        for level, by_time in fronts.items()
        for t, (moved, still) in by_time.items()
    ]


def base_radius():
    """r(0.140) [a0] of the undisturbed front on a meridian, and its relative error."""
    [curve] = paper.curves(["fig9-base"], paper.ON_MERIDIAN)
    return float(curve.at(0.14, "contact_radius")), curve.error("contact_radius")


def draw_contact(ax, frame):
    """The faces that touch, to scale, from the side of the substrate."""
    x, y, _ = frame["position"].T
    ax.tripcolor(
        x, y, touching(frame), np.zeros(len(x)), cmap="Greys", vmin=-0.35, vmax=1.0, edgecolors="0.55", linewidth=0.2
    )
    ax.set(aspect="equal", xlim=(-0.6, 0.6), ylim=(-0.6, 0.6), xticks=(-0.5, 0, 0.5), yticks=(-0.5, 0, 0.5))


def draw(out=study.OUT):
    radius, error = base_radius()
    print(f"\nr(0.140) on a meridian: {radius:.4f} (error {error:.1%}); the paper: 0.416")
    every = {name: measure(name) for name in MESHES}
    study.table(
        "standard deviation of the front over the azimuth, of r",
        ["mesh", "read at", "t", "displaced", "control", "difference"],
        [row for name, (fronts, _) in every.items() for row in modulations(name, fronts)],
    )
    looks = {
        "displaced": {"color": DARK, "linewidth": 1.0},
        "control": {"color": RED, "linewidth": 0.9, "linestyle": (0, (3, 1.5))},
    }

    def fill(figure):
        axes = figure.subplots(len(every), 1 + len(TIMES), width_ratios=[0.9] + [1.0] * len(TIMES))
        for row, (name, (fronts, controls)) in zip(axes, every.items()):
            edge = paper.wished(name, {}).mesh.front_edge
            draw_contact(row[0], controls[TIMES.index(FOOTPRINT)])
            row[0].set_ylabel(f"{MESHES[name]}, edge {edge:g}\n$y$ [$a_0$]")
            row[0].text(0.5, 0.5, f"rim of nodes\n{spread(fronts[NODES][FOOTPRINT][1]):.1%}", transform=row[0].transAxes,
                        ha="center", va="center", fontsize=6)  # fmt: skip
            for ax, (moved, still) in zip(row[1:], fronts["contact"].values()):
                for radius, (label, style) in zip((moved, still), looks.items()):
                    ax.plot(ANGLES, 100 * (radius / radius.mean() - 1), **style, label=label)
                numbers = (spread(moved), spread(still), spread(moved - still, still))
                ax.text(0.5, 0.98, "displaced {:.2%}\ncontrol {:.2%}\ndifference {:.2%}".format(*numbers),
                        transform=ax.transAxes, ha="center", va="top", fontsize=6)  # fmt: skip
                ax.set(xlim=(-180, 180), ylim=(-2.4, 3.9), xticks=(-180, -90, 0, 90, 180), yticks=(-2, -1, 0, 1, 2))
            row[1].set_ylabel(r"$r / \bar r - 1$ [%]")
        for ax, t, letter in zip(axes[0], (FOOTPRINT, *TIMES), "abcd"):
            ax.set_title(rf"$\bf({letter})$ $t$ = {t:g} $a_0^2/D$")
        for ax in axes[:-1].ravel():
            ax.set_xticklabels([])
        axes[-1, 0].set_xlabel("$x$ [$a_0$]")
        for ax in axes[-1, 1:]:
            ax.set_xlabel("azimuth [°]")
        axes[-1, -1].legend(loc="lower right", ncols=2, fontsize=6, handlelength=1.6)

    study.picture(fill, "figure9", out, size=(7.2, 4.6))


if __name__ == "__main__":
    draw(study.command_line())
