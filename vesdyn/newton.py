"""Newton's method for the balance of a meridian: banded tangent, bordered volume, contact as an active set.

With the forces F = -dE/dx + p dV/dx + f_adhesion - drag of equation (6), K = -dF/dx at fixed p and g = dV/dx, each
iteration solves

    [ K   -g ] [ dx ]   [ F      ]
    [ g^T  0 ] [ dp ] = [ V0 - V ]

for the free coordinates. A node on the plane whose load presses it down is held; one that would pass the plane lands
on it; one that is pulled off is free again in the next iteration. Neighbouring nodes share forces at most two apart, so
K has five bands on either side; it is differenced, every fifth node at once. A step is halved while it would turn an
element over or raise the residual. Where that does not help, or leads to a balance of higher potential than the start,
steps with more drag go down the potential (`descend`); where those do not arrive the relaxation
(`vesdyn.relaxation`) takes over.
"""
import numpy as np
from scipy.linalg.lapack import dgbsv

from vesdyn import relaxation
from vesdyn._jit import njit
from vesdyn.adhesion import bound_receptors
from vesdyn.balance import CONVERGED, VOLUME_TOLERANCE, Solution, force_scale, incremental_potential, set_forces
from vesdyn.body import area_facing_away, dimension
from vesdyn.errors import CaseError
from vesdyn.substrate import is_held, land, normal_axis

REACH = 2  # nodes on either side that feel a node
BANDS = 2 * REACH + 1  # of the matrix, on either side of its diagonal
_ITERATIONS = 40
_HALVINGS = 4  # then steps downhill are taken instead: shorter ones only crawl
_ROUNDING = 1e-12  # of the potential: what counts as none
_NUDGE = 1e-6  # of the distance to the neighbours: displacement of the differences
_DESCENTS = 200  # steps downhill where Newton's own do not lead to a balance
_MORE_DRAG, _LESS_DRAG = 6.0, 0.3  # factors on the drag that is added, after a step that fails and one that succeeds
_MOST_DRAG = 1e4  # of the first: more is no help
_LONGEST_MOVE = 0.5  # of the shorter neighbouring segment: longer moves may turn it over


def newton(balance, starts, pressure, limits, scratch, pause=lambda: None):
    """Balance a meridian by Newton's method from the better of ``starts``; return a `vesdyn.balance.Solution`.

    Arguments as for `vesdyn.relaxation.viscous`, which takes over where the iteration does not converge. Raises
    CaseError for any other body.
    """
    if dimension(balance.body) != 2:
        raise CaseError("solver.method: newton solves the balance of a meridian only; take relaxation, or model: axisymmetric.")
    start = min(starts, key=lambda s: incremental_potential(balance, s, pressure, scratch))
    x, guess, band = start.copy(), pressure, np.zeros((2 * BANDS + 1, start.size))
    size, missing = residual(balance, x, pressure, scratch)
    for iteration in range(min(_ITERATIONS, limits.max_iterations)):
        if size <= limits.tolerance and abs(missing) <= VOLUME_TOLERANCE:
            if not is_lower(balance, x, starts[0], pressure, scratch) or lies_inside_down(balance, x):
                break
            return Solution(x, CONVERGED, iteration, size, float(pressure))
        pause()
        step = _step(balance, x, pressure, missing, scratch, band)
        if step is None:
            break
        dx, dp = step
        share = min(1.0, _LONGEST_MOVE / largest_move(x, dx))
        for _ in range(_HALVINGS):
            trial = x.copy()
            move(trial, share * dx)
            new_size, new_missing = residual(balance, trial, pressure + share * dp, scratch)
            if new_size + abs(new_missing) < size + abs(missing) or (share == 1.0 and new_size <= limits.tolerance):
                break
            share *= 0.5
        else:
            break
        x, pressure, size, missing = trial, pressure + share * dp, new_size, new_missing
    found = descend(balance, starts[0], guess, limits, scratch, band, pause)
    return found or relaxation.viscous(balance, starts, guess, limits, scratch, pause)


def descend(balance, start, pressure, limits, scratch, band, pause=lambda: None):
    """Go down the potential from ``start`` by Newton's steps with as much more drag as it takes; None where that fails.

    Where the membrane snaps to another shape, or many nodes land at once, the tangent is not positive and Newton's
    step leads anywhere. With enough drag added to it, mu A0 (x - x_now), it leads downhill: mu is raised until the
    potential falls and lowered after each step that does. This is implicit Euler in a pseudo-time with steps of 1/mu.
    """
    x, pressure = start.copy(), float(pressure)
    size, missing = residual(balance, x, pressure, scratch)
    mu = size * force_scale(balance) / np.min(np.linalg.norm(np.diff(x, axis=0), axis=1))
    most = _MOST_DRAG * mu
    for iteration in range(min(_DESCENTS, limits.max_iterations)):
        if mu > most:  # the forces are no gradient here, as where ligands are short: no drag leads down
            return None
        if size <= limits.tolerance and abs(missing) <= VOLUME_TOLERANCE:
            if has_let_go(balance, start, x):  # a lower residual may lead there as well
                return None
            return Solution(x, CONVERGED, _ITERATIONS + iteration, size, float(pressure))
        pause()
        step = _step(balance, x, pressure, missing, scratch, band, mu)
        if step is None:
            mu *= _MORE_DRAG
            continue
        dx, dp = step
        share = min(1.0, _LONGEST_MOVE / largest_move(x, dx))
        trial = x.copy()
        move(trial, share * dx)
        new_pressure = pressure + share * dp
        new_size, new_missing = residual(balance, trial, new_pressure, scratch)
        falls = np.isfinite(new_size) and is_lower(balance, trial, x, new_pressure, scratch)
        nearer = falls or new_size + abs(new_missing) < size + abs(missing)
        if nearer and not lies_inside_down(balance, trial):
            x, pressure, size, missing = trial, new_pressure, new_size, new_missing
            mu *= _LESS_DRAG
        else:
            mu *= _MORE_DRAG
    return None


def is_lower(balance, x, start, pressure, scratch):
    """True where the potential at ``x`` is not above that at ``start``: a balance above it is none that the membrane seeks.

    Without drag, for example, a vesicle that hovers beyond the reach of the substrate is in balance as well. Both must
    enclose the volume of the balance, as the last shape does and one seen ahead does not.
    """
    here, before = (incremental_potential(balance, y, pressure, scratch) for y in (x, start))
    return here <= before + _ROUNDING * abs(before)


def lies_inside_down(balance, x):
    """True where membrane lies on the substrate with its inner side down, as after a step that turns an element over."""
    return area_facing_away(balance.body.topology, x, 0.0) > 0.0


def has_let_go(balance, start, x):
    """True where receptors were in reach of the substrate at ``start`` and none are at ``x``."""
    return bound_receptors(balance.adhesion, balance.number, start) > 0.0 == bound_receptors(balance.adhesion, balance.number, x)


def _step(balance, x, pressure, missing, scratch, band, more_drag=0.0):
    """Changes of x (n_nodes, 2) and p, under ``more_drag`` [kT/a0^4]; None where the tangent is singular."""
    set_forces(balance, x, scratch)
    force = scratch.nodal[:, :2] + pressure * scratch.nodal[:, 2:4]
    gradient = scratch.nodal[:, 2:4].copy()
    set_tangent(balance, x, pressure, scratch, band)
    band[BANDS] += more_drag * np.repeat(balance.body.reference_area, 2)
    fix_held(x, force, gradient, band)
    wide = np.zeros((3 * BANDS + 1, force.size), order="F")  # room for the pivots
    wide[BANDS:] = band
    *_, found, singular = dgbsv(BANDS, BANDS, wide, np.stack([force.ravel(), gradient.ravel()], axis=1), overwrite_ab=True)
    if singular:
        return None
    a, b = found.T
    g = gradient.ravel()
    dp = (missing * balance.volume - g @ a) / (g @ b)
    dx = (a + dp * b).reshape(-1, 2)
    return (dx, dp) if np.isfinite(dx).all() else None


@njit
def residual(balance, x, pressure, scratch):
    """Largest nodal out-of-balance force, scaled as by the relaxation, and (V0 - V)/V0; infinite for no shape."""
    volume = set_forces(balance, x, scratch)
    z = normal_axis(x.shape[1])
    largest = 0.0
    for i in range(x.shape[0]):
        out_of_balance = 0.0
        for k in range(x.shape[1]):
            force = scratch.nodal[i, k] + pressure * scratch.nodal[i, x.shape[1] + k]
            if not (k == z and is_held(x[i, z], force)):
                out_of_balance += force * force
        largest = max(largest, out_of_balance / balance.body.reference_area[i] ** 2)
    if not (np.isfinite(volume) and np.isfinite(largest)):
        return np.inf, np.inf
    return np.sqrt(largest) / force_scale(balance), (balance.volume - volume) / balance.volume


@njit
def set_tangent(balance, x, pressure, scratch, band):
    """Overwrite ``band`` (2 BANDS + 1, 2 n_nodes), K = -dF/dx as `scipy.linalg.solve_banded` would take it."""
    n, d = x.shape
    band[:] = 0.0
    y = x.copy()
    sides = np.zeros((2, n, d))
    nudge = np.zeros(n)
    for i in range(n):
        below, above = max(i - 1, 0), min(i + 1, n - 1)
        nudge[i] = _NUDGE * np.hypot(x[above, 0] - x[below, 0], x[above, 1] - x[below, 1])
    for first in range(BANDS):  # no force feels two nodes that are five apart
        for k in range(d):
            for side in range(2):
                for i in range(first, n, BANDS):
                    y[i, k] = x[i, k] + (nudge[i] if side else -nudge[i])
                set_forces(balance, y, scratch)
                for i in range(n):
                    for l in range(d):
                        sides[side, i, l] = scratch.nodal[i, l] + pressure * scratch.nodal[i, d + l]
            for i in range(first, n, BANDS):
                y[i, k] = x[i, k]
                column = d * i + k
                for j in range(max(0, i - REACH), min(n, i + REACH + 1)):
                    for l in range(d):
                        row = d * j + l
                        band[BANDS + row - column, column] = (sides[0, j, l] - sides[1, j, l]) / (2.0 * nudge[i])


@njit
def fix_held(x, force, gradient, band):
    """Take the coordinates that do not move out of the system: the axis at the poles, the plane under held nodes."""
    n, d = x.shape
    z = normal_axis(d)
    for i in range(n):
        for k in range(d):
            on_axis = k == 0 and (i == 0 or i == n - 1)
            if not (on_axis or (k == z and is_held(x[i, z], force[i, z]))):
                continue
            force[i, k] = gradient[i, k] = 0.0
            fixed = d * i + k
            for other in range(max(0, fixed - BANDS), min(n * d, fixed + BANDS + 1)):
                band[BANDS + fixed - other, other] = 0.0
                band[BANDS + other - fixed, fixed] = 0.0
            band[BANDS, fixed] = 1.0


@njit
def largest_move(x, dx):
    """Largest move of a node in units of its shorter neighbouring segment."""
    largest = 1e-300
    for i in range(x.shape[0] - 1):
        length = np.hypot(x[i + 1, 0] - x[i, 0], x[i + 1, 1] - x[i, 1])
        change = np.hypot(dx[i + 1, 0] - dx[i, 0], dx[i + 1, 1] - dx[i, 1])
        largest = max(largest, change / length)
    return largest


@njit
def move(x, dx):
    """Move the nodes; one that would pass the plane lands on it."""
    z = normal_axis(x.shape[1])
    for i in range(x.shape[0]):
        for k in range(x.shape[1]):
            if k == z:
                x[i, z] = land(x[i, z], dx[i, z])[0]
            else:
                x[i, k] += dx[i, k]
