"""Fig. 9: the front of the soft case after a random displacement of 2 % at t = 0.140, each beside its control.

Three meshes: as coarse as the paper's and irregular, finer and irregular, and symmetric under turns by 60°. The
control is the same run, stopped and taken up again at the same time, with nothing displaced. What the paper shows,
visible modulations of the front, has to be told from what the mesh does to an undisturbed front: the displacement's
own work is the difference of the two. The front is read in three ways: as the contour of bound membrane, cut at the
kink; as a contour well above the plane; and as the rim of the nodes that touch, which moves element by element.
"""

import looks
import numpy as np

from vesdyn.front import faces_on_plane, modulation
from vesdyn.study import NODES, ON_MERIDIAN, displaced_fronts, left_of_displacement

MESHES = {"fig9-coarse": "irregular", "fig9-fine": "irregular", "fig9-rings": "symmetric"}
PRINTED = 0.140, 0.416  # time and radius of the front in the paper's Fig. 9a [a0^2/D], [a0]
TIMES = 0.144, 0.24, 0.696  # of Fig. 9 b to d
FOOTPRINT = 0.24  # drawn to scale
ANGLES = np.linspace(-180.0, 180.0, 360, endpoint=False)


def measure(study):
    """The undisturbed front on a meridian, r(0.140) and its error [a0]; by mesh: edge [a0], fronts, control's shapes.

    Fronts are pairs of radii (360,) by way of reading and time (`vesdyn.study.displaced_fronts`).
    """
    [base] = study.curves(["fig9-base"], ON_MERIDIAN)
    radius = float(base.at(PRINTED[0], "contact_radius"))
    meshes = {name: (study.case(name).mesh.front_edge, *displaced_fronts(study, name, TIMES)) for name in MESHES}
    return {"radius": (radius, radius * base.error("contact_radius")), "meshes": meshes}


def modulations(fronts):
    """Rows of way of reading, time and modulations over the azimuth: displaced, control, their difference, of r."""
    return [
        (way, t, modulation(moved), modulation(still), left_of_displacement(moved, still))
        for way, by_time in fronts.items()
        for t, (moved, still) in by_time.items()
    ]


def draw_contact(ax, frame):
    """The faces that touch, to scale, from the side of the substrate."""
    x, y, _ = frame["position"].T
    faces = faces_on_plane(frame["elements"], frame["gap"])
    ax.tripcolor(x, y, faces, np.zeros(len(x)), cmap="Greys", vmin=-0.35, vmax=1.0, edgecolors="0.55", linewidth=0.2)
    ax.set(aspect="equal", xlim=(-0.6, 0.6), ylim=(-0.6, 0.6), xticks=(-0.5, 0, 0.5), yticks=(-0.5, 0, 0.5))


def draw(measured, out=looks.OUT):
    (radius, error), meshes = measured["radius"], measured["meshes"]
    base = f"r({PRINTED[0]:.3f}) on a meridian: {radius:.4f} ± {error:.4f}; the paper prints {PRINTED[1]:.3f}"
    print(f"\n{base}")
    looks.table(
        "standard deviation of the front over the azimuth, of r",
        ["mesh", "read at", "t", "displaced", "control", "difference"],
        [(name, *row) for name, (_, fronts, _) in meshes.items() for row in modulations(fronts)],
    )
    styles = {
        "displaced": {"color": looks.DARK, "linewidth": 1.0},
        "control": {"color": looks.RED, "linewidth": 0.9, "linestyle": (0, (3, 1.5))},
    }

    def fill(figure):
        axes = figure.subplots(len(meshes), 1 + len(TIMES), width_ratios=[0.9] + [1.0] * len(TIMES))
        for row, (name, (edge, fronts, controls)) in zip(axes, meshes.items()):
            draw_contact(row[0], controls[TIMES.index(FOOTPRINT)])
            row[0].set_ylabel(f"{MESHES[name]}, edge {edge:g}\n$y$ [$a_0$]")
            rim = f"rim of nodes\n{modulation(fronts[NODES][FOOTPRINT][1]):.1%}"
            row[0].text(0.5, 0.5, rim, transform=row[0].transAxes, ha="center", va="center", fontsize=6)
            for ax, (moved, still) in zip(row[1:], fronts["contact"].values()):
                for radius, (label, style) in zip((moved, still), styles.items()):
                    ax.plot(ANGLES, 100 * (radius / radius.mean() - 1), **style, label=label)
                numbers = (modulation(moved), modulation(still), left_of_displacement(moved, still))
                ax.text(0.5, 0.98, "displaced {:.2%}\ncontrol {:.2%}\ndifference {:.2%}".format(*numbers),
                        transform=ax.transAxes, ha="center", va="top", fontsize=6)  # fmt: skip
                ax.set(xlim=(-180, 180), ylim=(-2.4, 3.9), xticks=(-90, 0, 90), yticks=(-2, -1, 0, 1, 2))
            row[1].set_ylabel(r"$r / \bar r - 1$ [%]")
        for ax, t, letter in zip(axes[0], (FOOTPRINT, *TIMES), "abcd"):
            ax.set_title(rf"$\bf({letter})$ $t$ = {t:g} $a_0^2/D$")
        for ax in axes[:-1].ravel():
            ax.set_xticklabels([])
        axes[-1, 0].set_xlabel("$x$ [$a_0$]")
        for ax in axes[-1, 1:]:
            ax.set_xlabel("azimuth [°]")
        figure.suptitle(f"front of the soft case, {base}", fontsize=8)
        axes[-1, -1].legend(loc="lower center", ncols=2, fontsize=6, handlelength=1.6, columnspacing=1.0)

    looks.picture(fill, "figure9", out, size=(7.2, 4.6))


if __name__ == "__main__":
    looks.command_line(measure, draw)
