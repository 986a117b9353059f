"""Axisymmetric shell: mesh, forces, volume, areas, edge conductances.

Conical segments between rings. With L, R the reference length and mean radius of a segment and l, r the
current ones, the principal stretches are l1 = l/L (meridian) and l2 = r/R (hoop), so J = A/A0 exactly:

    E = sum A0 W(I1, J),  A0 = 2 pi R L,        V = pi/3 sum (r_a^2 + r_a r_b + r_b^2) (z_b - z_a)

A node is a ring, x = (r, z), numbered from the contact pole to the top pole; forces, areas and numbers are
those of the whole ring, so that energies and areas are the same as on a triangulated surface. The two
poles stay on the axis. Second order in the segment length.

Bending lives on the nodes, of outward normal n: with the tangent g = x,S and h_1 = x,SS of the parabola through the
neighbours, S the reference arc length, and h_2 = -r/R^2 e_r, the second fundamental form is b_1 = n . h_1 (meridian)
and b_2 = n . h_2 (hoop); beyond a pole the meridian goes on as its mirror image, and b_2 = b_1 there.
"""
from typing import NamedTuple

import numpy as np

from vesdyn import body as generic
from vesdyn._jit import njit
from vesdyn.koiter import bending_energy, bending_moments, bending_stiffness
from vesdyn.meshing import check_memory, expected_nodes, graded_meridian, revolved
from vesdyn.neo_hookean import (
    principal_tension,
    strain_energy,
    strain_energy_I1,
    strain_energy_J,
    strain_energy_JJ,
)


CORNERS, XDMF, KEEPS_AXIS = 2, ("Polyline", "XY"), True
LONGEST_EDGE = 0.02  # [a0]; the errors below were measured on shorter ones
TOP_EDGE, TOP_TO_FRONT = 0.05, 6.0  # the edge at the top is not longer than this [a0], nor than so many front edges
MESH_ERROR = {  # by whether there is bending; the paper's cases (d_c 0.06 to 0.18) at front edges of 0.0012 to 0.02
    False: generic.MeshError(1.1, 1.5),
    True: generic.MeshError(15.0, 2.2),
}
BYTES = 4000.0  # a node, while the mesh is made
STEP_TIME = 0.0009, 100, 1.0  # [s] of a coupling step at so many nodes, over random scenes by Newton's method; the exponent
DRAWN_SECTORS = 120  # three degrees each: the eye sees a circle


class Cones(NamedTuple):
    """Topology of a meridian: the chain of its conical segments from the contact to the top."""

    elements: np.ndarray  # (n_segments, 2) nodes of each segment, lower first
    edges: np.ndarray  # (n_segments, 2) the elements once more: receptors travel along them


class Meridian(NamedTuple):
    """A meridian from pole to pole with its stress-free reference and its material."""

    topology: Cones
    shear_modulus: float  # K [kT/a0^2]
    length: np.ndarray  # (n_segments,) reference length L [a0]
    radius: np.ndarray  # (n_segments,) reference mean radius R [a0]
    reference_area: np.ndarray  # (n_nodes,) reference area of each ring [a0^2]
    bending_stiffness: float  # B [kT]
    ring_radius: np.ndarray  # (n_nodes,) reference radius of each node [a0]
    rest_curvature: np.ndarray  # (n_nodes, 2) b_0: meridional, hoop [1/a0]

    elements = property(lambda self: self.topology.elements)
    edges = property(lambda self: self.topology.edges)


def start(mesh, membrane):
    """Start positions (n_nodes, 2) [a0] and `Meridian` of the sections ``mesh`` and ``membrane`` of a case.

    Raises CaseError where the mesh is larger than this machine holds.
    """
    size = mesh_size(mesh)
    check_memory(size.nodes, BYTES)
    x = graded_meridian(mesh.front_edge, mesh.far_edge, mesh.axes, fine_angle=np.radians(mesh.fine_angle))
    return x, build_meridian(x, membrane.shear_modulus, membrane.prestretch, membrane.thickness)


def topology(elements):
    """`Cones` of the chain ``elements`` (n_segments, 2), from the contact to the top."""
    elements = np.ascontiguousarray(elements, dtype=np.uint32)
    return Cones(elements, elements)


def mesh_error(mesh, bending):
    """`vesdyn.body.MeshError` of a meridian, with ``bending`` or without."""
    return MESH_ERROR[bending]


def far_edge(front_edge):
    """Edge length [a0] far above the substrate that goes with ``front_edge``."""
    return max(front_edge, min(TOP_EDGE, TOP_TO_FRONT * front_edge))


def mesh_size(mesh):
    """`vesdyn.body.MeshSize` of the section ``mesh`` of a case."""
    nodes = expected_nodes(mesh.front_edge, mesh.far_edge, mesh.axes, np.radians(mesh.fine_angle))[0]
    seconds, at, exponent = STEP_TIME
    return generic.MeshSize(nodes, BYTES * nodes, seconds * (nodes / at) ** exponent)


def build_meridian(x, shear_modulus, prestretch=1.0, thickness=0.0):
    """Make a `Meridian` whose start state ``x`` is stretched by ``prestretch`` against its reference.

    ``x`` (n_nodes, 2) are (r, z) [a0] from the lower to the upper pole. The start state is free of moments, a
    shell of ``thickness`` h [a0]. Raises ValueError where the ends are off the axis or the curve does not
    enclose a positive volume.
    """
    if x[0, 0] != 0.0 or x[-1, 0] != 0.0:
        raise ValueError("meridian: the first and the last node must lie on the axis r = 0")
    if np.any(x[1:-1, 0] <= 0.0):
        raise ValueError("meridian: a node between the poles has r <= 0")
    n = len(x)
    body = Meridian(
        topology=topology(np.stack([np.arange(n - 1), np.arange(1, n)], axis=1)),
        shear_modulus=float(shear_modulus),
        length=np.linalg.norm(np.diff(x, axis=0), axis=1) / prestretch,
        radius=0.5 * (x[1:, 0] + x[:-1, 0]) / prestretch,
        reference_area=np.zeros(n),
        bending_stiffness=float(bending_stiffness(shear_modulus, thickness)),
        ring_radius=x[:, 0] / prestretch,
        rest_curvature=np.zeros((n, 2)),
    )
    if thickness > 0.0:
        for i in range(n):
            body.rest_curvature[i] = curvature(body, x, i)
    nodal = np.zeros((n, 5))
    if not add_elastic_forces(body, x, nodal) > 0.0:
        raise ValueError("meridian: the curve runs from the top to the contact (negative volume); reverse it")
    return body._replace(reference_area=nodal[:, 4] / prestretch**2)


@njit
def stretches(body, x, e):
    """Principal stretches of segment ``e``: meridional, hoop."""
    a, b = body.topology.elements[e, 0], body.topology.elements[e, 1]
    length = np.hypot(x[b, 0] - x[a, 0], x[b, 1] - x[a, 1])
    return length / body.length[e], 0.5 * (x[a, 0] + x[b, 0]) / body.radius[e]


@generic.dimension.register(Meridian)
@njit
def dimension(body):
    """See `vesdyn.body.dimension`."""
    return 2


@generic.add_elastic_forces.register(Meridian)
@njit
def add_elastic_forces(body, x, nodal):
    """See `vesdyn.body.add_elastic_forces`."""
    K = body.shear_modulus
    volume = 0.0
    inverted = False  # W knows the squares of the stretches only and would take r < 0 for r > 0
    for e in range(body.topology.elements.shape[0]):
        a, b = body.topology.elements[e, 0], body.topology.elements[e, 1]
        ra, rb = x[a, 0], x[b, 0]
        inverted |= ra < 0.0
        dr, dz = rb - ra, x[b, 1] - x[a, 1]
        l = np.sqrt(dr * dr + dz * dz)
        L, R = body.length[e], body.radius[e]
        l1, l2 = l / L, 0.5 * (ra + rb) / R
        A0 = 2.0 * np.pi * R * L
        W_J = strain_energy_J(K, 1.0 / (l1 * l2))
        meridional = A0 * (2.0 * strain_energy_I1(K) * l1 + W_J * l2) / (L * l)  # -dE/dl per l
        hoop = A0 * (2.0 * strain_energy_I1(K) * l2 + W_J * l1) * 0.5 / R  # -dE/dr of either node
        nodal[a, 0] += meridional * dr - hoop
        nodal[a, 1] += meridional * dz
        nodal[b, 0] -= meridional * dr + hoop
        nodal[b, 1] -= meridional * dz
        disc = np.pi / 3.0 * (ra * ra + ra * rb + rb * rb)
        volume += disc * dz
        nodal[a, 2] += np.pi / 3.0 * (2.0 * ra + rb) * dz
        nodal[a, 3] -= disc
        nodal[b, 2] += np.pi / 3.0 * (2.0 * rb + ra) * dz
        nodal[b, 3] += disc
        nodal[a, 4] += np.pi / 3.0 * l * (2.0 * ra + rb)
        nodal[b, 4] += np.pi / 3.0 * l * (2.0 * rb + ra)
    if body.bending_stiffness > 0.0:
        add_bending_forces(body, x, nodal)
    for pole in (0, x.shape[0] - 1):  # kept on the axis
        nodal[pole, 0] = nodal[pole, 2] = 0.0
    return np.nan if inverted else volume


@generic.neighbours.register(Meridian)
def neighbours(body):
    """See `vesdyn.body.neighbours`: the next node on either side, and with bending the one beyond it."""
    elements, n = body.topology.elements.astype(int), len(body.reference_area)
    centre, member = np.repeat(np.arange(len(elements)), 2), elements.ravel()
    if body.bending_stiffness > 0.0:
        i, beside = np.arange(1, n - 1)[:, None], np.arange(-1, 2)
        centre = np.concatenate([centre, len(elements) + np.repeat(np.arange(n - 2), 3)])
        member = np.concatenate([member, (i + beside).ravel()])
    return generic.sharing(centre, member, n)


@njit
def parabola(body, x, i):
    """Parabola through node ``i`` and its neighbours a, b: x,S = C_a (x_a - x_i) + C_b (x_b - x_i), x,SS alike in D.

    Returns a, b, (C_a, C_b), (D_a, D_b), g = x,S and h_1 = x,SS as (r, z), and 1/R^2, 0 at a pole.
    """
    last = x.shape[0] - 1
    below, above = abs(i - 1), last - abs(last - i - 1)
    La, Lb = body.length[max(i, 1) - 1], body.length[min(i, last - 1)]
    total = La + Lb
    Ca, Cb, Da, Db = -Lb / (La * total), La / (Lb * total), 2.0 / (La * total), 2.0 / (Lb * total)
    mirrored_a, mirrored_b = (-1.0 if i == 0 else 1.0), (-1.0 if i == last else 1.0)
    ar, az = mirrored_a * x[below, 0] - x[i, 0], x[below, 1] - x[i, 1]
    br, bz = mirrored_b * x[above, 0] - x[i, 0], x[above, 1] - x[i, 1]
    R = body.ring_radius[i]
    return (
        below,
        above,
        (Ca, Cb),
        (Da, Db),
        (Ca * ar + Cb * br, Ca * az + Cb * bz),
        (Da * ar + Db * br, Da * az + Db * bz),
        1.0 / (R * R) if 0 < i < last else 0.0,
    )


@njit
def curvature(body, x, i):
    """Second fundamental form b_1, b_2 [1/a0] at node ``i``."""
    _, _, _, _, g, h, per_RR = parabola(body, x, i)
    G = np.sqrt(g[0] * g[0] + g[1] * g[1])
    b1 = (g[1] * h[0] - g[0] * h[1]) / G
    return b1, -x[i, 0] * g[1] / G * per_RR if per_RR > 0.0 else b1


@njit
def moments(body, x, i):
    """Moments m_1, m_2 [kT/a0] that work on b_1 and b_2 at node ``i``: at a pole all of it on b_1."""
    b1, b2 = curvature(body, x, i)
    rest = body.rest_curvature
    m1, m2, _ = bending_moments(body.bending_stiffness, b1 - rest[i, 0], b2 - rest[i, 1], 0.0)
    return (m1, m2) if 0 < i < x.shape[0] - 1 else (m1 + m2, 0.0)


@njit
def add_bending_forces(body, x, nodal):
    """Add the bending forces [kT/a0] to the first two columns of ``nodal`` (`vesdyn.koiter`)."""
    for i in range(x.shape[0]):
        below, above, C, D, g, h, per_RR = parabola(body, x, i)
        m1, m2 = moments(body, x, i)
        GG = g[0] * g[0] + g[1] * g[1]
        per_G = 1.0 / np.sqrt(GG)
        n_r, n_z = g[1] * per_G, -g[0] * per_G
        f = (m1 * (h[0] * g[0] + h[1] * g[1]) - m2 * per_RR * x[i, 0] * g[0]) / GG  # moments along the tangent
        A0 = body.reference_area[i]
        force_a, force_b = A0 * (C[0] * f - D[0] * m1), A0 * (C[1] * f - D[1] * m1)
        nodal[below, 0] += force_a * n_r  # none at a pole, where n_r = 0: the mirror image needs no sign
        nodal[below, 1] += force_a * n_z
        nodal[above, 0] += force_b * n_r
        nodal[above, 1] += force_b * n_z
        nodal[i, 0] -= (force_a + force_b) * n_r - A0 * m2 * per_RR * n_r
        nodal[i, 1] -= (force_a + force_b) * n_z


@njit
def add_bending_bounds(body, x, bound):
    """Add to ``bound`` (n_nodes,) [kT/a0^2] what bounds the stiffness of bending.

    As on a surface (`vesdyn.curvature.add_bending_bounds`), but each of the three nodes carries its own weight times
    the sum also of the material part s: it hardly differs from that by pairs, b_1 outweighing b_2 (0.86 is needed).
    """
    B = body.bending_stiffness
    for i in range(x.shape[0]):
        below, above, C, D, g, h, per_RR = parabola(body, x, i)
        m1, m2 = moments(body, x, i)
        b1, b2 = curvature(body, x, i)
        GG = g[0] * g[0] + g[1] * g[1]
        along_1, along_2 = (h[0] * g[0] + h[1] * g[1]) / GG, -x[i, 0] * per_RR * g[0] / GG
        all_s = all_c = all_m = 0.0
        for again in range(2):
            for k in range(3):
                j = below if k == 0 else above if k == 1 else i
                own = 0.0 if k < 2 else per_RR
                Ck = C[k] if k < 2 else -C[0] - C[1]
                Dk = D[k] if k < 2 else -D[0] - D[1]
                s1, s2 = abs(Dk - along_1 * Ck), abs(along_2 * Ck) + own
                s = np.sqrt(B * (s1 * s1 + s2 * s2 + s1 * s2)) if per_RR > 0.0 else np.sqrt(3.0 * B) * s1
                c, m = abs(Ck) / np.sqrt(GG), abs(m1) * s1 + abs(m2) * s2
                if again:
                    work = abs(m1 * b1 + m2 * b2) * c * all_c
                    bound[j] += body.reference_area[i] * (s * all_s + m * all_c + c * all_m + work)
                else:
                    all_s, all_c, all_m = all_s + s, all_c + c, all_m + m


@generic.elastic_energy.register(Meridian)
@njit
def elastic_energy(body, x):
    """See `vesdyn.body.elastic_energy`."""
    energy = 0.0
    for e in range(body.topology.elements.shape[0]):
        l1, l2 = stretches(body, x, e)
        A0 = 2.0 * np.pi * body.radius[e] * body.length[e]
        energy += A0 * strain_energy(body.shear_modulus, l1 * l1 + l2 * l2, 1.0 / (l1 * l2))
    return energy + bending_energy_total(body, x)


@njit
def bending_energy_total(body, x):
    """Bending energy E_b [kT]."""
    energy, rest = 0.0, body.rest_curvature
    if body.bending_stiffness > 0.0:
        for i in range(x.shape[0]):
            b1, b2 = curvature(body, x, i)
            energy += body.reference_area[i] * bending_energy(
                body.bending_stiffness, b1 - rest[i, 0], b2 - rest[i, 1], 0.0
            )
    return energy


@generic.principal_tensions.register(Meridian)
@njit
def principal_tensions(body, x, tension):
    """See `vesdyn.body.principal_tensions`: meridional, hoop."""
    for e in range(body.topology.elements.shape[0]):
        l1, l2 = stretches(body, x, e)
        tension[e, 0] = principal_tension(body.shear_modulus, l1, 1.0 / (l1 * l2))
        tension[e, 1] = principal_tension(body.shear_modulus, l2, 1.0 / (l1 * l2))


@generic.add_stiffness_bounds.register(Meridian)
@njit
def add_stiffness_bounds(body, x, pressure, bound):
    """See `vesdyn.body.add_stiffness_bounds`.

    K_e <= A0 [(W_11^(1/2) |dl1/dx| + W_22^(1/2) |dl2/dx|)^2 + |W_1| / (l L) 2], |dl1/dx|^2 = 2/L^2 and
    |dl2/dx|^2 = 1/(2 R^2); W_ij the second derivatives with respect to the stretches, W_12^2 <= W_11 W_22.
    """
    K = body.shear_modulus
    for e in range(body.topology.elements.shape[0]):
        a, b = body.topology.elements[e, 0], body.topology.elements[e, 1]
        l1, l2 = stretches(body, x, e)
        L, R = body.length[e], body.radius[e]
        l3 = 1.0 / (l1 * l2)
        W_11 = 2.0 * strain_energy_I1(K) + strain_energy_JJ(K, l3) * l2 * l2
        W_22 = 2.0 * strain_energy_I1(K) + strain_energy_JJ(K, l3) * l1 * l1
        W_1 = 2.0 * strain_energy_I1(K) * l1 + strain_energy_J(K, l3) * l2
        material = (np.sqrt(2.0 * W_11) / L + np.sqrt(0.5 * W_22) / R) ** 2
        geometric = 2.0 * abs(W_1) / (L * L * l1)
        A0 = 2.0 * np.pi * R * L
        fluid = abs(pressure) * 2.0 * np.pi * max(x[a, 0], x[b, 0], l1 * L)
        bound[a] += A0 * (material + geometric) + fluid
        bound[b] += A0 * (material + geometric) + fluid
    if body.bending_stiffness > 0.0:
        add_bending_bounds(body, x, bound)


@generic.edge_conductances.register(Cones)
@njit
def edge_conductances(topology, x, conductance):
    """See `vesdyn.body.edge_conductances`: mean circumference over length; never negative."""
    for e in range(topology.elements.shape[0]):
        a, b = topology.elements[e, 0], topology.elements[e, 1]
        if x[a, 1] <= 0.0 and x[b, 1] <= 0.0:
            conductance[e] = 0.0
            continue
        conductance[e] = np.pi * (x[a, 0] + x[b, 0]) / np.hypot(x[b, 0] - x[a, 0], x[b, 1] - x[a, 1])
    return 0


@njit
def ascent(x, e, step, level):
    """Length and slope dz/ds of segment ``e`` walked in direction ``step``; no length where it is not free."""
    if e < 0 or e >= x.shape[0] - 1 or min(x[e, 1], x[e + 1, 1]) < level:
        return 0.0, 0.0
    length = np.hypot(x[e + 1, 0] - x[e, 0], x[e + 1, 1] - x[e, 1])
    return length, step * (x[e + 1, 1] - x[e, 1]) / length


@generic.set_shares_below.register(Cones)
@njit
def set_shares_below(topology, x, level, share):
    """See `vesdyn.body.set_shares_below`: slope and curvature are those of the next two segments."""
    for e in range(topology.elements.shape[0]):
        i, j, step = e, e + 1, 1
        if x[i, 1] > x[j, 1]:
            i, j, step = j, i, -1
        if x[j, 1] < level or x[i, 1] >= level:
            share[e] = 1.0 if x[j, 1] < level else 0.0
            continue
        length_1, slope = ascent(x, e + step, step, level)
        length_2, slope_2 = ascent(x, e + 2 * step, step, level)
        curvature = 0.0
        if length_2 > 0.0:
            curvature = 2.0 * (slope_2 - slope) / (length_1 + length_2)
            slope -= 0.5 * curvature * length_1
        length = np.hypot(x[j, 0] - x[i, 0], x[j, 1] - x[i, 1])
        share[e] = generic.extended_share(x[i, 1], x[j, 1], length, slope, curvature, level)


@generic.area_below.register(Cones)
@njit
def area_below(topology, x, level, share):
    """See `vesdyn.body.area_below`: a cone cut off at its lower end."""
    total = 0.0
    for e in range(topology.elements.shape[0]):
        a, b = topology.elements[e, 0], topology.elements[e, 1]
        if x[a, 1] > x[b, 1]:
            a, b = b, a
        length = share[e] * np.hypot(x[b, 0] - x[a, 0], x[b, 1] - x[a, 1])
        total += np.pi * length * (2.0 * x[a, 0] + share[e] * (x[b, 0] - x[a, 0]))
    return total


@generic.area_facing_away.register(Cones)
@njit
def area_facing_away(topology, x, level):
    """See `vesdyn.body.area_facing_away`: a segment that runs inwards."""
    total = 0.0
    for e in range(topology.elements.shape[0]):
        a, b = topology.elements[e, 0], topology.elements[e, 1]
        if max(x[a, 1], x[b, 1]) <= level and x[b, 0] < x[a, 0]:
            total += np.pi * (x[a, 0] + x[b, 0]) * np.hypot(x[b, 0] - x[a, 0], x[b, 1] - x[a, 1])
    return total


@generic.element_areas.register(Cones)
def element_areas(topology, x):
    """See `vesdyn.body.element_areas`: those of whole cones."""
    a, b = np.moveaxis(x[topology.elements], 1, 0)
    return np.pi * (a[:, 0] + b[:, 0]) * np.linalg.norm(b - a, axis=1)


@generic.as_triangles.register(Cones)
def as_triangles(topology, x):
    """See `vesdyn.body.as_triangles`: the meridian turned about the axis."""
    return revolved(x, DRAWN_SECTORS)
