"""Fig. 8, measured instead of sketched: the front's radius of curvature and its spreading angle against time.

How both are read from a meridian is told in `vesdyn.front`. The angle is that of the nearly straight rise; how much
it depends on the height is printed. The radius belongs to its arc: without bending stiffness the turn is the
sharper, the closer to the plane it is looked at.
"""

import looks
import numpy as np

from vesdyn.front import ANGLE_AT, ANGLES_AT, ARC
from vesdyn.study import SNAPSHOTS, front_shapes

CASES = ("typical-auto", "fig4-K0.603", "fig4-K3.018")
TIMES = tuple(sorted({*SNAPSHOTS, *(float(f"{t:.4g}") for t in np.geomspace(0.002, 1.0, 55))}))


def measure(study, times=TIMES):
    """By case: `vesdyn.study.FrontShapes`."""
    return {name: front_shapes(study, name, times) for name in CASES}


def draw(measured, out=looks.OUT):
    for name, found in measured.items():
        looks.table(
            f"{name}: radius of curvature [a0], spreading angle, angles at {ANGLES_AT} d_c [°]; two errors",
            ["t", "radius", "angle", "lower", "upper", "error", "error"],
            [
                (
                    float(t),
                    float(shape[0]),
                    *map(float, np.degrees(shape[1:])),
                    float(error[0]),
                    float(np.degrees(error[1])),
                )
                for t, shape, error in zip(*found[:3])
                if t in SNAPSHOTS
            ],
        )

    def fill(shapes, radii, angles):
        draw_shapes(shapes, measured[CASES[0]])
        for (name, found), (color, line) in zip(measured.items(), looks.LINES):
            label = (
                rf"$K$ = {found.case.membrane.shear_modulus:g}, $T_\mathrm{{max}}$ = {found.case.adhesion.traction:g}"
            )
            for ax, value, error in (
                (radii, found.shapes[:, 0], found.errors[:, 0]),
                (angles, np.degrees(found.shapes[:, 1]), np.degrees(found.errors[:, 1])),
            ):
                ax.semilogx(found.times, value, color=color, linestyle=line, label=label)
                ax.fill_between(found.times, value - error, value + error, color=color, alpha=0.25, linewidth=0)
        radii.set(xlabel=looks.TIME, ylabel="radius of curvature at the front [$a_0$]")
        angles.set(xlabel=looks.TIME, ylabel="spreading angle [°]", ylim=(0.0, 90.0))
        radii.set_ylim(0.0, 1.4 * radii.get_ylim()[1])
        for ax in (radii, angles):
            looks.plain(ax.xaxis, (0.003, 0.01, 0.03, 0.1, 0.3, 1.0))
            ax.legend(loc="upper right" if ax is radii else "lower right")

    looks.panels(fill, "figure8", out, size=(7.2, 2.8), shape=(1, 3))


def draw_shapes(ax, found):
    """The membrane beside the front at the times of Fig. 2, and the heights at which it is read."""
    cutoff = found.case.adhesion.cutoff
    shown = [(t, x) for t, x in zip(found.times, found.meridians) if t in SNAPSHOTS]
    for (t, x), (color, line) in zip(shown, looks.LINES):
        r, z = x.T
        front = r[np.flatnonzero(z <= ARC[0] * cutoff)[-1]]
        near = (z < 1.6 * cutoff) & (r > front - cutoff)
        ax.plot(r[near] - front, z[near], color=color, linestyle=line, label=f"$t$ = {t:g}")
    for height in (*ARC, ANGLE_AT):
        ax.axhline(height * cutoff, color="0.75", linewidth=0.5, zorder=0)
    ax.fill_between((-0.1, 0.1), -0.012, 0.0, color="0.85", linewidth=0)
    ax.set(
        xlabel=r"$r - r_\mathrm{front}$ [$a_0$]",
        ylabel="gap $z$ [$a_0$]",
        aspect="equal",
        xlim=(-0.1, 0.1),
        xticks=(-0.05, 0.0, 0.05),
        ylim=(-0.012, 0.15),
    )
    ax.legend(loc="upper left", handlelength=2.0)


if __name__ == "__main__":
    looks.command_line(measure, draw)
