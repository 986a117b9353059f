"""Fig. 2: the typical case in three dimensions, with lines of equal receptor density, at the paper's four times.

Above, the vesicle on the substrate; below, the same from under the substrate, which is glass: the contact with the
receptors it has gathered, the front, where they are densest at first, and the lack of them outside it.
"""

import looks
import matplotlib
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import TriMesh
from matplotlib.colors import LogNorm
from matplotlib.tri import Triangulation

from vesdyn.meshing import revolved
from vesdyn.pictures import project, vertex_normals, visible_faces
from vesdyn.study import FAMILIES, SNAPSHOTS, density_range

PRINTED = 0.4, 4.0  # smallest and largest density of the paper's figure [c_r0]
LEVELS = (0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0)  # of c / c_r0, at equal ratios
DENSITIES = 0.35, 5.0  # ends of the colours [c_r0]
COLORS = matplotlib.colormaps["viridis"]  # from dark to light: the order survives grey print
ABOVE, BELOW = 18.0, -38.0  # elevations of the two views [degrees]
LIGHT_FROM = np.array([-0.45, -0.65, 0.61])  # over the viewer's left shoulder
DIMMED = 0.55  # part of a colour that is left where no light falls
SECTORS = 180
SUBSTRATE = 0.56  # half the width of the substrate shown [a0]
TURNED = 25.0  # the substrate against the view [degrees]
SPACING = 0.14  # of the lines on it [a0]
SCALE = 0.5  # length of the bar [a0]


def measure(study):
    """Shapes at the four times; smallest and largest density at these, each with its error [c_r0]."""
    cases, _ = FAMILIES["figure2"]
    [curve] = study.curves(cases)
    frames = study.frames(*cases)
    shown = [min(frames, key=lambda frame: abs(frame["time"] - t)) for t in SNAPSHOTS]
    return {"frames": shown, "density": density_range(curve)}


def draw_substrate(ax, elevation):
    """The plane z = 0 as a square with lines; seen from below it is painted over the vesicle, as glass."""
    cosine, sine = np.cos(np.radians(TURNED)), np.sin(np.radians(TURNED))

    def seen(*points):
        turned = np.array(points) @ [(cosine, sine), (-sine, cosine)]
        return project(np.column_stack([turned, np.zeros(len(points))]), elevation)[:2]

    w = SUBSTRATE
    order, color, line = (0, "0.94", "0.72") if elevation > 0 else (5, (0.7, 0.8, 0.9, 0.16), (1, 1, 1, 0.35))
    ax.fill(*seen((-w, -w), (w, -w), (w, w), (-w, w)), facecolor=color, edgecolor="0.5", linewidth=0.5, zorder=order)
    for s in np.arange(-w + SPACING, w - SPACING / 2, SPACING):
        for ends in ((s, -w), (s, w)), ((-w, s), (w, s)):
            ax.plot(*seen(*ends), color=line, linewidth=0.3, zorder=order)


def draw_vesicle(ax, frame, elevation, norm):
    """Density in colour, dimmed where light falls from the side, and lines of equal density on the faces seen."""
    x, faces, nodes = revolved(frame["position"], SECTORS)
    density = frame["density"][nodes]
    right, up, _ = project(x, elevation)
    seen = Triangulation(right, up, visible_faces(x, faces, elevation))
    light = np.clip(vertex_normals(x, faces) @ (LIGHT_FROM * (1.0, 1.0, np.sign(elevation))), 0.0, 1.0)
    color = COLORS(norm(density))
    color[:, :3] *= (DIMMED + (1.0 - DIMMED) * light)[:, None]
    ax.add_collection(TriMesh(seen, facecolors=color, rasterized=True, zorder=2), autolim=False)
    ax.tricontour(seen, density, LEVELS, colors="white", linewidths=0.45, zorder=4)


def draw_scale(ax):
    """A bar of SCALE in the picture; lengths across the view are true."""
    left, height = -0.74, -0.44
    ax.plot((left, left + SCALE), (height, height), color="k", linewidth=1.2, solid_capstyle="butt", zorder=6)
    ax.text(left + SCALE / 2, height + 0.02, f"{SCALE:g} $a_0$", ha="center", va="bottom", fontsize=7, zorder=6)


def draw(measured, out=looks.OUT):
    shown = measured["frames"]
    (low, low_error), (high, high_error) = measured["density"]
    print(
        f"\ndensity at the four times: {low:.3f} ± {low_error:.3f} to {high:.3f} ± {high_error:.3f} c_r0;"
        f" the paper prints {PRINTED[0]:.1f} to {PRINTED[1]:.1f}"
    )
    norm = LogNorm(*DENSITIES)

    def fill(figure):
        axes = figure.subplots(2, len(shown), height_ratios=(1.26, 1.39))
        for row, elevation, height in zip(axes, (ABOVE, BELOW), ((-0.24, 1.02), (-0.47, 0.92))):
            for ax, frame in zip(row, shown):
                draw_substrate(ax, elevation)
                draw_vesicle(ax, frame, elevation, norm)
                ax.set(aspect="equal", xlim=(-0.76, 0.76), ylim=height)
                ax.set_axis_off()
        for ax, letter, frame in zip(axes[0], "abcd", shown):
            ax.set_title(rf"$\bf({letter})$  $t$ = {frame['time']:g} $a_0^2/D$")
        for ax, view in zip(axes[:, 0], ("from above", "through the substrate")):
            ax.text(-0.02, 0.5, view, transform=ax.transAxes, rotation=90, ha="right", va="center", fontsize=7)
        bar = figure.colorbar(ScalarMappable(norm, COLORS), ax=axes, shrink=0.8, aspect=32, pad=0.01, extend="both")
        bar.set_ticks(LEVELS, labels=[f"{level:g}" for level in LEVELS], minor=False)
        bar.ax.minorticks_off()
        bar.ax.hlines(LEVELS, 0, 1, colors="white", linewidths=0.6)
        bar.ax.plot((0.0, 0.0), PRINTED, ">", color="k", markersize=4, clip_on=False)
        bar.set_label(
            f"receptor density $c$ [$c_{{r0}}$], here {low:.2f} to {high:.2f}\n"
            rf"$\blacktriangleright$ the paper prints {PRINTED[0]:.1f} to {PRINTED[1]:.1f}"
        )
        draw_scale(axes[1, 0])

    looks.picture(fill, "figure2", out, size=(7.2, 3.7))


if __name__ == "__main__":
    looks.command_line(measure, draw)
