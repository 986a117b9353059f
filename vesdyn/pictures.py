"""The picture of a run: what the vesicle looks like as it spreads, and how well it was computed.

A vesicle is drawn in orthographic projection by the painter's algorithm: faces that look away are left out,
the others are painted from the farthest to the nearest, with colours interpolated between the vertices. The
substrate, z = 0, hides nothing of a vesicle on it from a viewer above, so it is painted first.
"""

import io
from typing import NamedTuple

import matplotlib
import matplotlib.style
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import TriMesh
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, LogLocator, MaxNLocator, NullLocator
from matplotlib.tri import Triangulation

from vesdyn.body import area_below, as_triangles, set_shares_below
from vesdyn.case_file import load_case
from vesdyn.diagnostics import BINDING_GAP
from vesdyn.files import replace_file
from vesdyn.front import front_points
from vesdyn.kinds import topology_of
from vesdyn.neo_hookean import strain_energy
from vesdyn.storage import RunDirectory
from vesdyn.units import beside

SNAPSHOTS = 4  # as many as in Fig. 2 of the paper
ABOVE, BELOW = 13.0, -90.0  # elevations [degrees]; the first is low enough to see the contact under the overhang
ROUND_OFF = 1e-17  # a smaller error is drawn there: a logarithmic axis has no zero

_COLOR_MAP = matplotlib.colormaps["viridis"]
DARK, MIDDLE, _LIGHT = "#12355b", "#c44536", "#e0a030"  # told apart by lightness as well
_LIGHT_FROM = np.array([-0.45, -0.65, 0.61])  # over the viewer's left shoulder
_DIMMED = 0.6  # the part of a colour that is left where light comes from the side or from behind
_SUBSTRATE, _SUBSTRATE_LINE = "#ececec", "#9a9a9a"
TIME = "time $t$ [$a_0^2/D$]"
BINDING_AREA = "binding area $A$ [$a_0^2$]"
LOOKS = {
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "lines.linewidth": 1.2,
}


class Shape(NamedTuple):
    """A closed triangle surface at a time, with the receptor density on it."""

    time: float  # [a0^2/D]
    vertices: np.ndarray  # (n_vertices, 3) [a0]
    faces: np.ndarray  # (n_faces, 3) outward
    density: np.ndarray  # (n_vertices,) [c_r0]


def summary(directory):
    """Draw ``summary.png`` in the run directory ``directory`` (a path) and return its path.

    Snapshots at the first stored times after t = 0, coloured by receptor density; the binding area A(t);
    residual and iterations of the relaxation; errors of volume, receptor number and work balance. A run that
    is not finished is drawn as far as it went.

    Raises ValueError if the case, the history or the frames are missing or empty.
    """
    directory = RunDirectory(directory)
    case = load_case(directory.case_file)
    history = directory.history()
    if not history:
        raise ValueError(f"{directory.history_file}: holds no step yet; draw the run after its first step.")
    if not directory.frame_times():
        raise ValueError(f"{directory.frames_folder}: holds no frame; start the run anew with --restart.")
    elastic_energy_0, shapes = _read_frames(directory, case.membrane)

    with matplotlib.style.context(["default", LOOKS]):
        figure = Figure(figsize=(12, 8), dpi=150)
        _draw_title(figure, case)
        upper, lower = figure.subfigures(2, 1, height_ratios=(5.3, 2.7))
        _draw_shapes(upper, shapes, BINDING_GAP * case.adhesion.cutoff, case.scales)
        top, between = (0.91, 0.24) if case.scales is None else (0.8, 0.36)  # room for axes in SI
        place = lower.add_gridspec(1, 3, left=0.055, right=0.98, bottom=0.16, top=top, wspace=between)
        _draw_binding_area(lower.add_subplot(place[0]), history, case.output.frames, case.scales)
        _draw_relaxation(lower, place[1], history, case.solver.tolerance)
        _draw_errors(lower.add_subplot(place[2]), history, elastic_energy_0)
        store_figure(figure, directory.path, directory.summary_file.name)
    return directory.summary_file


def store_figure(figure, directory, name, **options):
    """Store ``figure`` as the file ``name`` of ``directory`` (a path), whole or not at all; ``options`` of savefig.

    Raises vesdyn.files.WriteError if it cannot be written.
    """
    drawn = io.BytesIO()
    figure.savefig(drawn, format=name.rpartition(".")[2], **options)
    replace_file(directory, name, drawn.getvalue())


# Shapes --------------------------------------------------------------------------------------------------


def _read_frames(directory, membrane):
    """Return the elastic energy [kT] at t = 0 and the shapes to draw: the first after t = 0, or that at t = 0."""
    start, *later = directory.frames()[: SNAPSHOTS + 1]
    topology = topology_of(start.connectivity)
    return _start_energy(membrane, start.position, topology), [shape_of(frame, topology) for frame in later or [start]]


def shape_of(frame, topology):
    """The `Shape` of a stored ``frame``; ``topology`` that of its connectivity. A meridian is revolved."""
    vertices, faces, node = as_triangles(topology, frame.position)
    return Shape(frame.time, vertices, faces, frame.density[node])


def _start_energy(membrane, x, topology):
    """Elastic energy [kT] of the start shape: the prestretch, equal in all directions, of a stress-free shape."""
    area = area_below(topology, x, np.inf, np.ones(len(topology.edges)))
    stretch = membrane.prestretch
    return area / stretch**2 * strain_energy(membrane.shear_modulus, 2.0 * stretch**2, stretch**-2)


# Projection ----------------------------------------------------------------------------------------------


def project(x, elevation):
    """Orthographic view of ``x`` (n, 3) along +y, tilted to look from ``elevation`` [degrees] above z = 0.

    Returns right, up and towards the viewer, three arrays (n,). From -90 degrees, below, +x is to the right
    and what was in front (-y) is at the top.
    """
    sine, cosine = np.sin(np.radians(elevation)), np.cos(np.radians(elevation))
    return x[:, 0], sine * x[:, 1] + cosine * x[:, 2], sine * x[:, 2] - cosine * x[:, 1]


def visible_faces(x, faces, elevation):
    """Rows of ``faces`` (n_faces, 3) that face the viewer, the farthest first; ``x`` (n_vertices, 3) [a0]."""
    right, up, nearness = project(x, elevation)
    a, b, c = faces.T
    turn = (right[b] - right[a]) * (up[c] - up[a]) - (up[b] - up[a]) * (right[c] - right[a])
    order = np.argsort(nearness[faces].sum(axis=1), kind="stable")
    return faces[order[turn[order] > 0.0]]


def vertex_normals(x, faces):
    """Outward unit normals (n_vertices, 3), the mean of those of the adjacent ``faces`` weighted by area."""
    corner = x[faces]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    total = np.stack([np.bincount(faces.ravel(), np.repeat(normal[:, k], 3), len(x)) for k in range(3)], axis=1)
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), np.finfo(float).tiny)


def draw_vesicle(axes, shape, norm, elevation):
    """Paint the faces of ``shape`` that are seen; only from above are they lit, so from below colours are exact."""
    color = _COLOR_MAP(norm(shape.density))
    if elevation == ABOVE:  # dim by the cosine between normal and light (Lambert)
        cosine = np.clip(vertex_normals(shape.vertices, shape.faces) @ _LIGHT_FROM, 0.0, 1.0)
        color[:, :3] *= (_DIMMED + (1.0 - _DIMMED) * cosine)[:, None]
    right, up, _ = project(shape.vertices, elevation)
    faces = visible_faces(shape.vertices, shape.faces, elevation)
    axes.add_collection(TriMesh(Triangulation(right, up, faces), facecolors=color, zorder=2), autolim=False)


def draw_substrate(axes, radius, elevation):
    """Paint the plane within ``radius`` [a0] of the axis, with a circle every quarter of a0."""
    axes.fill(*project(_circle(radius), elevation)[:2], color=_SUBSTRATE, lw=0, zorder=0)
    for each in np.arange(0.25, radius, 0.25):
        axes.plot(*project(_circle(each), elevation)[:2], color=_SUBSTRATE_LINE, lw=0.6, zorder=1)


def color_scale(shapes):
    """Norm of the receptor densities of all ``shapes``, with 1, the density at the start, well inside."""
    lowest, highest = min(shape.density.min() for shape in shapes), max(shape.density.max() for shape in shapes)
    return LogNorm(min(lowest, 0.8), max(highest, 1.25))


def add_color_bar(figure, norm, place):
    """Add the colour bar of ``norm`` at ``place`` (left, bottom, width, height of ``figure``)."""
    bar = figure.colorbar(ScalarMappable(norm, _COLOR_MAP), cax=figure.add_axes(place))
    bar.set_label("receptor density $c$ [$c_{r0}$]")
    bar.ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    bar.ax.yaxis.set_major_formatter("{x:g}")
    bar.ax.yaxis.set_minor_locator(NullLocator())
    for end, y, va in ((norm.vmax, 1.01, "bottom"), (norm.vmin, -0.01, "top")):
        bar.ax.text(0.5, y, f"{end:.3g}", transform=bar.ax.transAxes, size=8, ha="center", va=va)


def _circle(radius):
    """Points (n, 3) [a0] of a circle on the substrate about the axis."""
    angle = np.linspace(0.0, 2.0 * np.pi, 181)
    return radius * np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)


# Panels --------------------------------------------------------------------------------------------------


def _draw_title(figure, case):
    """One line that names the case and its parameters."""
    membrane, adhesion = case.membrane, case.adhesion

    def shown(key, value, unit):
        return case.quantities.get(key, f"{value:g} {unit}")

    parameters = (
        f"$K$ = {shown('membrane.shear_modulus', membrane.shear_modulus, '$kT/a_0^2$')}",
        f"$h$ = {shown('membrane.thickness', membrane.thickness, '$a_0$')}",
        f"prestretch {membrane.prestretch:g}",
        rf"$T_\mathrm{{max}}$ = {shown('adhesion.traction', adhesion.traction, '$kT/a_0^3$')}",
        f"$d_c$ = {shown('adhesion.cutoff', adhesion.cutoff, '$a_0$')}",
        f"$c_l/c_{{r0}}$ = {adhesion.ligand_ratio:g}",
        "receptors frozen" if case.receptors.frozen else f"drift number {case.drift_number:g}",
        f"drag {shown('drag', case.drag, '')}".rstrip(),
    )
    figure.text(0.015, 0.976, case.name, size=11, weight="bold", va="center")
    figure.text(0.98, 0.976, "    ".join(parameters), ha="right", va="center")


def _draw_shapes(figure, shapes, bound_below, scales):
    """Each shape from above and from below, all at one scale; ``bound_below`` [a0] is the gap of bound membrane."""
    norm = color_scale(shapes)
    width = 1.12 * max(np.abs(shape.vertices[:, :2]).max() for shape in shapes)
    bottom = project(_circle(width), ABOVE)[1].min()
    top = max(project(shape.vertices, ABOVE)[1].max() for shape in shapes)

    place = figure.add_gridspec(
        2, SNAPSHOTS, left=0.035, right=0.915, bottom=0.02, top=0.89, wspace=0.02, hspace=0.03,
        height_ratios=(top - bottom, 2.0 * width),
    )  # fmt: skip
    views = ((ABOVE, (bottom, top), f"from {ABOVE:g}° above"), (BELOW, (-width, width), "through the substrate"))
    for row, (elevation, height, view) in enumerate(views):
        for column, shape in enumerate(shapes):
            axes = figure.add_subplot(place[row, column], aspect="equal", xlim=(-width, width), ylim=height)
            axes.set_axis_off()
            draw_substrate(axes, width, elevation)
            draw_vesicle(axes, shape, norm, elevation)
            if elevation == BELOW:
                _draw_front(axes, shape, bound_below)
            if row == 0:
                time = f"{shape.time:g} $a_0^2/D$" + beside(shape.time, "a0^2/D", scales)
                axes.set_title(f"$t$ = {time}", loc="center", weight="normal", pad=7)
            if column == 0:
                axes.text(0.0, 0.5, view, transform=axes.transAxes, rotation=90, ha="right", va="center")
    figure.text(0.015, 0.905, "(a)", weight="bold")

    add_color_bar(figure, norm, (0.935, 0.1, 0.012, 0.72))


def _draw_front(axes, shape, level):
    """Outline the membrane with a gap under ``level`` [a0], as the binding area is measured, seen from below."""
    topology = topology_of(shape.faces)
    share = np.zeros(len(topology.edges))
    set_shares_below(topology, shape.vertices, level, share)
    points = front_points(shape.vertices, topology.edges, share)
    if len(points):
        x, y = points.T
        around = np.argsort(np.arctan2(y - y.mean(), x - x.mean()))
        axes.fill(x[around], -y[around], fill=False, edgecolor="black", lw=0.8, zorder=3)


def _draw_binding_area(axes, history, asked, scales):
    """A(t), also in SI where there are ``scales``, and on it the ``asked`` times [a0^2/D] of stored shapes."""
    t, A = history["time"], history["binding_area"]
    reached = [time for time in asked if time <= t[-1]]
    axes.plot(t, A, color=DARK)
    area = np.interp(reached, t, A)
    axes.plot(reached, area, "o", mfc="white", mec=DARK, ms=5, clip_on=False, label="stored shapes")
    axes.set(xlabel=TIME, ylabel=BINDING_AREA, title="(b)")
    axes.set(xlim=(0.0, t[-1]), ylim=(0.0, 1.08 * A.max() or 1.0))
    axes.legend(loc="lower right")
    axes.locator_params(axis="x", nbins=5)
    if scales:
        _add_si_axes(axes, t[-1], A.max(), scales)


def _add_si_axes(axes, time, area, scales):
    """Time above and area at the right in the units of SI that suit ``time`` [a0^2/D] and ``area`` [a0^2]."""
    for name, value, unit, add in (("t", time, "a0^2/D", axes.secondary_xaxis), ("A", area, "a0^2", axes.secondary_yaxis)):
        wanted = scales.preferred(unit, value)
        factor = float(scales.to(1.0, unit, wanted))
        other = add("top" if name == "t" else "right", functions=(lambda v, f=factor: v * f, lambda v, f=factor: v / f))
        label = wanted.replace("um", "µm").replace("^2", "$^2$")
        (other.set_xlabel if name == "t" else other.set_ylabel)(f"${name}$ [{label}]")
        (other.xaxis if name == "t" else other.yaxis).set_major_locator(MaxNLocator(5))


def _draw_relaxation(figure, place, history, tolerance):
    """Residual and iterations of each step, one above the other; ``tolerance`` is that of the residual, if a number."""
    upper, lower = place.subgridspec(2, 1, hspace=0.15).subplots(sharex=True)
    t, residual = history["time"], np.maximum(history["residual"], ROUND_OFF)
    upper.semilogy(t, residual, ".", color=DARK, ms=3, clip_on=False)
    upper.set(ylabel="residual", ylim=(residual.min() / 30.0, residual.max() * 10.0), title="(c)")
    upper.yaxis.set_minor_locator(NullLocator())
    if isinstance(tolerance, float):
        upper.axhline(tolerance, color=MIDDLE, ls="--", lw=1.0, zorder=1, label="tolerance")
        upper.legend(loc="upper right")
    lower.plot(t, history["iterations"], ".", color=DARK, ms=3, clip_on=False)
    lower.set(xlabel=TIME, ylabel="iterations", xlim=(0.0, t[-1]))
    lower.set_ylim(0.0, 1.08 * history["iterations"].max() or 1.0)
    lower.locator_params(axis="x", nbins=5)
    figure.align_ylabels((upper, lower))


def _draw_errors(axes, history, elastic_energy_0):
    """Relative errors of what the scheme conserves exactly, and of the balance of work, which the step limits."""
    t, work = history["time"], history["adhesion_work"]
    surplus = history["elastic_energy"] - elastic_energy_0 + history["dissipation"] - work
    imbalance = np.divide(surplus, work, out=np.full_like(work, np.nan), where=work != 0.0)
    curves = (
        (imbalance, "work: (gained + dissipated) / adhesion $-$ 1", MIDDLE, "--"),
        (history["volume_error"], "volume: $V/V_0-1$", DARK, "-"),
        (history["receptor_number_error"], "receptors: $N/N_0-1$", _LIGHT, "-"),
    )
    for error, label, color, style in curves:
        axes.semilogy(t, np.maximum(np.abs(error), ROUND_OFF), style, color=color, label=label)
    axes.set(xlabel=TIME, ylabel="relative error", xlim=(0.0, t[-1]), title="(d)")
    axes.set_ylim(ROUND_OFF / 3.0, max(10.0, axes.get_ylim()[1]))
    axes.yaxis.set_major_locator(FixedLocator([1e-16, 1e-12, 1e-8, 1e-4, 1.0]))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.legend(loc="center right", bbox_to_anchor=(1.0, 0.55))
    axes.locator_params(axis="x", nbins=5)
