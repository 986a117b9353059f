"""Equation (6) of one coupling step: its forces, its potential, and a bound on its stiffness.

    0 = -dE/dx + p dV/dx + f_adhesion(x) + f_contact - (drag/dt) A0 (x - x_rest),   V(x) = V0     (6)

This is the problem; how it is solved is another file's matter (`vesdyn.relaxation`). With the numbers of receptors
held on their nodes its solutions are stationary points of an incremental potential.
"""
from typing import NamedTuple

import numpy as np

from vesdyn._jit import njit
from vesdyn.adhesion import adhesion_load, adhesion_potential, steepest_load
from vesdyn.body import add_elastic_forces, add_stiffness_bounds, dimension, elastic_energy
from vesdyn.errors import RunError
from vesdyn.substrate import gap_of, normal_axis

CONVERGED, DIVERGED, STALLED, UNFINISHED = 0, 1, 2, 3
VOLUME_TOLERANCE = 1e-11  # relative error of the enclosed volume that a solution may have


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
