"""Receptor-ligand traction-separation law and its nodal loads (Liu et al. 2007, section 2.2).

    T(d, c) = T_max min(c, q) (1 - d/d_c)   for 0 <= d <= d_c, else 0                          (3)

per current area, along -z; d the gap to the plane z = 0, c the receptor density in units of c_r0.
A node carries N receptors on a current area A: c = N / A, and its load is T A. While the membrane
moves the *number* is held, so that an unsaturated node has the potential N T_max (d_c/2)(1 - d/d_c)^2;
frozen receptors instead keep c = 1 whatever the membrane does.
"""
from typing import NamedTuple

from vesdyn._jit import njit


class Adhesion(NamedTuple):
    """Parameters of the traction-separation law."""

    traction: float  # T_max [kT/a0^3]
    cutoff: float  # d_c [a0]
    ligand_ratio: float  # q = c_l / c_r0
    frozen: bool  # density held at 1


@njit
def proximity(adhesion, gap):
    """Fraction (1 - d/d_c) of the full traction that acts at ``gap`` [a0]; 0 beyond the cutoff."""
    return max(0.0, 1.0 - max(gap, 0.0) / adhesion.cutoff)


@njit
def adhesion_traction(adhesion, gap, density):
    """Traction T [kT/a0^3] at ``gap`` [a0] and ``density`` [c_r0], equation (3)."""
    return adhesion.traction * min(density, adhesion.ligand_ratio) * proximity(adhesion, gap)


@njit
def adhesion_load(adhesion, gap, number, area):
    """Load T A [kT/a0] on a node of current ``area`` [a0^2] that carries ``number`` [c_r0 a0^2] receptors."""
    pulling = area if adhesion.frozen else min(number, adhesion.ligand_ratio * area)
    return adhesion.traction * pulling * proximity(adhesion, gap)


@njit
def set_boltzmann_exponents(drift_number, adhesion, x, exponent):
    """Overwrite ``exponent`` (n_nodes,): the zero-flux density is c ~ exp(phi) below saturation.

    phi = L T_max (d_c/2) (1 - d/d_c)^2, L the drift number; its slope along the membrane is the drift of (4).
    """
    height = x.shape[1] - 1
    for i in range(x.shape[0]):
        near = proximity(adhesion, x[i, height])
        exponent[i] = 0.5 * drift_number * adhesion.traction * adhesion.cutoff * near * near


@njit
def adhesion_work(adhesion, number, x_old, area_old, x, area):
    """Work [kT] of the adhesion on a path x_old -> x, the load taken as the mean of its end values."""
    z = x.shape[1] - 1
    work = 0.0
    for i in range(x.shape[0]):
        before = adhesion_load(adhesion, x_old[i, z], number[i], area_old[i])
        after = adhesion_load(adhesion, x[i, z], number[i], area[i])
        work += 0.5 * (before + after) * (x_old[i, z] - x[i, z])
    return work
