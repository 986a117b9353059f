"""Damped explicit dynamic relaxation: fictitious mass, damping, residual, stopping.

Finds x that balances

    0 = -dE/dx + p dV/dx + f_adhesion(x) + f_contact - (drag/dt) A0 (x - x_rest),   V(x) = V0     (6)

by marching  m x'' + c m x' = out-of-balance force  in pseudo-time with steps of 1:

mass      m = bound/4, bound from the bodies' Gerschgorin-type estimate at the current stretch plus drag and
          adhesion, so that no mode exceeds the critical frequency 2 of central differences.
damping   `viscous`: c ~ 1.4 w, w the lowest frequency, estimated at each iteration by the Rayleigh quotient of
          the force change along the velocity (Underwood 1983); centred in time, so it does not lower the
          critical step.  `kinetic`: little damping, and the velocity is cleared just past each peak of the
          kinetic energy, half a step back (Barnes 1999). With none at all the highest modes never die.
fluid     the multiplier p is chosen at each iteration so that V(x) = V0 holds after it to first order:
          two dot products, no penalty stiffness.
contact   heights are cut at z = 0 and a node the load presses down rests; complementarity is exact.
stopping  the largest nodal residual divided by (T_max + K/a0) A0 falls below the tolerance.
"""
from typing import NamedTuple

import numpy as np

from vesdyn._jit import njit
from vesdyn.adhesion import adhesion_load
from vesdyn.body import add_elastic_forces, add_stiffness_bounds, dimension, elastic_energy
from vesdyn.contact import is_held

CONVERGED, DIVERGED, STALLED = 0, 1, 2
VOLUME_TOLERANCE = 1e-11
_OVERDAMPING = 1.4  # of the 2 w of the lowest mode: the quotient overestimates w while higher modes live
_KINETIC_FLOOR = 0.1  # viscous damping that goes with kinetic damping, against the highest modes
_EXPLODED = 1e6  # a residual that no start of a step has: something grows without bound


class RelaxationError(RuntimeError):
    """The relaxation found no equilibrium; the message says what happened and what to change."""


class Controls(NamedTuple):
    """How to relax."""

    tolerance: float  # largest nodal residual per reference area [T_max + K/a0]
    max_iterations: int
    kinetic: bool  # kinetic instead of viscous damping


class Balance(NamedTuple):
    """What is to be balanced: equation (6) for one coupling step."""

    body: tuple  # see `vesdyn.body`
    adhesion: tuple  # `vesdyn.adhesion.Adhesion`
    viscosity: float  # drag/dt [kT/a0^4]
    volume: float  # V0 [a0^3]
    number: np.ndarray  # (n_nodes,) receptors [c_r0 a0^2]
    x_rest: np.ndarray  # (n_nodes, d) positions where the drag vanishes [a0]


class Outcome(NamedTuple):
    """What a relaxation did."""

    status: int  # CONVERGED, DIVERGED or STALLED
    iterations: int
    residual: float
    pressure: float  # [kT/a0^3]
    volume: float  # [a0^3]


class Workspace(NamedTuple):
    """Nodal work arrays."""

    nodal: np.ndarray  # (n_nodes, 2 d + 1) force, volume gradient and area, see `vesdyn.body`
    velocity: np.ndarray  # (n_nodes, d) [a0 per iteration]
    mass: np.ndarray  # (n_nodes,) fictitious

    @property
    def area(self):
        """Current nodal areas (n_nodes,) [a0^2]."""
        return self.nodal[:, -1]


def workspace(x):
    """Allocate the arrays of `relax` for positions shaped like ``x``."""
    n, d = x.shape
    return Workspace(np.zeros((n, 2 * d + 1)), np.zeros((n, d)), np.zeros(n))


@njit
def set_fictitious_mass(balance, x, pressure, work):
    """Overwrite ``work.mass``: a quarter of a bound on the stiffness at ``x``."""
    body, adhesion, mass = balance.body, balance.adhesion, work.mass
    mass[:] = 0.0
    add_stiffness_bounds(body, x, pressure, mass)
    for i in range(mass.shape[0]):
        softening = adhesion_load(adhesion, 0.0, balance.number[i], body.reference_area[i]) / adhesion.cutoff
        mass[i] = 0.25 * (mass[i] + balance.viscosity * body.reference_area[i] + softening)


@njit
def set_forces(balance, x, work):
    """Overwrite ``work.nodal``, all forces but pressure and contact included; return the volume [a0^3]."""
    body, x_rest, nodal = balance.body, balance.x_rest, work.nodal
    nodal[:] = 0.0
    volume = add_elastic_forces(body, x, nodal)
    d = dimension(body)
    for i in range(x.shape[0]):
        drag = balance.viscosity * body.reference_area[i]
        for k in range(d):
            nodal[i, k] -= drag * (x[i, k] - x_rest[i, k])
        nodal[i, d - 1] -= adhesion_load(
            balance.adhesion, x[i, d - 1], balance.number[i], nodal[i, 2 * d]
        )
    return volume


@njit
def incremental_potential(balance, x, pressure, work):
    """Potential [kT] whose minimum is the balance: elastic, adhesive and viscous energy less p (V - V0).

    Exact for numbers held on their nodes; with frozen density the nodal areas count as constant.
    """
    body, adhesion, d = balance.body, balance.adhesion, x.shape[1]
    volume = set_forces(balance, x, work)
    potential = elastic_energy(body, x) - pressure * (volume - balance.volume)
    for i in range(x.shape[0]):
        moved = 0.0
        for k in range(d):
            moved += (x[i, k] - balance.x_rest[i, k]) ** 2
        potential += 0.5 * balance.viscosity * body.reference_area[i] * moved
        load = adhesion_load(adhesion, x[i, d - 1], balance.number[i], work.nodal[i, 2 * d])
        potential -= 0.5 * load * max(0.0, adhesion.cutoff - x[i, d - 1])
    return potential


@njit
def restoring_pressure(balance, x, missing_volume, pressure, keep, gain, work):
    """Pressure [kT/a0^3] under which the next move adds ``missing_volume`` [a0^3], to first order."""
    nodal, velocity, d = work.nodal, work.velocity, dimension(balance.body)
    z = d - 1
    flow = mobility = 0.0
    for i in range(x.shape[0]):
        per_mass = gain / work.mass[i]
        for k in range(d):
            force, dV_dx = nodal[i, k], nodal[i, d + k]
            if k == z and is_held(x[i, z], force + pressure * dV_dx):
                continue
            flow += dV_dx * (keep * velocity[i, k] + per_mass * force)
            mobility += per_mass * dV_dx * dV_dx
    return (missing_volume - flow) / mobility


@njit
def move_nodes(balance, x, pressure, keep, gain, work):
    """Kick and drift every node, the plane holding what presses on it.

    Returns the largest nodal residual, twice the kinetic energy, and the power of the velocity against the
    forces without pressure and with it.
    """
    nodal, velocity, mass, d = work.nodal, work.velocity, work.mass, dimension(balance.body)
    reference_area = balance.body.reference_area
    z = d - 1
    largest = kinetic = power = total_power = 0.0
    for i in range(x.shape[0]):
        per_mass = gain / mass[i]
        out_of_balance = 0.0
        for k in range(d):
            force = nodal[i, k] + pressure * nodal[i, d + k]
            if k == z and is_held(x[i, z], force):
                velocity[i, z] = 0.0
                continue
            out_of_balance += force * force
            v = keep * velocity[i, k] + per_mass * force
            if k == z and x[i, z] + v < 0.0:  # lands
                v = -x[i, z]
                x[i, z] = 0.0
            else:
                x[i, k] += v
            velocity[i, k] = v
            kinetic += v * v * mass[i]
            power += v * nodal[i, k]
            total_power += v * force
        largest = max(largest, out_of_balance / reference_area[i] ** 2)
    stress = balance.adhesion.traction + balance.body.shear_modulus
    return np.sqrt(largest) / stress, kinetic, power, total_power


@njit
def stiffness_along_velocity(power, kinetic, work, d):
    """Rayleigh quotient, (frequency)^2, of the force change along the velocity that caused it.

    ``power`` is that of the forces before the move; the pressure does no work on a motion of fixed volume.
    """
    change = power
    for i in range(work.velocity.shape[0]):
        for k in range(d):
            change -= work.velocity[i, k] * work.nodal[i, k]
    return max(0.0, change / kinetic)


@njit
def relax(balance, controls, x, pressure, work):
    """Move ``x`` (n_nodes, d) [a0] to balance, starting from its value; return an `Outcome`.

    ``pressure`` [kT/a0^3] is a first guess; ``work.mass`` is used as it is (`set_fictitious_mass`).
    """
    d = dimension(balance.body)
    work.velocity[:] = 0.0
    damping = _KINETIC_FLOOR
    kinetic = power = residual = 0.0
    volume = balance.volume
    for iteration in range(controls.max_iterations):
        volume = set_forces(balance, x, work)
        if not controls.kinetic and kinetic > 0.0:
            frequency = np.sqrt(stiffness_along_velocity(power, kinetic, work, d))
            damping = min(1.9, _OVERDAMPING * frequency)
        keep, gain = (2.0 - damping) / (2.0 + damping), 2.0 / (2.0 + damping)  # centred in time
        missing = balance.volume - volume
        pressure = restoring_pressure(balance, x, missing, pressure, keep, gain, work)
        residual, kinetic, power, total_power = move_nodes(balance, x, pressure, keep, gain, work)

        if not (residual < _EXPLODED and np.isfinite(volume)):
            return Outcome(DIVERGED, iteration + 1, residual, pressure, volume)
        if residual <= controls.tolerance and abs(missing) <= VOLUME_TOLERANCE * balance.volume:
            return Outcome(CONVERGED, iteration + 1, residual, pressure, volume)
        if controls.kinetic and total_power < 0.0:  # just past a peak of the kinetic energy
            for i in range(x.shape[0]):
                for k in range(d):
                    x[i, k] -= 0.5 * work.velocity[i, k]
            work.velocity[:] = 0.0
    return Outcome(STALLED, controls.max_iterations, residual, pressure, volume)


def explain(outcome, controls, time, dt):
    """One sentence on a relaxation that did not converge: what happened and what to change."""
    where = f"t = {time:.6g}, step {dt:.3g}: the relaxation"
    if outcome.status == DIVERGED:
        return f"{where} diverged after {outcome.iterations} iterations; reduce time.step or refine the mesh"
    return (
        f"{where} stalled at a residual of {outcome.residual:.2g} (wanted {controls.tolerance:.2g}) after "
        f"{outcome.iterations} iterations; reduce time.step, or raise solver.max_iterations or solver.tolerance"
    )
