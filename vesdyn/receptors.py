"""Receptors that diffuse and drift along the moving membrane, as numbers on nodes and fluxes on edges.

    d/dt N_i = - sum_j F_ij,     F_ij = w_ij [B(u) c_i - B(-u) c_j],     c_i = N_i / A_i        (4), (5)

Exponential fitting (Scharfetter & Gummel 1969): w_ij is the conductance of the edge, B(u) = u/(e^u - 1),
and u = s (phi_i - phi_j) the drop of the Boltzmann exponent (`vesdyn.adhesion`) along it, reduced by
s = min(1, q l/c) where ligands, of relative density l, are scarcer than receptors. Below saturation the zero-flux state
c ~ exp(phi) is exact at the nodes. For w_ij >= 0 the matrix of the implicit step is an M-matrix:
density stays positive for any step and any cell Peclet number. Fluxes are antisymmetric, so the
number is conserved to round-off whatever the accuracy of the linear solution. First order in time.
"""
from typing import NamedTuple

import numpy as np

from vesdyn._jit import njit

_PICARD_LIMIT = 60
_PICARD_TOLERANCE = 1e-11
_SOLVER_TOLERANCE = 1e-12
_EMPTY = 1e-30  # density [c_r0] left where rounding would make it negative


class Transport(NamedTuple):
    """Arrays of the implicit step; edges carry the conductance and the two flux coefficients."""

    conductance: np.ndarray  # (n_edges,)
    forth: np.ndarray  # (n_edges,) w B(u) dt
    back: np.ndarray  # (n_edges,) w B(-u) dt
    exponent: np.ndarray  # (n_nodes,) phi
    density: np.ndarray  # (n_nodes,) the solution c at the new time [c_r0]
    vectors: np.ndarray  # (10, n_nodes) of the linear solver


def transport(n_nodes, n_edges):
    """Allocate the arrays of `step_receptors`."""
    edge, node = (lambda: np.zeros(n_edges)), (lambda: np.zeros(n_nodes))
    return Transport(edge(), edge(), edge(), node(), node(), np.zeros((10, n_nodes)))


@njit
def bernoulli(u):
    """B(u) = u / (exp(u) - 1), with its series where the quotient loses digits."""
    if abs(u) < 1e-4:
        return 1.0 - 0.5 * u + u * u / 12.0
    return u / np.expm1(u)


@njit
def largest(vector):
    """Largest magnitude of the entries of ``vector``; NaN where there is one."""
    found = 0.0
    for value in vector:
        if not abs(value) <= found:
            found = abs(value)
    return found


@njit
def set_flux_coefficients(edges, ligand_ratio, ligands, dt, scratch):
    """Overwrite ``forth`` and ``back`` for the current density."""
    for e in range(edges.shape[0]):
        i, j = edges[e, 0], edges[e, 1]
        mean, below = 0.5 * (scratch.density[i] + scratch.density[j]), 0.5 * (ligands[i] + ligands[j])
        bound = 1.0 if mean <= ligand_ratio * below else ligand_ratio * below / mean  # share of the receptors
        u = bound * (scratch.exponent[i] - scratch.exponent[j])
        weight = dt * scratch.conductance[e]
        scratch.forth[e] = weight * bernoulli(u)
        scratch.back[e] = weight * bernoulli(-u)


@njit
def apply(edges, area, scratch, c, out):
    """out = A c + dt sum of the fluxes that leave: the matrix of the implicit step."""
    for i in range(area.shape[0]):
        out[i] = area[i] * c[i]
    for e in range(edges.shape[0]):
        i, j = edges[e, 0], edges[e, 1]
        flux = scratch.forth[e] * c[i] - scratch.back[e] * c[j]
        out[i] += flux
        out[j] -= flux


@njit
def is_solved(r, number, target):
    """True where the residual is small, and smaller than the number on every node.

    The second keeps nearly empty nodes positive: c = M^-1 (N - r), and M^-1 has no negative entry.
    """
    for i in range(r.shape[0]):
        if not (abs(r[i]) <= target and abs(r[i]) <= 0.5 * abs(number[i])):
            return False
    return True


@njit
def is_chain(edges, n):
    """True where the ``edges`` (n_edges, 2) join each of ``n`` nodes to the next and no others."""
    if edges.shape[0] != n - 1:
        return False
    for e in range(n - 1):
        if edges[e, 0] != e or edges[e, 1] != e + 1:
            return False
    return True


@njit
def solve_density(edges, area, number, scratch):
    """Solve (A + dt L) c = N for ``scratch.density``; return whether it was found."""
    if is_chain(edges, area.shape[0]):
        return solve_on_chain(area, number, scratch)
    return iterate_density(edges, area, number, scratch)


@njit
def solve_on_chain(area, number, scratch):
    """Solve (A + dt L) c = N on a chain of nodes by elimination from its first node to its last.

    Each pivot is the node's area, which the columns of the matrix add up to, plus the flux that leaves to the next
    node and what the area and the fluxes so far leave of the flux back: sums of positive terms, so that every density
    is positive and exact to rounding, however thin it is.
    """
    n = area.shape[0]
    c = scratch.density
    own, load = scratch.vectors[0], scratch.vectors[1]
    own[0] = area[0]  # pivot less the flux to the next node
    load[0] = number[0]
    for i in range(1, n):
        forth, back = scratch.forth[i - 1], scratch.back[i - 1]
        pivot = own[i - 1] + forth
        own[i] = area[i] + back * own[i - 1] / pivot
        load[i] = number[i] + forth * load[i - 1] / pivot
    c[n - 1] = load[n - 1] / own[n - 1]
    for i in range(n - 2, -1, -1):
        c[i] = (load[i] + scratch.back[i] * c[i + 1]) / (own[i] + scratch.forth[i])
    return np.isfinite(c[0])


@njit
def iterate_density(edges, area, number, scratch):
    """Solve (A + dt L) c = N for ``scratch.density`` by BiCGSTAB with the diagonal (van der Vorst 1992).

    Returns whether it was found; stops at a residual of 1e-12 of the largest nodal number, see `is_solved`.
    """
    n = area.shape[0]
    c = scratch.density
    diagonal, r, shadow, p, v, s, t, y, z = scratch.vectors[:9]
    for i in range(n):
        diagonal[i] = area[i]
    for e in range(edges.shape[0]):
        diagonal[edges[e, 0]] += scratch.forth[e]
        diagonal[edges[e, 1]] += scratch.back[e]
    apply(edges, area, scratch, c, r)
    for i in range(n):
        r[i] = number[i] - r[i]
        shadow[i] = r[i]
    p[:] = 0.0
    v[:] = 0.0
    rho = alpha = omega = 1.0
    target = _SOLVER_TOLERANCE * np.max(number)
    for _ in range(10 * n + 100):
        if is_solved(r, number, target):
            return True
        rho_old = rho
        rho = 0.0
        for i in range(n):
            rho += shadow[i] * r[i]
        beta = rho / rho_old * alpha / omega
        if not np.isfinite(beta) or rho == 0.0:
            return False
        for i in range(n):
            p[i] = r[i] + beta * (p[i] - omega * v[i])
            y[i] = p[i] / diagonal[i]
        apply(edges, area, scratch, y, v)
        alpha = 0.0
        for i in range(n):
            alpha += shadow[i] * v[i]
        alpha = rho / alpha
        for i in range(n):
            s[i] = r[i] - alpha * v[i]
            z[i] = s[i] / diagonal[i]
        apply(edges, area, scratch, z, t)
        ts = tt = 0.0
        for i in range(n):
            ts += t[i] * s[i]
            tt += t[i] * t[i]
        omega = ts / tt if tt > 0.0 else 0.0
        for i in range(n):
            c[i] += alpha * y[i] + omega * z[i]
            r[i] = s[i] - omega * t[i]
        if omega == 0.0:
            return is_solved(r, number, target)
    return False


@njit
def is_saturated(density, ligand_ratio, ligands):
    """True where some node has more receptors than ligands."""
    for i in range(density.shape[0]):
        if density[i] > ligand_ratio * ligands[i]:
            return True
    return False


@njit
def step_receptors(edges, area, ligand_ratio, ligands, dt, number, scratch):
    """Advance ``number`` (n_nodes,) [c_r0 a0^2] by ``dt`` [a0^2/D] on a membrane at rest.

    ``scratch.conductance`` and ``scratch.exponent`` describe the membrane, ``area`` (n_nodes,) [a0^2] its nodes and
    ``ligands`` (n_nodes,) what is below them. Above saturation the drift depends on the density and is iterated to
    convergence. Returns whether a density was found.
    """
    before = scratch.vectors[9]
    for i in range(area.shape[0]):
        scratch.density[i] = number[i] / area[i]
    for _ in range(_PICARD_LIMIT):
        saturated = is_saturated(scratch.density, ligand_ratio, ligands)
        set_flux_coefficients(edges, ligand_ratio, ligands, dt, scratch)
        before[:] = scratch.density
        if not solve_density(edges, area, number, scratch):
            return False
        saturated |= is_saturated(scratch.density, ligand_ratio, ligands)
        highest = max(np.max(before), np.max(scratch.density))
        before -= scratch.density
        if not saturated or largest(before) <= _PICARD_TOLERANCE * highest:
            break
    else:
        return False
    for e in range(edges.shape[0]):
        i, j = edges[e, 0], edges[e, 1]
        flux = scratch.forth[e] * scratch.density[i] - scratch.back[e] * scratch.density[j]
        number[i] -= flux
        number[j] += flux
    fullest = np.argmax(number)
    for i in range(number.shape[0]):
        if number[i] <= 0.0:  # rounding, on a node as good as empty: the fullest one does not notice
            left = area[i] * _EMPTY
            number[fullest] -= left - number[i]
            number[i] = left
    return True
