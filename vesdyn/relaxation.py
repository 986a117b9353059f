"""Damped explicit dynamic relaxation: fictitious mass, damping, residual, stopping.

Balances equation (6), `vesdyn.balance`, by marching  m x'' + c m x' = out-of-balance force  in pseudo-time with
steps of 1:

mass      m = bound/4, bound from the bodies' Gerschgorin-type estimate at the current stretch plus drag and
          adhesion, so that no mode exceeds the critical frequency 2 of central differences.
damping   `viscous`: c ~ 1.4 w, w the lowest frequency, estimated at each iteration by the Rayleigh quotient of
          the force change along the velocity (Underwood 1983); centred in time, so it does not lower the
          critical step.  `kinetic`: little damping, and the velocity is cleared just past each peak of the
          kinetic energy, half a step back (Barnes 1999). With none at all the highest modes never die.
fluid     the multiplier p is chosen at each iteration so that V(x) = V0 holds after it to first order, or V comes
          nearer by a hundredth where more is missing: two dot products, no penalty stiffness.
contact   heights are cut at z = 0 and a node the load presses down rests; complementarity is exact.
stopping  the largest nodal residual divided by T_max A0 falls below the tolerance.
"""
from typing import NamedTuple

import numpy as np

from vesdyn._jit import njit
from vesdyn.balance import (
    CONVERGED,
    DIVERGED,
    STALLED,
    UNFINISHED,
    VOLUME_TOLERANCE,
    Solution,
    force_scale,
    incremental_potential,
    set_forces,
    set_stiffness_bound,
)
from vesdyn.body import dimension
from vesdyn.substrate import is_held, land, normal_axis

_OVERDAMPING = 1.4  # of the 2 w of the lowest mode: the quotient overestimates w while higher modes live
_STRONGEST_DAMPING = 1.9  # of the 2 beyond which a centred step turns the velocity round
_KINETIC_FLOOR = 0.1  # viscous damping that goes with kinetic damping, against the highest modes
_EXPLODED = 1e6  # a residual that no start of a step has: something grows without bound
_HEAVIER = (1.0, 4.0, 16.0)  # a relaxation that fails starts again with a larger fictitious mass
_VOLUME_A_MOVE = 0.01  # of the volume that an iteration restores at most: a larger leap outruns the fictitious mass
_LEAP = 2000  # iterations after which less than that is missing, or the moves only undo what the pressure restores
_NODES_A_SITTING = 4_000_000  # nodes times iterations between two looks at whether to stop: a few tenths of a second


class Progress(NamedTuple):
    """How far a relaxation has come; with the velocity in the scratch arrays it goes on to the same bits."""

    status: int  # CONVERGED, DIVERGED, STALLED or UNFINISHED
    iterations: int
    residual: float
    pressure: float  # [kT/a0^3]
    kinetic: float  # twice the kinetic energy of the last move
    power: float  # of that move against the forces without pressure


def viscous(balance, starts, pressure, limits, scratch, pause=lambda: None):
    """Relax by viscous damping from the better of ``starts``; return a `vesdyn.balance.Solution`.

    ``starts`` are positions (n_nodes, d) [a0] that stay as they are, the first the one to fall back on; ``pressure``
    [kT/a0^3] a first guess; ``pause`` is called every few tenths of a second and may raise.
    """
    return _solve(balance, starts, pressure, limits, scratch, pause, False)


def kinetic(balance, starts, pressure, limits, scratch, pause=lambda: None):
    """Relax by kinetic damping; arguments and result as for `viscous`."""
    return _solve(balance, starts, pressure, limits, scratch, pause, True)


def _solve(balance, starts, pressure, limits, scratch, pause, is_kinetic):
    for heavier in _HEAVIER:
        candidates = starts if heavier == 1.0 else starts[:1]
        x = min(candidates, key=lambda s: incremental_potential(balance, s, pressure, scratch)).copy()
        set_fictitious_mass(balance, x, pressure, scratch)
        scratch.mass[:] *= heavier
        progress = begin(pressure, scratch)
        sitting = max(1, _NODES_A_SITTING // len(x))
        while progress.status == UNFINISHED:
            pause()
            progress = relax(balance, limits, x, progress, is_kinetic, sitting, scratch)
            if progress.status == CONVERGED and not has_volume(balance, x, scratch):  # the last move undid it
                progress = progress._replace(status=UNFINISHED)
        if progress.status == CONVERGED:
            break
    return Solution(x, *progress[:4])


def begin(pressure, scratch):
    """Bring the nodes to rest; return the `Progress` of a relaxation that starts under ``pressure`` [kT/a0^3]."""
    scratch.velocity[:] = 0.0
    return Progress(UNFINISHED, 0, 0.0, float(pressure), 0.0, 0.0)


def has_volume(balance, x, scratch):
    """Whether ``x`` encloses the volume of the balance, as a solution must."""
    return abs(set_forces(balance, x, scratch) - balance.volume) <= VOLUME_TOLERANCE * balance.volume


@njit
def set_fictitious_mass(balance, x, pressure, scratch):
    """Overwrite ``scratch.mass``: a quarter of a bound on the stiffness at ``x``."""
    set_stiffness_bound(balance, x, pressure, scratch.mass)
    scratch.mass[:] *= 0.25


@njit
def restoring_pressure(balance, x, missing_volume, pressure, keep, gain, scratch):
    """Pressure [kT/a0^3] under which the next move adds ``missing_volume`` [a0^3], to first order."""
    nodal, velocity, d = scratch.nodal, scratch.velocity, dimension(balance.body)
    z = normal_axis(d)
    flow = mobility = 0.0
    for i in range(x.shape[0]):
        per_mass = gain / scratch.mass[i]
        for k in range(d):
            force, dV_dx = nodal[i, k], nodal[i, d + k]
            if k == z and is_held(x[i, z], force + pressure * dV_dx):
                continue
            flow += dV_dx * (keep * velocity[i, k] + per_mass * force)
            mobility += per_mass * dV_dx * dV_dx
    return (missing_volume - flow) / mobility


@njit
def move_nodes(balance, x, pressure, keep, gain, scratch):
    """Kick and drift every node, the plane holding what presses on it.

    Returns the largest nodal residual, twice the kinetic energy, and the power of the velocity against the
    forces without pressure and with it.
    """
    nodal, velocity, mass, d = scratch.nodal, scratch.velocity, scratch.mass, dimension(balance.body)
    reference_area = balance.body.reference_area
    z = normal_axis(d)
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
            if k == z:
                x[i, z], v = land(x[i, z], v)
            else:
                x[i, k] += v
            velocity[i, k] = v
            kinetic += v * v * mass[i]
            power += v * nodal[i, k]
            total_power += v * force
        largest = max(largest, out_of_balance / reference_area[i] ** 2)
    return np.sqrt(largest) / force_scale(balance), kinetic, power, total_power


@njit
def stiffness_along_velocity(power, kinetic, scratch, d):
    """Rayleigh quotient, (frequency)^2, of the force change along the velocity that caused it.

    ``power`` is that of the forces before the move; the pressure does no work on a motion of fixed volume.
    """
    change = power
    for i in range(scratch.velocity.shape[0]):
        for k in range(d):
            change -= scratch.velocity[i, k] * scratch.nodal[i, k]
    return max(0.0, change / kinetic)


@njit
def relax(balance, limits, x, progress, is_kinetic, sitting, scratch):
    """Move ``x`` (n_nodes, d) [a0] towards balance for at most ``sitting`` iterations; return the new `Progress`.

    ``scratch.mass`` and ``scratch.velocity`` are used as they are (`set_fictitious_mass`, `begin`).
    """
    d = dimension(balance.body)
    damping = _KINETIC_FLOOR
    pressure, kinetic, power, residual = progress.pressure, progress.kinetic, progress.power, progress.residual
    last = min(progress.iterations + sitting, limits.max_iterations)
    for iteration in range(progress.iterations, last):
        volume = set_forces(balance, x, scratch)
        if not is_kinetic and kinetic > 0.0:
            frequency = np.sqrt(stiffness_along_velocity(power, kinetic, scratch, d))
            damping = min(_STRONGEST_DAMPING, _OVERDAMPING * frequency)
        keep, gain = (2.0 - damping) / (2.0 + damping), 2.0 / (2.0 + damping)  # centred in time
        missing = balance.volume - volume
        most = _VOLUME_A_MOVE * balance.volume
        closed = max(-most, min(most, missing))
        pressure = restoring_pressure(balance, x, closed, pressure, keep, gain, scratch)
        residual, kinetic, power, total_power = move_nodes(balance, x, pressure, keep, gain, scratch)

        runs_away = abs(missing) > most and iteration >= _LEAP
        if runs_away or not (residual < _EXPLODED and np.isfinite(volume)):
            return Progress(DIVERGED, iteration + 1, residual, pressure, kinetic, power)
        if residual <= limits.tolerance and abs(missing) <= VOLUME_TOLERANCE * balance.volume:
            return Progress(CONVERGED, iteration + 1, residual, pressure, kinetic, power)
        if is_kinetic and total_power < 0.0:  # just past a peak of the kinetic energy
            for i in range(x.shape[0]):
                for k in range(d):
                    x[i, k] -= 0.5 * scratch.velocity[i, k]
            scratch.velocity[:] = 0.0
    status = STALLED if last >= limits.max_iterations else UNFINISHED
    return Progress(status, last, residual, pressure, kinetic, power)
