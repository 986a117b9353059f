"""What a discretised membrane must be able to do, whatever it is made of.

A body is a named tuple of arrays: its reference state, its ``elements`` and the ``edges`` along which
receptors travel. Node positions ``x`` have one row a node and the height z as their last coordinate;
nothing outside a body's own module knows how many coordinates there are or what an element is. A new
body registers one kernel for each function below.

Every body has the fields ``shear_modulus`` K [kT/a0^2], ``reference_area`` (n_nodes,) [a0^2] and
``edges`` (n_edges, 2).
"""
from vesdyn._jit import by_body


@by_body
def dimension(body):
    """Coordinates of a node, d: a constant of the body's type, so that compiled loops over it unroll."""
    raise NotImplementedError


@by_body
def add_elastic_forces(body, x, nodal):
    """Add elastic forces, volume gradient and current areas to the rows of ``nodal``; return the volume.

    ``x`` (n_nodes, d) [a0]; ``nodal`` (n_nodes, 2 d + 1), one row a node so that an element touches one
    cache line a corner: -dE/dx (d) [kT/a0], dV/dx (d) [a0^2], area (1) [a0^2]. The volume V [a0^3] is
    signed: negative means inside-out.
    """
    raise NotImplementedError


@by_body
def add_stiffness_bounds(body, x, pressure, bound):
    """Add to ``bound`` (n_nodes,) [kT/a0^2] so that diag(bound) is above the stiffness of membrane and fluid."""
    raise NotImplementedError


@by_body
def elastic_energy(body, x):
    """Elastic energy E [kT]."""
    raise NotImplementedError


@by_body
def edge_conductances(body, x, conductance):
    """Overwrite ``conductance`` (n_edges,): flux along an edge per unit difference of density (D = 1).

    An element whose nodes all lie on the plane conducts nothing (receptors in contact are immobile).
    Returns how many negative sums were set to zero.
    """
    raise NotImplementedError


@by_body
def area_below(body, x, level):
    """Current membrane area [a0^2] below height ``level`` [a0], the height interpolated inside elements."""
    raise NotImplementedError


@by_body
def principal_tensions(body, x, tension):
    """Overwrite ``tension`` (n_elements, 2) [kT/a0^2]: larger first, or meridional and hoop if axisymmetric."""
    raise NotImplementedError
