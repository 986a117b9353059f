"""What several tests need: reference tables, observed orders, small bodies, their balance, a static state."""

import csv
from pathlib import Path

import numpy as np

from vesdyn import relaxation
from vesdyn.adhesion import Adhesion
from vesdyn.body import add_elastic_forces, add_stiffness_bounds
from vesdyn.case import Case
from vesdyn.meridian import build_meridian
from vesdyn.meshing import graded_meridian, graded_sphere
from vesdyn.spreading import Spreading
from vesdyn.surface import build_surface

BODIES = ("axisymmetric", "surface")


def table(name):
    """Rows of tests/data/``name``.csv as dicts of numbers."""
    with open(Path(__file__).parent / "data" / f"{name}.csv") as file:
        return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]


def row_of(name, **wanted):
    """The one row of a table with these values."""
    (row,) = [r for r in table(name) if all(np.isclose(r[key], value) for key, value in wanted.items())]
    return row


def fitted_order(steps, errors):
    """Slope of log error against log step."""
    return np.polyfit(np.log(steps), np.log(np.abs(errors)), 1)[0]


def sphere(model, front_edge, far_edge=None, shear_modulus=1.0, prestretch=1.0, layout="rings"):
    """Start positions and body of a sphere on the plane."""
    far_edge = front_edge if far_edge is None else far_edge
    if model == "axisymmetric":
        x = graded_meridian(front_edge, far_edge)
        return x, build_meridian(x, shear_modulus, prestretch)
    x, faces = graded_sphere(front_edge, far_edge, layout)
    return x, build_surface(x, faces, shear_modulus, prestretch)


def shaken(x, size, seed):
    """``x`` with random displacements of up to ``size`` [a0]; the poles of a meridian stay on the axis."""
    step = size * np.random.default_rng(seed).uniform(-1.0, 1.0, x.shape)
    if x.shape[1] == 2:
        step[[0, -1], 0] = 0.0
    return x + step


def forces(body, x):
    """Elastic force (n, d), volume gradient (n, d), nodal area (n,) and volume at ``x``."""
    d = x.shape[1]
    nodal = np.zeros((len(x), 2 * d + 1))
    volume = add_elastic_forces(body, x, nodal)
    return nodal[:, :d], nodal[:, d : 2 * d], nodal[:, -1], volume


def stiffness_ratio(body, x, pressure):
    """Largest eigenvalue of the stiffness, numerically differentiated, relative to diag(bound)."""
    n, d = x.shape
    K = np.zeros((n * d, n * d))
    h = 1e-6
    for column, (i, k) in enumerate(np.ndindex(n, d)):
        up, down = x.copy(), x.copy()
        up[i, k] += h
        down[i, k] -= h
        (f, g, _, _), (f_down, g_down, _, _) = forces(body, up), forces(body, down)
        K[:, column] = -((f + pressure * g) - (f_down + pressure * g_down)).ravel() / (2 * h)
    bound = np.zeros(n)
    add_stiffness_bounds(body, x, pressure, bound)
    scale = np.repeat(bound, d) ** -0.5
    free = np.ones(n * d, dtype=bool)
    if d == 2:
        free[[0, 2 * (n - 1)]] = False  # poles stay on the axis
    return np.linalg.eigvalsh((0.5 * (K + K.T) * scale * scale[:, None])[np.ix_(free, free)])[-1]


def balance_of(body, x, volume=np.pi / 6.0, viscosity=0.0, traction=0.0, cutoff=0.1, frozen=True):
    """The balance of a membrane whose density is 1 at ``x``."""
    adhesion = Adhesion(float(traction), float(cutoff), 8.0, frozen)
    number = forces(body, x)[2].copy()
    return relaxation.Balance(body, adhesion, float(viscosity), float(volume), number, x.copy())


def relaxed(balance, x, tolerance, kinetic=False, lighter=1.0, max_iterations=200_000, pressure=0.0):
    """Relax a copy of ``x``; return it with the outcome. ``lighter`` divides the fictitious mass."""
    x, work = x.copy(), relaxation.workspace(x)
    relaxation.set_fictitious_mass(balance, x, float(pressure), work)
    work.mass[:] /= lighter
    controls = relaxation.Controls(float(tolerance), int(max_iterations), bool(kinetic))
    return x, relaxation.relax(balance, controls, x, float(pressure), work)


def straight_shares(x, edges, level):
    """The part of each edge that lies below ``level``, interpolated from node to node."""
    heights = np.sort(x[edges, -1], axis=1)
    low, high = heights.T
    share = np.clip((level - low) / np.where(high > low, high - low, 1.0), 0.0, 1.0)
    return np.where(high < level, 1.0, share)  # an edge that lies flat is below as a whole


def mean_radius(x, edges, level):
    """Mean distance from the axis at which the outermost edges cross ``level``, straight from node to node."""
    a, b = x[edges[:, 0]], x[edges[:, 1]]
    crossing = (a[:, -1] < level) != (b[:, -1] < level)
    a, b = a[crossing], b[crossing]
    share = (level - a[:, -1]) / (b[:, -1] - a[:, -1])
    return np.linalg.norm((a + share[:, None] * (b - a))[:, :-1], axis=1).mean()


def static_case(model, front_edge, traction, prestretch=1.0, cutoff=0.1, shear_modulus=1.0, **more):
    """Frozen density, no drag, a pure membrane; parameters in the units of the tables, ``more`` see below."""
    mesh = {"front_edge": front_edge, "far_edge": more.get("far_edge", 2.0 * front_edge)}
    return Case.model_validate({
        "name": "static", "model": model, "drag": more.get("drag", 0.0), "receptors": {"frozen": True},
        "membrane": {
            "shear_modulus": shear_modulus, "prestretch": prestretch, "thickness": more.get("thickness", 0.0)
        },
        "adhesion": {"traction": traction * prestretch, "cutoff": cutoff / prestretch},
        "mesh": mesh | {"layout": more.get("layout", "rings")},
        "time": {"end": 2.0, "step": 1.0, "order": 1},
        "solver": {"tolerance": more.get("tolerance", 1e-6), "max_iterations": 400_000},
    })


def adhered(*arguments, **more):
    """A taut vesicle in static balance (`static_case`), reached in one step."""
    spreading = Spreading(static_case(*arguments, **more))
    spreading.advance(1.0)
    return static_state(spreading)


def static_state(spreading):
    """Pressure, height, energy, and contact radius at z = 0, in the units of the tables.

    Next to the contact the membrane rises as z ~ s^2, so that the radius at height z is smooth in sqrt(z):
    measured at 1, 4 and 9 hundredths of the cutoff and continued by a parabola in sqrt(z) to z = 0.
    """
    stretch = spreading.case.membrane.prestretch
    row = spreading.history_row()
    radii = [
        mean_radius(spreading.x, spreading.body.edges, level * spreading.adhesion.cutoff)
        for level in (0.01, 0.04, 0.09)
    ]
    return {
        "pressure": row["pressure"] / stretch,
        "height": row["height"] * stretch,
        "energy": row["elastic_energy"] * stretch**2,
        "contact_radius": stretch * (3.0 * radii[0] - 3.0 * radii[1] + radii[2]),
        "min_tension": row["tension_min"],
        "volume_error": row["volume_error"],
    }
