"""Triangulated shell: mesh, forces, volume, areas, edge conductances.

Constant-strain triangles. With cot_k the reference cotangent at corner k, l_k the current length of the
edge facing it, A0 and A the reference and current areas, the invariants of C are exactly

    A0 I1 = 1/2 sum_k cot_k l_k^2,        J = A / A0,

so the membrane energy A0 W(I1, J) and its gradient need edge vectors and one vector area S only. The
same S gives the enclosed volume V = 1/3 sum x_a . S and its gradient (divergence theorem on flat
faces). Second order in the edge length.
"""
from typing import NamedTuple

import numpy as np
import trimesh

from vesdyn import body as generic
from vesdyn._jit import njit
from vesdyn.curvature import (
    NO_STENCILS,
    BendingScratch,
    Stencils,
    add_bending_bounds,
    add_bending_forces,
    bending_energy_total,
    bending_scratch,
    curvature,
    second_differences,
)
from vesdyn.koiter import bending_stiffness
from vesdyn.meshing import check_memory, check_mesh, expected_nodes, graded_sphere, read_mesh
from vesdyn.neo_hookean import (
    principal_tension,
    strain_energy,
    strain_energy_I1,
    strain_energy_J,
    strain_energy_JJ,
)

CORNERS, XDMF, KEEPS_AXIS = 3, ("Triangle", "XYZ"), False
LONGEST_EDGE = 0.03  # [a0]; the errors below were measured on shorter ones
TOP_EDGE, TOP_TO_FRONT = 0.05, 3.0  # the edge at the top is not shorter than this [a0], nor than so many front edges
MESH_ERROR = {  # by layout and whether there is bending; the paper's cases (d_c 0.06 to 0.18), front edges 0.0125 to 0.03
    ("scalloped", False): generic.MeshError(0.4, 1.5),
    ("scalloped", True): generic.MeshError(1.0, 1.5),
    ("rings", False): generic.MeshError(1.0, 1.5),
    ("rings", True): generic.MeshError(1.6, 1.5),
    ("spiral", False): generic.MeshError(1.0, 1.5),
    ("spiral", True): generic.MeshError(1.6, 1.5),
}
BYTES = 11000.0  # a vertex, while the stencils of bending are balanced
STEP_TIME = 0.05, 8000, 1.8  # [s] of a coupling step at so many vertices, over a whole run of the typical case; the exponent
ASSEMBLY = 0.75  # of the area terms; up to 0.61 is needed on meshes shaken by a fifth of an edge (tests/test_bodies)
PAIRED_COTANGENTS = 0.25  # w_a w_b + w_b w_c + w_c w_a of half the cotangents w of any triangle


class Triangles(NamedTuple):
    """Topology of a closed, outward-oriented triangle mesh."""

    elements: np.ndarray  # (n_faces, 3) vertices of each triangle
    edges: np.ndarray  # (n_edges, 2) vertices of each edge
    element_edges: np.ndarray  # (n_faces, 3) the edge facing each corner


def topology(faces):
    """`Triangles` of the outward ``faces`` (n_faces, 3), which are not checked."""
    faces = np.asarray(faces)
    edges, element_edges = np.unique(
        np.sort(faces[:, [[1, 2], [2, 0], [0, 1]]], axis=2).reshape(-1, 2), axis=0, return_inverse=True
    )
    return Triangles(
        elements=np.ascontiguousarray(faces, dtype=np.uint32),
        edges=np.ascontiguousarray(edges, dtype=np.uint32),
        element_edges=np.ascontiguousarray(element_edges.reshape(-1, 3), dtype=np.uint32),
    )


class Surface(NamedTuple):
    """A triangle mesh with its stress-free reference and its material."""

    topology: Triangles
    shear_modulus: float  # K [kT/a0^2]
    cotangents: np.ndarray  # (n_faces, 3) half the reference cotangent at each corner
    spring_bound: np.ndarray  # (n_faces,) largest eigenvalue of the Laplacian of those cotangents
    element_area: np.ndarray  # (n_faces,) reference area [a0^2]
    reference_area: np.ndarray  # (n_vertices,) a third of the reference area around each vertex [a0^2]
    bending_stiffness: float  # B [kT]
    stencils: Stencils  # second differences in the reference; of no vertex where B = 0
    rest_curvature: np.ndarray  # (n_vertices, 3) b_0: 11, 22 and 12 [1/a0]
    scratch: BendingScratch  # that the bending kernels overwrite

    elements = property(lambda self: self.topology.elements)
    edges = property(lambda self: self.topology.edges)


def start(mesh, membrane):
    """Start positions (n_vertices, 3) [a0] and `Surface` of the sections ``mesh`` and ``membrane`` of a case.

    Raises CaseError where the mesh is larger than this machine holds, or is a file that cannot be used.
    """
    if mesh.file is None:
        check_memory(mesh_size(mesh).nodes, BYTES)
        x, faces = graded_sphere(
            mesh.front_edge, mesh.far_edge, mesh.layout, mesh.axes, fine_angle=np.radians(mesh.fine_angle)
        )
    else:
        x, faces = read_mesh(mesh.file, digest=mesh.sha256)
        check_memory(len(x), BYTES)
    return x, build_surface(x, faces, membrane.shear_modulus, membrane.prestretch, membrane.thickness)


def mesh_error(mesh, bending):
    """`vesdyn.body.MeshError` of a surface with ``bending`` or without; a mesh from a file counts as a spiral."""
    return MESH_ERROR["spiral" if mesh.file else mesh.layout, bending]


def far_edge(front_edge):
    """Edge length [a0] far above the substrate that goes with ``front_edge``."""
    return max(TOP_EDGE, TOP_TO_FRONT * front_edge)


def mesh_size(mesh):
    """`vesdyn.body.MeshSize` of the section ``mesh`` of a case; CaseError for a file that cannot be used."""
    if mesh.file is None:
        nodes = expected_nodes(mesh.front_edge, mesh.far_edge, mesh.axes, np.radians(mesh.fine_angle))[1]
    else:
        nodes = float(len(read_mesh(mesh.file, digest=mesh.sha256)[0]))
    seconds, at, exponent = STEP_TIME
    return generic.MeshSize(nodes, BYTES * nodes, seconds * (nodes / at) ** exponent)


def build_surface(vertices, faces, shear_modulus, prestretch=1.0, thickness=0.0):
    """Make a `Surface` whose start state ``vertices`` is stretched by ``prestretch`` against its reference.

    ``vertices`` (n_vertices, 3) [a0], ``faces`` (n_faces, 3) outward. The start state is free of moments, a
    shell of ``thickness`` h [a0]. Raises ValueError for a mesh that is not one closed, outward-oriented manifold.
    """
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    check_mesh(mesh)
    cotangents = 0.5 / np.tan(mesh.face_angles)
    total = cotangents.sum(axis=1)
    area = mesh.area_faces / prestretch**2
    reference_area = np.bincount(faces.ravel(), np.repeat(area / 3.0, 3), len(vertices))
    stencils = NO_STENCILS
    if thickness > 0.0:
        stencils = second_differences(vertices / prestretch, faces, mesh.vertex_normals, reference_area)
    body = Surface(
        topology=topology(faces),
        shear_modulus=float(shear_modulus),
        cotangents=np.ascontiguousarray(cotangents),
        spring_bound=total + np.sqrt(np.maximum(0.0, total**2 - 3.0 * PAIRED_COTANGENTS)),
        element_area=area,
        reference_area=reference_area,
        bending_stiffness=float(bending_stiffness(shear_modulus, thickness)),
        stencils=stencils,
        rest_curvature=np.zeros((len(stencils.start) - 1, 3)),
        scratch=bending_scratch(stencils),
    )
    for i in range(len(body.rest_curvature)):
        body.rest_curvature[i] = curvature(body, vertices, i)[1:]
    return body


@generic.dimension.register(Surface)
@njit
def dimension(body):
    """See `vesdyn.body.dimension`."""
    return 3


@generic.add_elastic_forces.register(Surface)
@njit
def add_elastic_forces(body, x, nodal):
    """See `vesdyn.body.add_elastic_forces`."""
    K = body.shear_modulus
    w = 2.0 * strain_energy_I1(K)
    volume = 0.0
    elements = body.topology.elements
    for e in range(elements.shape[0]):  # serial: the faces of one vertex would race
        a, b, c = elements[e, 0], elements[e, 1], elements[e, 2]
        ax, ay, az = x[a, 0], x[a, 1], x[a, 2]
        ux, uy, uz = x[b, 0] - ax, x[b, 1] - ay, x[b, 2] - az
        vx, vy, vz = x[c, 0] - ax, x[c, 1] - ay, x[c, 2] - az
        Sx, Sy, Sz = 0.5 * (uy * vz - uz * vy), 0.5 * (uz * vx - ux * vz), 0.5 * (ux * vy - uy * vx)
        A = np.sqrt(Sx * Sx + Sy * Sy + Sz * Sz)
        per_A = 1.0 / A
        # dA/dx_b = v x n / 2, dA/dx_c = n x u / 2, and dA/dx_a balances them
        g = 0.5 * per_A * strain_energy_J(K, per_A * body.element_area[e])
        wa, wb, wc = w * body.cotangents[e, 0], w * body.cotangents[e, 1], w * body.cotangents[e, 2]
        bx = wa * (vx - ux) - wc * ux - g * (vy * Sz - vz * Sy)
        by = wa * (vy - uy) - wc * uy - g * (vz * Sx - vx * Sz)
        bz = wa * (vz - uz) - wc * uz - g * (vx * Sy - vy * Sx)
        cx = wa * (ux - vx) - wb * vx - g * (Sy * uz - Sz * uy)
        cy = wa * (uy - vy) - wb * vy - g * (Sz * ux - Sx * uz)
        cz = wa * (uz - vz) - wb * vz - g * (Sx * uy - Sy * ux)
        volume += ax * Sx + ay * Sy + az * Sz
        A, Sx, Sy, Sz = A / 3.0, Sx / 3.0, Sy / 3.0, Sz / 3.0
        nodal[a, 0] -= bx + cx
        nodal[a, 1] -= by + cy
        nodal[a, 2] -= bz + cz
        nodal[a, 3] += Sx
        nodal[a, 4] += Sy
        nodal[a, 5] += Sz
        nodal[a, 6] += A
        nodal[b, 0] += bx
        nodal[b, 1] += by
        nodal[b, 2] += bz
        nodal[b, 3] += Sx
        nodal[b, 4] += Sy
        nodal[b, 5] += Sz
        nodal[b, 6] += A
        nodal[c, 0] += cx
        nodal[c, 1] += cy
        nodal[c, 2] += cz
        nodal[c, 3] += Sx
        nodal[c, 4] += Sy
        nodal[c, 5] += Sz
        nodal[c, 6] += A
    if body.bending_stiffness > 0.0:
        add_bending_forces(body, x, nodal)
    return volume / 3.0


@generic.neighbours.register(Surface)
def neighbours(body):
    """See `vesdyn.body.neighbours`: the corners of a triangle, and with bending all vertices of a stencil."""
    elements, start = body.topology.elements.astype(int), body.stencils.start.astype(int)
    corners, vertices = np.repeat(np.arange(len(elements)), 3), np.arange(len(start) - 1)
    stencils = np.concatenate([vertices, np.repeat(vertices, np.diff(start))])
    return generic.sharing(
        np.concatenate([corners, len(elements) + stencils]),
        np.concatenate([elements.ravel(), vertices, body.stencils.neighbour.astype(int)]),
        len(body.reference_area),
    )


@njit
def squared_lengths(topology, x, e):
    """Squared current edge lengths [a0^2] of face ``e``, each facing its corner, and the area [a0^2]."""
    elements = topology.elements
    a, b, c = elements[e, 0], elements[e, 1], elements[e, 2]
    la = lb = lc = 0.0
    for k in range(3):
        la += (x[c, k] - x[b, k]) ** 2
        lb += (x[a, k] - x[c, k]) ** 2
        lc += (x[b, k] - x[a, k]) ** 2
    # 16 A^2 = 2 (la lb + lb lc + lc la) - la^2 - lb^2 - lc^2 (Heron)
    return la, lb, lc, 0.25 * np.sqrt(max(0.0, 4.0 * la * lb - (la + lb - lc) ** 2))


@njit
def invariants(body, x, e):
    """I1 = tr C and l3 = 1/J of face ``e``."""
    la, lb, lc, A = squared_lengths(body.topology, x, e)
    springs = body.cotangents[e, 0] * la + body.cotangents[e, 1] * lb + body.cotangents[e, 2] * lc
    return springs / body.element_area[e], body.element_area[e] / A


@generic.elastic_energy.register(Surface)
@njit
def elastic_energy(body, x):
    """See `vesdyn.body.elastic_energy`."""
    energy = 0.0
    for e in range(body.topology.elements.shape[0]):
        I1, l3 = invariants(body, x, e)
        energy += body.element_area[e] * strain_energy(body.shear_modulus, I1, l3)
    return energy + bending_energy_total(body, x)


@generic.principal_tensions.register(Surface)
@njit
def principal_tensions(body, x, tension):
    """See `vesdyn.body.principal_tensions`."""
    for e in range(body.topology.elements.shape[0]):
        I1, l3 = invariants(body, x, e)
        spread = np.sqrt(max(0.0, 0.25 * I1 * I1 - 1.0 / (l3 * l3)))
        larger, smaller = np.sqrt(0.5 * I1 + spread), np.sqrt(max(0.0, 0.5 * I1 - spread))
        tension[e, 0] = principal_tension(body.shear_modulus, larger, l3)
        tension[e, 1] = principal_tension(body.shear_modulus, smaller, l3)


@generic.add_stiffness_bounds.register(Surface)
@njit
def add_stiffness_bounds(body, x, pressure, bound):
    """See `vesdyn.body.add_stiffness_bounds`.

    Element by element, with |dA/dx|^2 = sum l^2 / 4 and 3^(1/2)/2 the largest curvature of the area of a
    triangle in its plane: K_e <= 2 W_I1 mu + W_JJ |dA/dx|^2 / A0 + |W_J| 3^(1/2)/2, mu the largest
    eigenvalue of the cotangent Laplacian; the pressure adds |p| times half the longest edge. The faces
    around a vertex share the stiffest mode of the springs but not that of the areas, hence ASSEMBLY.
    """
    K = body.shear_modulus
    half_root3 = 0.8660254037844386
    elements = body.topology.elements
    for e in range(elements.shape[0]):
        la, lb, lc, A = squared_lengths(body.topology, x, e)
        A0 = body.element_area[e]
        l3 = A0 / A
        stiffness = 2.0 * strain_energy_I1(K) * body.spring_bound[e] + ASSEMBLY * (
            strain_energy_JJ(K, l3) * 0.25 * (la + lb + lc) / A0
            - strain_energy_J(K, l3) * half_root3
            + 0.5 * abs(pressure) * np.sqrt(max(la, lb, lc))
        )
        for k in range(3):
            bound[elements[e, k]] += stiffness
    add_bending_bounds(body, x, bound)


@generic.edge_conductances.register(Triangles)
@njit
def edge_conductances(topology, x, conductance):
    """See `vesdyn.body.edge_conductances`: half the sum of the two cotangents facing the edge."""
    conductance[:] = 0.0
    for e in range(topology.elements.shape[0]):
        a, b, c = topology.elements[e, 0], topology.elements[e, 1], topology.elements[e, 2]
        if x[a, 2] <= 0.0 and x[b, 2] <= 0.0 and x[c, 2] <= 0.0:
            continue
        la, lb, lc, A = squared_lengths(topology, x, e)
        conductance[topology.element_edges[e, 0]] += (lb + lc - la) / (8.0 * A)
        conductance[topology.element_edges[e, 1]] += (lc + la - lb) / (8.0 * A)
        conductance[topology.element_edges[e, 2]] += (la + lb - lc) / (8.0 * A)
    clipped = 0
    for i in range(conductance.shape[0]):
        if conductance[i] < 0.0:
            clipped += conductance[i] < -1e-9  # less is the rounding of a right angle
            conductance[i] = 0.0
    return clipped


@generic.set_shares_below.register(Triangles)
@njit
def set_shares_below(topology, x, level, share):
    """See `vesdyn.body.set_shares_below`.

    The slope of a free vertex is the area mean over its free faces, taken at their common centroid; the
    curvature the change of that slope towards its free neighbours.
    """
    n = x.shape[0]
    ascent, centroid = np.zeros((n, 3)), np.zeros((n, 3))  # surface gradient of the height, where
    weight, spread, bend = np.zeros(n), np.zeros(n), np.zeros(n)
    for e in range(topology.elements.shape[0]):
        a, b, c = topology.elements[e, 0], topology.elements[e, 1], topology.elements[e, 2]
        if min(x[a, 2], x[b, 2], x[c, 2]) < level:
            continue
        S = vector_area(x, a, b, c)
        A = np.sqrt(S[0] * S[0] + S[1] * S[1] + S[2] * S[2])
        for i in (a, b, c):
            weight[i] += A
            ascent[i, 2] += A
            for k in range(3):
                ascent[i, k] -= S[2] / A * S[k]
                centroid[i, k] += A / 3.0 * (x[a, k] + x[b, k] + x[c, k])
    for i in range(n):
        if weight[i] > 0.0:
            ascent[i] /= weight[i]
            centroid[i] /= weight[i]
    steep = np.sqrt(ascent[:, 0] ** 2 + ascent[:, 1] ** 2 + ascent[:, 2] ** 2)
    for e in range(topology.edges.shape[0]):
        for i, j in ((topology.edges[e, 0], topology.edges[e, 1]), (topology.edges[e, 1], topology.edges[e, 0])):
            if weight[i] > 0.0 and weight[j] > 0.0 and steep[i] > 0.0:
                ahead = 0.0
                for k in range(3):
                    ahead += (centroid[j, k] - centroid[i, k]) * ascent[i, k] / steep[i]
                spread[i] += ahead * ahead
                bend[i] += ahead * (steep[j] - steep[i])
    for e in range(topology.edges.shape[0]):
        i, j = topology.edges[e, 0], topology.edges[e, 1]
        if x[i, 2] > x[j, 2]:
            i, j = j, i
        if x[j, 2] < level or x[i, 2] >= level:
            share[e] = 1.0 if x[j, 2] < level else 0.0
            continue
        slope = curvature = 0.0
        dx, dy, dz = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
        plan = np.hypot(dx, dy) * np.hypot(ascent[j, 0], ascent[j, 1])
        if plan > 0.0 and spread[j] > 0.0:
            along = (dx * ascent[j, 0] + dy * ascent[j, 1]) / plan  # cosine between edge and ascent, seen from above
            beyond = 0.0
            for k in range(3):
                beyond += (centroid[j, k] - x[j, k]) * ascent[j, k] / steep[j]
            curvature = bend[j] / spread[j] * along * along
            slope = (steep[j] - bend[j] / spread[j] * beyond) * along
        length = np.sqrt(dx * dx + dy * dy + dz * dz)
        share[e] = generic.extended_share(x[i, 2], x[j, 2], length, slope, curvature, level)


@njit
def vector_area(x, a, b, c):
    """Area [a0^2] times outward normal of the triangle ``a, b, c``."""
    ux, uy, uz = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
    vx, vy, vz = x[c, 0] - x[a, 0], x[c, 1] - x[a, 1], x[c, 2] - x[a, 2]
    return 0.5 * (uy * vz - uz * vy), 0.5 * (uz * vx - ux * vz), 0.5 * (ux * vy - uy * vx)


@generic.area_below.register(Triangles)
@njit
def area_below(topology, x, level, share):
    """See `vesdyn.body.area_below`: a corner cut off, or a triangle with a corner missing."""
    total = 0.0
    for e in range(topology.elements.shape[0]):
        below = 0
        odd = 0  # the corner that is alone on its side
        for k in range(3):
            below += x[topology.elements[e, k], 2] < level
        if below == 0:
            continue
        A = squared_lengths(topology, x, e)[3]
        if below == 3:
            total += A
            continue
        for k in range(3):
            if (x[topology.elements[e, k], 2] < level) == (below == 1):
                odd = k
        first, second = share[topology.element_edges[e, (odd + 1) % 3]], share[topology.element_edges[e, (odd + 2) % 3]]
        total += A * first * second if below == 1 else A * (1.0 - (1.0 - first) * (1.0 - second))
    return total


@generic.area_facing_away.register(Triangles)
@njit
def area_facing_away(topology, x, level):
    """See `vesdyn.body.area_facing_away`."""
    total = 0.0
    for e in range(topology.elements.shape[0]):
        a, b, c = topology.elements[e, 0], topology.elements[e, 1], topology.elements[e, 2]
        if max(x[a, 2], x[b, 2], x[c, 2]) <= level:
            S = vector_area(x, a, b, c)
            if S[2] > 0.0:
                total += np.sqrt(S[0] * S[0] + S[1] * S[1] + S[2] * S[2])
    return total


@generic.element_areas.register(Triangles)
def element_areas(topology, x):
    """See `vesdyn.body.element_areas`."""
    a, b, c = np.moveaxis(x[topology.elements], 1, 0)
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


@generic.as_triangles.register(Triangles)
def as_triangles(topology, x):
    """See `vesdyn.body.as_triangles`: the triangles themselves."""
    return x, topology.elements, np.arange(len(x))
