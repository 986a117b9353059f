"""What several tests need: reference tables, observed orders, small bodies, their balance, a static state."""

import csv
from pathlib import Path

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu
from scipy.spatial import ConvexHull, Delaunay

from vesdyn import relaxation
from vesdyn.adhesion import Linear, TractionSeparation
from vesdyn.balance import Balance, Limits, allocate, tangent
from vesdyn.body import add_elastic_forces, add_stiffness_bounds
from vesdyn.case import Case
from vesdyn.diagnostics import Moment
from vesdyn.meridian import build_meridian
from vesdyn.meshing import graded_meridian, graded_sphere
from vesdyn.spreading import METHODS, Spreading
from vesdyn.surface import build_surface

BODIES = ("axisymmetric", "surface")
WAYS = [(model, method) for model in BODIES for method in METHODS if (model, method) != ("surface", "newton")]


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


def sphere(model, front_edge, far_edge=None, shear_modulus=1.0, prestretch=1.0, layout="rings", thickness=0.0):
    """Start positions and body of a sphere on the plane; ``layout`` "shaken": an evenly uneven triangulation."""
    far_edge = front_edge if far_edge is None else far_edge
    if model == "axisymmetric":
        x = graded_meridian(front_edge, far_edge)
        return x, build_meridian(x, shear_modulus, prestretch, thickness)
    x, faces = shaken_sphere(front_edge) if layout == "shaken" else graded_sphere(front_edge, far_edge, layout)
    return x, build_surface(x, faces, shear_modulus, prestretch, thickness)


def shaken_sphere(edge, size=0.3, seed=0):
    """Delaunay triangles of a spiral's points shaken by up to ``size`` edges: vertices of 3 to 9 neighbours."""
    centre = np.array([0.0, 0.0, 0.5])
    points = graded_sphere(edge, edge, "spiral")[0] - centre
    points += size * edge * np.random.default_rng(seed).uniform(-1.0, 1.0, points.shape)
    points *= 0.5 / np.linalg.norm(points, axis=1)[:, None]
    faces = ConvexHull(points).simplices
    a, b, c = np.moveaxis(points[faces], 1, 0)
    inward = np.einsum("fk,fk->f", np.cross(b - a, c - a), a) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    return points + centre, faces


def shaken_sheet(edge, size, seed):
    """Unit square of Delaunay triangles in z = 0, shaken likewise: vertices (n, 3), faces, nodal areas (n,)."""
    columns, rows = round(1.0 / edge), round(2.0 / (3.0**0.5 * edge))
    u, v = np.meshgrid(np.arange(columns + 1) / columns, np.arange(rows + 1) / rows)
    u = u + np.where(np.arange(rows + 1) % 2, 0.25, -0.25)[:, None] / columns
    points = np.stack([u.ravel(), v.ravel()], axis=1)
    points += size * edge * np.random.default_rng(seed).uniform(-1.0, 1.0, points.shape)
    faces = Delaunay(points).simplices
    p, q = points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]]
    area = 0.5 * (p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0])
    faces[area < 0.0] = faces[area < 0.0][:, ::-1]
    nodal = np.bincount(faces.ravel(), np.repeat(np.abs(area) / 3.0, 3), len(points))
    return np.column_stack([points, np.zeros(len(points))]), faces, nodal


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


def stiffness_matrix(body, x):
    """Sparse second derivatives of the elastic energy (`vesdyn.balance.tangent` without anything else)."""
    K = tangent(balance_of(body, x), x, 0.0, allocate(x))
    return 0.5 * (K + K.T)


def linear_response(body, x, loads):
    """Small displacements (n_loads, n, d) of a free body under ``loads`` alike, all without their rigid parts."""
    n, d = x.shape
    rigid = np.zeros((n, d, 1 if d == 2 else 6))
    if d == 2:
        rigid[:, 1, 0] = 1.0
        held = [0, 1, 2 * (n - 1)]
    else:
        for k, axis in enumerate(np.eye(3)):
            rigid[:, :, k], rigid[:, :, 3 + k] = axis, np.cross(axis, x)
        low, high, side = np.argmin(x[:, 2]), np.argmax(x[:, 2]), np.argmax(x[:, 0])
        held = [3 * low, 3 * low + 1, 3 * low + 2, 3 * high, 3 * high + 1, 3 * side + 1]  # statically determinate
    rigid = np.linalg.qr(rigid.reshape(n * d, -1))[0]
    load = np.reshape(loads, (-1, n * d)).T
    load = load - rigid @ (rigid.T @ load)
    free = np.setdiff1d(np.arange(n * d), held)
    K = sparse.csc_array(stiffness_matrix(body, x)[free][:, free])
    solver = splu(K, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    u = np.zeros_like(load)
    u[free] = solver.solve(load[free])
    u -= rigid @ (rigid.T @ u)
    return u.T.reshape(-1, n, d)


def balance_of(body, x, volume=np.pi / 6.0, viscosity=0.0, traction=0.0, cutoff=0.1, frozen=True):
    """The balance of a membrane whose density is 1 at ``x``."""
    adhesion = TractionSeparation(Linear(float(cutoff)), float(traction), 8.0, frozen)
    number = forces(body, x)[2].copy()
    return Balance(body, adhesion, float(viscosity), float(volume), number, np.ones(len(x)), x.copy())


def solved(balance, starts, tolerance, method="viscous", max_iterations=200_000, pressure=0.0):
    """The `vesdyn.balance.Solution` that an entry of METHODS finds from one of ``starts``."""
    limits = Limits(float(tolerance), int(max_iterations))
    return METHODS[method](balance, starts, float(pressure), limits, allocate(starts[0]))


def relaxed(balance, x, tolerance, kinetic=False, lighter=1.0, max_iterations=200_000, pressure=0.0):
    """Relax a copy of ``x``; return it with the progress. ``lighter`` divides the fictitious mass."""
    x, scratch = x.copy(), allocate(x)
    relaxation.set_fictitious_mass(balance, x, float(pressure), scratch)
    scratch.mass[:] /= lighter
    limits = Limits(float(tolerance), int(max_iterations))
    return x, relaxation.relax(
        balance, limits, x, relaxation.begin(pressure, scratch), bool(kinetic), int(max_iterations), scratch
    )


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
        "adhesion": more.get("adhesion", {}) | {"traction": traction * prestretch, "cutoff": cutoff / prestretch},
        "ligands": more.get("ligands", {}),
        "mesh": mesh | {"layout": more.get("layout", "rings")},
        "time": {"end": 2.0, "step": 1.0, "order": 1},
        "solver": {"tolerance": more.get("tolerance", 1e-6), "max_iterations": 400_000},
    })


def adhered(*arguments, **more):
    """A taut vesicle in static balance (`static_case`), reached in one step."""
    sim = Spreading(static_case(*arguments, **more))
    return static_state(Moment(sim, sim.advance(sim.start(), 1.0)))


def marched(sim, times, state=None):
    """The `Moment` of ``sim`` after a coupling step to each of ``times``, from ``state`` or t = 0."""
    state = sim.start() if state is None else state
    for time in times:
        state = sim.advance(state, time)
    return Moment(sim, state)


def static_state(moment):
    """Pressure, height, energy, and contact radius at z = 0, in the units of the tables.

    Next to the contact the membrane rises as z ~ s^2, so that the radius at height z is smooth in sqrt(z):
    measured at 1, 4 and 9 hundredths of the cutoff and continued by a parabola in sqrt(z) to z = 0.
    """
    case = moment.sim.case
    stretch = case.membrane.prestretch
    row = moment.row()
    radii = [
        mean_radius(moment.x, moment.sim.body.edges, level * case.adhesion.cutoff) for level in (0.01, 0.04, 0.09)
    ]
    return {
        "pressure": row["pressure"] / stretch,
        "height": row["height"] * stretch,
        "energy": row["elastic_energy"] * stretch**2,
        "contact_radius": stretch * (3.0 * radii[0] - 3.0 * radii[1] + radii[2]),
        "min_tension": row["tension_min"],
        "volume_error": row["volume_error"],
    }
