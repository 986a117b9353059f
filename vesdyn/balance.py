"""Equation (6) of one coupling step: its forces, its potential, its tangent, and a bound on its stiffness.

    0 = -dE/dx + p dV/dx + f_adhesion(x) + f_contact - (drag/dt) A0 (x - x_rest),   V(x) = V0     (6)

This is the problem; how it is solved is another file's matter (`vesdyn.relaxation`). With the numbers of receptors
held on their nodes its solutions are stationary points of an incremental potential.
"""
from typing import NamedTuple

import numpy as np
from scipy import sparse

from vesdyn._jit import njit
from vesdyn.adhesion import adhesion_load, adhesion_potential, steepest_load
from vesdyn.body import add_elastic_forces, add_stiffness_bounds, dimension, elastic_energy, neighbours
from vesdyn.errors import RunError
from vesdyn.substrate import gap_of, normal_axis

CONVERGED, DIVERGED, STALLED, UNFINISHED = 0, 1, 2, 3
VOLUME_TOLERANCE = 1e-11  # relative error of the enclosed volume that a solution may have
NUDGE = 1e-5  # of the distance to the next node: displacement of the differences in `tangent`


class NoBalanceError(RunError):
    """No balance was found for a coupling step; the message says what happened and what to change."""


class Balance(NamedTuple):
    """What is to be balanced: equation (6) for one coupling step."""

    body: tuple  # see `vesdyn.body`
    adhesion: tuple  # `vesdyn.adhesion.TractionSeparation`
    viscosity: float  # drag/dt [kT/a0^4]
    volume: float  # V0 [a0^3]
    number: np.ndarray  # (n_nodes,) receptors [c_r0 a0^2]
    ligands: np.ndarray  # (n_nodes,) their density below the nodes, relative to their reference
    x_rest: np.ndarray  # (n_nodes, d) positions where the drag vanishes [a0]


class Limits(NamedTuple):
    """How well a balance is to be solved, and after how many iterations it is given up."""

    tolerance: float  # largest nodal residual per reference area [T_max]
    max_iterations: int


class Solution(NamedTuple):
    """What a method found."""

    x: np.ndarray  # (n_nodes, d) [a0]
    status: int  # CONVERGED, DIVERGED or STALLED
    iterations: int
    residual: float
    pressure: float  # [kT/a0^3]


class Scratch(NamedTuple):
    """Nodal arrays that are overwritten again and again."""

    nodal: np.ndarray  # (n_nodes, 2 d + 1) force, volume gradient and area, see `vesdyn.body`
    velocity: np.ndarray  # (n_nodes, d) [a0 per iteration]
    mass: np.ndarray  # (n_nodes,) fictitious

    @property
    def area(self):
        """Current nodal areas (n_nodes,) [a0^2]."""
        return self.nodal[:, -1]


def allocate(x):
    """Make the `Scratch` of positions shaped like ``x``."""
    n, d = x.shape
    return Scratch(np.zeros((n, 2 * d + 1)), np.zeros((n, d)), np.zeros(n))


@njit
def set_forces(balance, x, scratch):
    """Overwrite ``scratch.nodal``, all forces but pressure and contact included; return the volume [a0^3]."""
    body, x_rest, nodal = balance.body, balance.x_rest, scratch.nodal
    nodal[:] = 0.0
    volume = add_elastic_forces(body, x, nodal)
    d = dimension(body)
    z = normal_axis(d)
    for i in range(x.shape[0]):
        drag = balance.viscosity * body.reference_area[i]
        for k in range(d):
            nodal[i, k] -= drag * (x[i, k] - x_rest[i, k])
        nodal[i, z] -= adhesion_load(balance.adhesion, x[i, z], balance.number[i], nodal[i, 2 * d], balance.ligands[i])
    return volume


@njit
def force_scale(balance):
    """Stress [kT/a0^3] against which residuals are measured: the traction, which moves all; K/a0 where there is none."""
    return balance.adhesion.traction if balance.adhesion.traction > 0.0 else balance.body.shear_modulus


@njit
def incremental_potential(balance, x, pressure, scratch):
    """Potential [kT] whose minimum is the balance: elastic, adhesive and viscous energy less p (V - V0).

    Exact for numbers held on their nodes; with frozen density the nodal areas count as constant.
    """
    body, adhesion, d = balance.body, balance.adhesion, x.shape[1]
    volume = set_forces(balance, x, scratch)
    potential = elastic_energy(body, x) - pressure * (volume - balance.volume)
    for i in range(x.shape[0]):
        moved = 0.0
        for k in range(d):
            moved += (x[i, k] - balance.x_rest[i, k]) ** 2
        potential += 0.5 * balance.viscosity * body.reference_area[i] * moved
        area = scratch.nodal[i, 2 * d]
        potential += adhesion_potential(adhesion, gap_of(x, i), balance.number[i], area, balance.ligands[i])
    return potential


@njit
def set_stiffness_bound(balance, x, pressure, bound):
    """Overwrite ``bound`` (n_nodes,) [kT/a0^2] so that diag(bound) is above the stiffness of the balance at ``x``."""
    body = balance.body
    bound[:] = 0.0
    add_stiffness_bounds(body, x, pressure, bound)
    for i in range(bound.shape[0]):
        softening = steepest_load(balance.adhesion, balance.number[i], body.reference_area[i], balance.ligands[i])
        bound[i] = bound[i] + balance.viscosity * body.reference_area[i] + softening


def tangent(balance, x, pressure, scratch):
    """Tangent -dF/dx [kT/a0^2] of all forces F at fixed ``pressure`` [kT/a0^3]: csr, (n_nodes d, n_nodes d).

    F is what `set_forces` gives with the pressure, contact left out, at positions ``x`` (n_nodes, d) [a0]. Central
    differences of second order: nodes that share no force are displaced at once. Where a traction law has a kink, or a
    node touches the plane, the mean of both sides. Symmetric wherever there is a potential, which a frozen or saturated
    density has not, and but for the rows of coordinates that a body holds fast. Overwrites ``scratch.nodal``.
    """
    n, d = x.shape
    pattern = neighbours(balance.body)
    moved, colours = neighbour_distance(pattern, x) * NUDGE, apart(pattern)
    rows, columns = pattern.tocoo().coords
    values = np.empty((len(rows), d, d))
    for colour in range(colours.max() + 1):
        at_once = colours == colour
        entries = np.flatnonzero(at_once[columns])
        for k in range(d):
            change = np.zeros((n, d))
            for side in (1.0, -1.0):
                y = x.copy()
                y[at_once, k] += side * moved[at_once]
                set_forces(balance, y, scratch)
                change += side * (scratch.nodal[:, :d] + pressure * scratch.nodal[:, d : 2 * d])
            values[entries, :, k] = -change[rows[entries]] / (2.0 * moved[columns[entries]])[:, None]
    row, column = np.broadcast_arrays(
        d * rows[:, None, None] + np.arange(d)[:, None], d * columns[:, None, None] + np.arange(d)
    )
    return sparse.csr_array((values.ravel(), (row.ravel(), column.ravel())), (n * d, n * d))


def neighbour_distance(pattern, x):
    """Distance (n_nodes,) [a0] from each node of ``x`` to the nearest that it is coupled to by ``pattern``."""
    i, j = pattern.tocoo().coords
    i, j = i[i != j], j[i != j]
    nearest = np.full(len(x), np.inf)
    np.minimum.at(nearest, i, np.linalg.norm(x[i] - x[j], axis=1))
    return nearest


def apart(pattern):
    """Colours (n_nodes,), 0, 1, ..., such that no node is coupled by ``pattern`` to two nodes of one colour."""
    clash = sparse.csr_array(pattern @ pattern)
    colours = np.full(pattern.shape[0], -1)
    for node in range(len(colours)):
        taken = set(colours[clash.indices[clash.indptr[node] : clash.indptr[node + 1]]])
        colours[node] = next(colour for colour in range(len(taken) + 1) if colour not in taken)
    return colours
