"""What a discretised membrane must be able to do, whatever it is made of.

Node positions ``x`` have one row a node and the height z as their last coordinate; nothing outside a
body's own module knows how many coordinates there are or what an element is.

A topology says which nodes are joined, and no more: the named tuple of the ``elements`` (n_elements, corners) and of
the ``edges`` (n_edges, 2) along which receptors travel. With positions it has areas, a contour and conductances, and
can be drawn. A body is a topology with a rest state and a material: a named tuple with the fields ``topology``,
``shear_modulus`` K [kT/a0^2], ``reference_area`` (n_nodes,) [a0^2] and what else its kernels need.

A new kind of body registers one kernel for each function below, and `vesdyn.kinds` names it.
"""
from typing import NamedTuple

import numpy as np
from scipy import sparse

from vesdyn._jit import by_type, njit


class MeshError(NamedTuple):
    """Relative error of the binding area at t = 0.01: constant (front edge / front radius)^exponent."""

    constant: float
    exponent: float

    def at(self, edge, radius):
        """Error with this front ``edge`` [a0] and front ``radius`` [a0]."""
        return self.constant * (edge / radius) ** self.exponent

    def edge(self, error, radius):
        """Front edge [a0] with which the relative ``error`` is made, where the front is at ``radius`` [a0]."""
        return radius * (error / self.constant) ** (1.0 / self.exponent)


class MeshSize(NamedTuple):
    """What a mesh has and costs, estimated before it is made."""

    nodes: float
    memory: float  # [bytes] while it is made
    step: float  # [s] of one core for one coupling step, within a factor of three


@njit
def extended_share(low, high, length, slope, curvature, level):
    """Share of an edge below ``level`` if the membrane beyond it is extended over its upper end.

    ``low`` < ``level`` <= ``high`` are the heights of its ends and ``length`` its length [a0]; ``slope`` dz/ds and
    ``curvature`` d2z/ds2 [1/a0] those of the membrane at the upper end. Where the parabola has its lowest
    point above ``level``, that point counts. Never less than straight interpolation gives.
    """
    straight = (level - low) / (high - low)
    drop = high - level
    root = slope * slope - 2.0 * curvature * drop
    if slope * length <= high - low:
        return straight
    distance = 2.0 * drop / (slope + np.sqrt(root)) if root > 0.0 else slope / curvature
    return min(1.0, max(straight, 1.0 - distance / length))


def sharing(centre, member, n):
    """Pattern (n, n) of the nodes that meet in some group; entry k puts node ``member[k]`` into group ``centre[k]``."""
    groups = sparse.csr_array((np.ones(len(centre)), (centre, member)), (int(np.max(centre)) + 1, n))
    return sparse.csr_array(groups.T @ groups)


# Bodies ------------------------------------------------------------------------------------------------------


@by_type
def dimension(body):
    """Coordinates of a node, d: a constant of the body's type, so that compiled loops over it unroll."""
    raise NotImplementedError


@by_type
def add_elastic_forces(body, x, nodal):
    """Add elastic forces, volume gradient and current areas to the rows of ``nodal``; return the volume.

    ``x`` (n_nodes, d) [a0]; ``nodal`` (n_nodes, 2 d + 1), one row a node so that an element touches one
    cache line a corner: -dE/dx (d) [kT/a0], dV/dx (d) [a0^2], area (1) [a0^2]. The volume V [a0^3] is
    signed: negative means inside-out, NaN that ``x`` is no shape at all.
    """
    raise NotImplementedError


@by_type
def add_stiffness_bounds(body, x, pressure, bound):
    """Add to ``bound`` (n_nodes,) [kT/a0^2] so that diag(bound) is above the stiffness of membrane and fluid."""
    raise NotImplementedError


@by_type
def neighbours(body):
    """Coupling pattern: which nodes' forces change with which node's position, its own included.

    A `scipy.sparse.csr_array` (n_nodes, n_nodes) that is symmetric; only where it has entries counts.
    """
    raise NotImplementedError


@by_type
def elastic_energy(body, x):
    """Elastic energy E [kT]."""
    raise NotImplementedError


@by_type
def principal_tensions(body, x, tension):
    """Overwrite ``tension`` (n_elements, 2) [kT/a0^2]: larger first, or meridional and hoop if axisymmetric."""
    raise NotImplementedError


# Topologies --------------------------------------------------------------------------------------------------


@by_type
def edge_conductances(topology, x, conductance):
    """Overwrite ``conductance`` (n_edges,): flux along an edge per unit difference of density (D = 1).

    An element whose nodes all lie on the plane conducts nothing (receptors in contact are immobile).
    Returns how many negative sums were set to zero.
    """
    raise NotImplementedError


@by_type
def set_shares_below(topology, x, level, share):
    """Overwrite ``share`` (n_edges,): the part of each edge that lies below height ``level`` [a0].

    The membrane leaves the plane at an angle, and the kink lies somewhere on the edge that crosses: it is
    found by extending slope and curvature of the free membrane beyond the edge down to ``level``. Straight
    interpolation from node to node would put the front at the last bound node until the next one lands.
    """
    raise NotImplementedError


@by_type
def area_below(topology, x, level, share):
    """Current membrane area [a0^2] below ``level`` [a0] cut where ``share`` says (`set_shares_below`)."""
    raise NotImplementedError


@by_type
def area_facing_away(topology, x, level):
    """Current area [a0^2] of the elements that lie below ``level`` [a0] as a whole and face away from the substrate.

    The membrane that adheres faces the substrate. A leaf that has turned over it lies on other membrane: the model
    has no self-contact, and what it computes of such a state is wrong.
    """
    raise NotImplementedError


@by_type
def element_areas(topology, x):
    """Current area (n_elements,) [a0^2] of each element, plainly: for pictures and studies."""
    raise NotImplementedError


@by_type
def as_triangles(topology, x):
    """Triangles to draw the shape ``x`` with: vertices (n, 3) [a0], outward faces (n_faces, 3), nodes (n,).

    Vertex i shows the values of the node ``nodes[i]``. Not for computing: what is curved is drawn flat.
    """
    raise NotImplementedError
