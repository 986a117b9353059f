"""What several tests need: reference tables, observed orders, small bodies, their balance, a static state."""

import csv
from pathlib import Path

import numpy as np

from vesdyn import relaxation
from vesdyn.adhesion import Adhesion
from vesdyn.body import add_elastic_forces
from vesdyn.case import Case
from vesdyn.front import contact_radius
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


def adhered(model, front_edge, traction, prestretch=1.0, cutoff=0.1, shear_modulus=1.0, **more):
    """A vesicle in static balance at frozen density; parameters in the units of the tables."""
    case = Case.model_validate({
        "name": "static", "drag": 0.0, "receptors": {"frozen": True},
        "membrane": {"shear_modulus": shear_modulus, "prestretch": prestretch},
        "adhesion": {"traction": traction * prestretch, "cutoff": cutoff / prestretch},
        "mesh": {"front_edge": front_edge, "far_edge": more.get("far_edge", 2.0 * front_edge), "layout": more.get("layout", "rings")},
        "time": {"end": 2.0, "step": 1.0},
        "solver": {"tolerance": more.get("tolerance", 1e-6), "max_iterations": 400_000},
    }).model_copy(update={"model": model})
    spreading = Spreading(case)
    spreading.advance(1.0)
    return static_state(spreading)


def static_state(spreading):
    """Pressure, height, energy, and contact radius and area at z = 0, in the units of the tables.

    Next to the contact the membrane rises as z ~ s^2, so that radius and area at height z are smooth in
    sqrt(z): measured at 1, 4 and 9 hundredths of the cutoff and continued by a parabola in sqrt(z) to z = 0.
    """
    stretch = spreading.case.membrane.prestretch
    levels = np.array([0.01, 0.04, 0.09]) * spreading.adhesion.cutoff
    to_zero = np.array([3.0, -3.0, 1.0])
    row = spreading.history_row()
    radii = [contact_radius(spreading.x, spreading.body.edges, level) for level in levels]
    radius = stretch * (to_zero @ radii)
    return {
        "pressure": row["pressure"] / stretch,
        "height": row["height"] * stretch,
        "energy": row["elastic_energy"] * stretch**2,
        "contact_radius": radius,
        "min_tension": row["tension_min"],
        "volume_error": row["volume_error"],
    }
