"""The picture of a run: what the vesicle looks like as it spreads, and how well it was computed.

A vesicle is drawn in orthographic projection by the painter's algorithm: faces that look away are left out,
the others are painted from the farthest to the nearest, with colours interpolated between the vertices. For
the eye, colours are dimmed by the cosine of the angle between normal and light (Lambert). The substrate,
z = 0, is below every vesicle and every viewer but the one who looks up through it, so it is painted first.
"""

import h5py
import matplotlib
import matplotlib.style
import numpy as np
from matplotlib.collections import LineCollection, TriMesh
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import FixedFormatter, FixedLocator, NullLocator
from matplotlib.tri import Triangulation

from vesdyn.case import load_case
from vesdyn.neo_hookean import strain_energy
from vesdyn.spreading import BINDING_GAP
from vesdyn.storage import RunDirectory

SNAPSHOTS = 4  # as many as in Fig. 2 of the paper
ELEVATION = np.radians(13.0)  # of the viewer above the substrate: sees under the overhang, down to the contact
BELOW = np.radians(-90.0)
SECTORS = 180  # of a revolved meridian
ROUND_OFF = 1e-17  # errors under this are drawn there: a logarithmic axis has no zero

_COLORS = matplotlib.colormaps["viridis"]
_DARK, _MIDDLE, _LIGHT = "#1b3a5c", "#c8553d", "#8a8a8a"  # also told apart in grey, by lightness
_STYLE = {
    "font.size": 9,
    "axes.labelsize": 9,
    "axes.titlesize": 9,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "lines.linewidth": 1.3,
    "mathtext.fontset": "dejavusans",
}


def summary(directory):
    """Draw ``summary.png`` in the run directory ``directory`` (a path) and return its path.

    Snapshots of the vesicle at the first stored times after t = 0, coloured by receptor density; binding
    area A(t) [a0^2]; residual and iterations of the relaxation; errors of conservation and of the balance of
    work. An unfinished run is drawn as far as it went.

    Raises ValueError if there is no case, no row in the history, or no frame.
    """
    directory = RunDirectory(directory)
    case = load_case(directory.case_file)
    history = directory.history()
    if not history:
        raise ValueError(f"{directory.history_file}: has no step yet; draw the run after its first step.")
    start, snapshots = _read_frames(directory)
    with matplotlib.style.context(["default", _STYLE]):
        figure = Figure(figsize=(12, 8), dpi=150)
        top, bottom = figure.subfigures(2, 1, height_ratios=(5.2, 2.8))
        _draw_snapshots(top, snapshots, BINDING_GAP * case.adhesion.cutoff)
        axes = bottom.subplots(1, 3, gridspec_kw={"left": 0.06, "right": 0.985, "bottom": 0.17, "top": 0.9})
        _draw_binding_area(axes[0], history, case.output.frames)
        _draw_relaxation(axes[1], history, case.solver.tolerance)
        _draw_errors(axes[2], history, _initial_elastic_energy(case.membrane, *start))
        part = directory.summary_file.with_suffix(".png.part")
        figure.savefig(part, format="png")
    part.replace(directory.summary_file)
    return directory.summary_file
