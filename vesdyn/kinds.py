"""The kinds of body there are: the one place that tells them apart, by the name a case gives or by a stored shape.

A kind is its module. Beside the kernels of `vesdyn.body` it gives

    start(mesh, membrane)         start positions and body of these sections of a case (`vesdyn.case`)
    topology(elements)            topology of elements with CORNERS corners each
    mesh_error(mesh, bending)     error model of a mesh (`vesdyn.body.MeshError`)
    mesh_size(mesh)               what a mesh will have and cost (`vesdyn.body.MeshSize`), before it is made
    far_edge(front_edge)          edge length [a0] at the top that goes with that at the front
    LONGEST_EDGE                  edge length [a0] at the front above which the error model says nothing
    CORNERS, XDMF                 nodes of an element; its name and that of its coordinates in XDMF
    KEEPS_AXIS                    True where every shape is axisymmetric

A new kind is a module with these names, and a line below.
"""
from vesdyn import meridian, surface

KINDS = {"axisymmetric": meridian, "surface": surface}  # by `model` of a case


def kind_of(corners):
    """The kind whose elements have so many ``corners``; ValueError where there is none."""
    for kind in KINDS.values():
        if kind.CORNERS == corners:
            return kind
    raise ValueError(f"no kind of body has elements of {corners} corners")


def topology_of(elements):
    """Topology of stored ``elements`` (n_elements, corners); ValueError where no kind has so many corners."""
    return kind_of(elements.shape[1]).topology(elements)
