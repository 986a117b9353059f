"""Receptor-ligand traction-separation laws, their nodal loads, and the ligands below (Liu et al. 2007, section 2.2).

    T(d, c) = T_max l min(c, q l) f(d)                                                             (3)

per current area, along -z; d the gap to the substrate, c the receptor density in units of c_r0, l the density of
the ligands below relative to their reference (1 unless they are patterned) and f the shape of the law, f(0) = 1 and
f = 0 beyond the cutoff d_c. The paper's law is linear: f = 1 - d/d_c.

A law is a named tuple with three kernels, and nobody outside this file knows more of it:

    shape           f(d)
    integral        F(d) = int_d^d_c f,  so F' = -f: the potential of a node and the exponent of the drift follow
    steepest_slope  max |f'|: the stiffness bound of the relaxation follows

A node carries N receptors on a current area A: c = N / A, and its load is T A. While the membrane moves the
*number* is held, so that an unsaturated node has the potential -T_max l N F(d); frozen receptors instead keep c = 1
whatever the membrane does.
"""
from typing import NamedTuple

import numpy as np

from vesdyn._jit import by_type, njit
from vesdyn.substrate import gap_of, in_plane


@by_type
def shape(law, gap):
    """Fraction f of the full traction that acts at ``gap`` [a0]; 0 beyond the cutoff."""
    raise NotImplementedError


@by_type
def integral(law, gap):
    """Integral F [a0] of the shape from ``gap`` [a0] to the cutoff."""
    raise NotImplementedError


@by_type
def steepest_slope(law):
    """Bound [1/a0] on the magnitude of the slope of the shape."""
    raise NotImplementedError


# The laws ------------------------------------------------------------------------------------------------


class Linear(NamedTuple):
    """The paper's law, f = 1 - d/d_c."""

    cutoff: float  # d_c [a0]


@shape.register(Linear)
@njit
def linear_shape(law, gap):
    """See `shape`."""
    return max(0.0, 1.0 - max(gap, 0.0) / law.cutoff)


@integral.register(Linear)
@njit
def linear_integral(law, gap):
    """See `integral`."""
    near = linear_shape(law, gap)
    return 0.5 * law.cutoff * near * near


@steepest_slope.register(Linear)
@njit
def linear_slope(law):
    """See `steepest_slope`."""
    return 1.0 / law.cutoff


class Piecewise(NamedTuple):
    """A law that is straight between knots, from gap 0 to the cutoff, where it is 0."""

    knot: np.ndarray  # (n_knots,) gaps, rising from 0 to the cutoff [a0]
    value: np.ndarray  # (n_knots,) f there, 1 at the first and 0 at the last
    beyond: np.ndarray  # (n_knots,) integral from there to the cutoff [a0]
    slope: np.ndarray  # (n_knots - 1,) between the knots [1/a0]


def piecewise(knot, value):
    """Make the `Piecewise` law through (``knot``, ``value``), both (n_knots,)."""
    knot, value = np.asarray(knot, dtype=float), np.asarray(value, dtype=float)
    pieces = 0.5 * (value[1:] + value[:-1]) * np.diff(knot)
    beyond = np.concatenate([np.cumsum(pieces[::-1])[::-1], [0.0]])
    return Piecewise(knot, value, beyond, np.diff(value) / np.diff(knot))


@shape.register(Piecewise)
@njit
def piecewise_shape(law, gap):
    """See `shape`."""
    d = max(gap, 0.0)
    for k in range(law.slope.shape[0]):
        if d < law.knot[k + 1]:
            return law.value[k] + law.slope[k] * (d - law.knot[k])
    return 0.0


@integral.register(Piecewise)
@njit
def piecewise_integral(law, gap):
    """See `integral`."""
    d = max(gap, 0.0)
    for k in range(law.slope.shape[0]):
        if d < law.knot[k + 1]:
            here = law.value[k] + law.slope[k] * (d - law.knot[k])
            return law.beyond[k + 1] + 0.5 * (here + law.value[k + 1]) * (law.knot[k + 1] - d)
    return 0.0


@steepest_slope.register(Piecewise)
@njit
def piecewise_slope(law):
    """See `steepest_slope`."""
    return np.max(np.abs(law.slope))


def linear(section):
    """The linear law of the ``adhesion`` section of a case."""
    return Linear(section.cutoff)


def double_well(section):
    """The law with two minima of the ``adhesion`` section of a case, which the paper names as future work.

    A short well of bonds, from 1 at the substrate to 0 at ``well`` x cutoff; then the glycocalyx, which repels by
    up to ``barrier``; then a weak attraction of long range of up to ``tail``. Barrier and tail are triangles of
    equal width. NOTE: all three are carried by the receptors, as the one shape of equation (3) is.
    """
    top = 0.5 * (1.0 + section.well)  # between barrier and tail
    knot = [0.0, section.well, 0.5 * (section.well + top), top, 0.5 * (top + 1.0), 1.0]
    return piecewise(section.cutoff * np.array(knot), [1.0, 0.0, -section.barrier, 0.0, section.tail, 0.0])


LAWS = {"linear": linear, "double_well": double_well}  # `adhesion.law` of a case: makes the law of its section


# Loads ---------------------------------------------------------------------------------------------------


class TractionSeparation(NamedTuple):
    """A law with its strength, and how far the receptors can use it."""

    law: tuple  # one of those above
    traction: float  # T_max [kT/a0^3]
    ligand_ratio: float  # q = c_l / c_r0
    frozen: bool  # density held at 1


@njit
def adhesion_traction(adhesion, gap, density, ligands):
    """Traction T [kT/a0^3] at ``gap`` [a0], receptor ``density`` [c_r0] and ``ligands`` l, equation (3)."""
    bound = min(density, adhesion.ligand_ratio * ligands)
    return adhesion.traction * ligands * bound * shape(adhesion.law, gap)


@njit
def full_load(adhesion, number, area, ligands):
    """Load [kT/a0] at gap 0 on a node of current ``area`` [a0^2] that carries ``number`` [c_r0 a0^2] receptors."""
    pulling = area if adhesion.frozen else min(number, adhesion.ligand_ratio * ligands * area)
    return adhesion.traction * ligands * pulling


@njit
def adhesion_load(adhesion, gap, number, area, ligands):
    """Load T A [kT/a0] on a node at ``gap`` [a0]; the rest as for `full_load`."""
    return full_load(adhesion, number, area, ligands) * shape(adhesion.law, gap)


@njit
def adhesion_potential(adhesion, gap, number, area, ligands):
    """Potential [kT] of a node; arguments as for `adhesion_load`."""
    return -full_load(adhesion, number, area, ligands) * integral(adhesion.law, gap)


@njit
def steepest_load(adhesion, number, area, ligands):
    """Bound [kT/a0^2] on the change of `adhesion_load` with the gap."""
    return full_load(adhesion, number, area, ligands) * steepest_slope(adhesion.law)


@njit
def set_boltzmann_exponents(drift_number, adhesion, ligands, x, exponent):
    """Overwrite ``exponent`` (n_nodes,): the zero-flux density is c ~ exp(phi) below saturation.

    phi = L T_max l F(d), L the drift number; its slope along the membrane is the drift of (4). Where ``ligands`` l
    (n_nodes,) are patterned it also leads to where they are denser, as the gain of a receptor that binds does.
    """
    for i in range(x.shape[0]):
        exponent[i] = drift_number * adhesion.traction * ligands[i] * integral(adhesion.law, gap_of(x, i))


@njit
def bound_receptors(adhesion, number, x):
    """Receptors [c_r0 a0^2] in reach of the ligands, each counted by the share of the traction at its gap."""
    bound = 0.0
    for i in range(x.shape[0]):
        bound += number[i] * abs(shape(adhesion.law, gap_of(x, i)))
    return bound


@njit
def adhesion_work(adhesion, number, ligands, x_old, area_old, x, area):
    """Work [kT] of the adhesion on a path x_old -> x, the load taken as the mean of its end values."""
    work = 0.0
    for i in range(x.shape[0]):
        before = adhesion_load(adhesion, gap_of(x_old, i), number[i], area_old[i], ligands[i])
        after = adhesion_load(adhesion, gap_of(x, i), number[i], area[i], ligands[i])
        work += 0.5 * (before + after) * (gap_of(x_old, i) - gap_of(x, i))
    return work


# Ligands -------------------------------------------------------------------------------------------------


def _even(section, x):
    return np.ones(len(x))


def _disc(section, x):
    distance = np.linalg.norm(in_plane(x), axis=1)
    return _step(section, 0.5 * section.width - distance)


def _stripe(section, x):
    return _step(section, 0.5 * section.width - np.abs(x[:, 0]))


def _stripes(section, x):
    off = np.abs((x[:, 0] / section.period + 0.5) % 1.0 - 0.5) * section.period  # from the middle of the nearest
    return _step(section, 0.5 * section.width - off)


def _squares(section, x):
    off = np.abs((in_plane(x) / section.period + 0.5) % 1.0 - 0.5) * section.period
    return _step(section, 0.5 * section.width - off.max(axis=1))


def _step(section, inside):
    """1 where ``inside`` (n,) [a0] is positive, ``elsewhere`` outside, straight across the blurred border."""
    share = np.clip(0.5 + inside / section.blur, 0.0, 1.0)
    return section.elsewhere + (1.0 - section.elsewhere) * share


PATTERNS = {"even": _even, "disc": _disc, "stripe": _stripe, "stripes": _stripes, "squares": _squares}


def ligand_density(section, x):
    """Density l (n_nodes,) of the ligands below ``x`` (n_nodes, d) [a0], relative to their reference.

    ``section`` is the ``ligands`` section of a case: a pattern about the axis, of ``width`` and ``period`` [a0].
    """
    return PATTERNS[section.pattern](section, x)
