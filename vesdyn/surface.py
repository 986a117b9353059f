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
from vesdyn.curvature import Stencils, second_differences
from vesdyn.koiter import bending_energy, bending_moments, bending_stiffness
from vesdyn.meshing import check_mesh
from vesdyn.neo_hookean import (
    principal_tension,
    strain_energy,
    strain_energy_I1,
    strain_energy_J,
    strain_energy_JJ,
)

ASSEMBLY = 0.75  # of the area terms; up to 0.61 is needed on meshes shaken by a fifth of an edge (tests/test_bodies)
BLOCK = 64  # vertices whose bending forces are computed together: few enough for the fastest cache
NO_STENCILS = Stencils(np.zeros(1, np.uint32), np.zeros(0, np.uint32), np.zeros((0, 5)))


class Surface(NamedTuple):
    """A closed, outward-oriented triangle mesh with its stress-free reference."""

    shear_modulus: float  # K [kT/a0^2]
    elements: np.ndarray  # (n_faces, 3) vertices of each triangle
    cotangents: np.ndarray  # (n_faces, 3) half the reference cotangent at each corner
    spring_bound: np.ndarray  # (n_faces,) largest eigenvalue of the Laplacian of those cotangents
    element_area: np.ndarray  # (n_faces,) reference area [a0^2]
    reference_area: np.ndarray  # (n_vertices,) a third of the reference area around each vertex [a0^2]
    edges: np.ndarray  # (n_edges, 2) vertices of each edge
    element_edges: np.ndarray  # (n_faces, 3) the edge facing each corner
    bending_stiffness: float  # B [kT]
    stencils: Stencils  # second differences in the reference; of no vertex where B = 0
    rest_curvature: np.ndarray  # (n_vertices, 3) b_0: 11, 22 and 12 [1/a0]


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
    edges, element_edges = np.unique(
        np.sort(faces[:, [[1, 2], [2, 0], [0, 1]]], axis=2).reshape(-1, 2), axis=0, return_inverse=True
    )
    reference_area = np.bincount(faces.ravel(), np.repeat(area / 3.0, 3), len(vertices))
    stencils = NO_STENCILS
    if thickness > 0.0:
        stencils = second_differences(vertices / prestretch, faces, mesh.vertex_normals, reference_area)
    body = Surface(
        shear_modulus=float(shear_modulus),
        elements=np.ascontiguousarray(faces, dtype=np.uint32),
        cotangents=np.ascontiguousarray(cotangents),
        spring_bound=total + np.sqrt(np.maximum(0.0, total**2 - 0.75)),
        element_area=area,
        reference_area=reference_area,
        edges=np.ascontiguousarray(edges, dtype=np.uint32),
        element_edges=np.ascontiguousarray(element_edges.reshape(-1, 3), dtype=np.uint32),
        bending_stiffness=float(bending_stiffness(shear_modulus, thickness)),
        stencils=stencils,
        rest_curvature=np.zeros((len(stencils.start) - 1, 3)),
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
    for e in range(body.elements.shape[0]):  # serial: the faces of one vertex would race
        a, b, c = body.elements[e, 0], body.elements[e, 1], body.elements[e, 2]
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


@njit
def differences(body, x, i):
    """Tangents g_1, g_2 and second differences h_11, h_22, h_12 [a0 per reference length(s)] at vertex ``i``."""
    stencils, w = body.stencils, body.stencils.weight
    X, Y, Z = x[i, 0], x[i, 1], x[i, 2]
    ux = uy = uz = vx = vy = vz = 0.0
    px = py = pz = qx = qy = qz = rx = ry = rz = 0.0
    for k in range(stencils.start[i], stencils.start[i + 1]):
        j = stencils.neighbour[k]
        dx, dy, dz = x[j, 0] - X, x[j, 1] - Y, x[j, 2] - Z
        C, D, E, F, G = w[k, 0], w[k, 1], w[k, 2], w[k, 3], w[k, 4]
        ux, uy, uz = ux + C * dx, uy + C * dy, uz + C * dz
        vx, vy, vz = vx + D * dx, vy + D * dy, vz + D * dz
        px, py, pz = px + E * dx, py + E * dy, pz + E * dz
        qx, qy, qz = qx + F * dx, qy + F * dy, qz + F * dz
        rx, ry, rz = rx + G * dx, ry + G * dy, rz + G * dz
    return (ux, uy, uz), (vx, vy, vz), (px, py, pz), (qx, qy, qz), (rx, ry, rz)


@njit
def dot(a, b):
    """Scalar product of two vectors of three."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit
def cross(a, b):
    """Vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit
def curvature(body, x, i):
    """Area stretch of the fitted tangent plane at vertex ``i`` and b_11, b_22, b_12 [1/a0]."""
    g1, g2, h11, h22, h12 = differences(body, x, i)
    N = cross(g1, g2)
    J = np.sqrt(dot(N, N))
    return J, dot(N, h11) / J, dot(N, h22) / J, dot(N, h12) / J


@njit
def moments(B, rest, g1, g2, h11, h22, h12):
    """Moments m_11, m_22, 2 m_12 [kT/a0], their components f_1, f_2 along the tangents, the unit normal.

    ``rest`` is b_0; ``B`` times A0 gives the force on neighbour j as -(D_ab^j m_ab - C_a^j f_a) n (`vesdyn.koiter`).
    """
    N = cross(g1, g2)
    per_J = 1.0 / np.sqrt(dot(N, N))
    n = N[0] * per_J, N[1] * per_J, N[2] * per_J
    m11, m22, m12 = bending_moments(B, dot(n, h11) - rest[0], dot(n, h22) - rest[1], dot(n, h12) - rest[2])
    H = (
        m11 * h11[0] + m22 * h22[0] + m12 * h12[0],
        m11 * h11[1] + m22 * h22[1] + m12 * h12[1],
        m11 * h11[2] + m22 * h22[2] + m12 * h12[2],
    )
    H1, H2 = dot(H, g1) * per_J * per_J, dot(H, g2) * per_J * per_J
    G11, G12, G22 = dot(g1, g1), dot(g1, g2), dot(g2, g2)
    return (m11, m22, m12), (G22 * H1 - G12 * H2, G11 * H2 - G12 * H1), n


@njit
def column(table, row, e):
    """Three numbers of column ``e`` from ``row`` on."""
    return table[row, e], table[row + 1, e], table[row + 2, e]


@njit
def set_column(table, row, e, values):
    """Overwrite them."""
    table[row, e], table[row + 1, e], table[row + 2, e] = values


@njit
def add_bending_forces(body, x, nodal):
    """Add the bending forces [kT/a0] to the first three columns of ``nodal``.

    Block by block in three loops, sums, moments, forces: the second, the longest chain of operations but free of
    lookups, is compiled to take several vertices at once.
    """
    stencils, w, rest = body.stencils, body.stencils.weight, body.rest_curvature
    table = np.empty((19, BLOCK))  # one column a vertex
    for first in range(0, rest.shape[0], BLOCK):
        size = min(BLOCK, rest.shape[0] - first)
        for e in range(size):
            i = first + e
            g1, g2, h11, h22, h12 = differences(body, x, i)
            set_column(table, 0, e, g1)
            set_column(table, 3, e, g2)
            set_column(table, 6, e, h11)
            set_column(table, 9, e, h22)
            set_column(table, 12, e, h12)
            set_column(table, 15, e, (rest[i, 0], rest[i, 1], rest[i, 2]))
            table[18, e] = body.bending_stiffness * body.reference_area[i]
        for e in range(size):
            g1, g2, h11 = column(table, 0, e), column(table, 3, e), column(table, 6, e)
            h22, h12, b_0 = column(table, 9, e), column(table, 12, e), column(table, 15, e)
            m, f, n = moments(table[18, e], b_0, g1, g2, h11, h22, h12)
            set_column(table, 0, e, m)
            set_column(table, 3, e, n)
            table[6, e], table[7, e] = f
        for e in range(size):
            i = first + e
            (m11, m22, m12), n, f1, f2 = column(table, 0, e), column(table, 3, e), table[6, e], table[7, e]
            kept = 0.0
            for k in range(stencils.start[i], stencils.start[i + 1]):
                j = stencils.neighbour[k]
                force = w[k, 0] * f1 + w[k, 1] * f2 - w[k, 2] * m11 - w[k, 3] * m22 - w[k, 4] * m12
                kept += force
                nodal[j, 0] += force * n[0]
                nodal[j, 1] += force * n[1]
                nodal[j, 2] += force * n[2]
            nodal[i, 0] -= kept * n[0]
            nodal[i, 1] -= kept * n[1]
            nodal[i, 2] -= kept * n[2]


@njit
def squared_lengths(body, x, e):
    """Squared current edge lengths [a0^2] of face ``e``, each facing its corner, and the area [a0^2]."""
    a, b, c = body.elements[e, 0], body.elements[e, 1], body.elements[e, 2]
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
    la, lb, lc, A = squared_lengths(body, x, e)
    springs = body.cotangents[e, 0] * la + body.cotangents[e, 1] * lb + body.cotangents[e, 2] * lc
    return springs / body.element_area[e], body.element_area[e] / A


@generic.elastic_energy.register(Surface)
@njit
def elastic_energy(body, x):
    """See `vesdyn.body.elastic_energy`."""
    energy = 0.0
    for e in range(body.elements.shape[0]):
        I1, l3 = invariants(body, x, e)
        energy += body.element_area[e] * strain_energy(body.shear_modulus, I1, l3)
    return energy + bending_energy_total(body, x)


@njit
def bending_energy_total(body, x):
    """Bending energy E_b [kT]."""
    energy, rest = 0.0, body.rest_curvature
    for i in range(rest.shape[0]):
        _, b11, b22, b12 = curvature(body, x, i)
        energy += body.reference_area[i] * bending_energy(
            body.bending_stiffness, b11 - rest[i, 0], b22 - rest[i, 1], b12 - rest[i, 2]
        )
    return energy


@generic.principal_tensions.register(Surface)
@njit
def principal_tensions(body, x, tension):
    """See `vesdyn.body.principal_tensions`."""
    for e in range(body.elements.shape[0]):
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
    for e in range(body.elements.shape[0]):
        la, lb, lc, A = squared_lengths(body, x, e)
        A0 = body.element_area[e]
        l3 = A0 / A
        stiffness = 2.0 * strain_energy_I1(K) * body.spring_bound[e] + ASSEMBLY * (
            strain_energy_JJ(K, l3) * 0.25 * (la + lb + lc) / A0
            - strain_energy_J(K, l3) * half_root3
            + 0.5 * abs(pressure) * np.sqrt(max(la, lb, lc))
        )
        for k in range(3):
            bound[body.elements[e, k]] += stiffness
    add_bending_bounds(body, x, bound)


@njit
def add_bending_bounds(body, x, bound):
    """Add to ``bound`` (n_vertices,) [kT/a0^2] what bounds the stiffness of bending.

    With s_ab = D_ab - Gamma_ab^c C_c and c = |C_c g^c| of a node, the second variation of the energy of a vertex
    is A0 (dm_ab s_ab dx . n + 2 m_ab s_ab dx . dn - m_ab b_ab |dn|^2), dm the moments of s dx . n and |dn| <=
    sum c |dx|: every node carries the sum over all of what a pair of them can contribute (Gerschgorin).
    """
    stencils, w, B = body.stencils, body.stencils.weight, body.bending_stiffness
    for i in range(stencils.start.shape[0] - 1):
        g1, g2, h11, h22, h12 = differences(body, x, i)
        (m11, m22, m12), _, n = moments(B, body.rest_curvature[i], g1, g2, h11, h22, h12)
        G11, G12, G22 = dot(g1, g1), dot(g1, g2), dot(g2, g2)
        JJ = G11 * G22 - G12 * G12
        a1, b1 = (G22 * dot(h11, g1) - G12 * dot(h11, g2)) / JJ, (G11 * dot(h11, g2) - G12 * dot(h11, g1)) / JJ
        a2, b2 = (G22 * dot(h22, g1) - G12 * dot(h22, g2)) / JJ, (G11 * dot(h22, g2) - G12 * dot(h22, g1)) / JJ
        a3, b3 = (G22 * dot(h12, g1) - G12 * dot(h12, g2)) / JJ, (G11 * dot(h12, g2) - G12 * dot(h12, g1)) / JJ
        work = abs(m11 * dot(n, h11) + m22 * dot(n, h22) + m12 * dot(n, h12))
        start, count = stencils.start[i], stencils.start[i + 1] - stencils.start[i]
        C, s = np.zeros((count + 1, 2)), np.zeros((count + 1, 3))  # of the neighbours and, last, of vertex i
        for k in range(count):
            C1, C2 = C[k] = w[start + k, 0], w[start + k, 1]
            s[k] = (
                w[start + k, 2] - a1 * C1 - b1 * C2,
                w[start + k, 3] - a2 * C1 - b2 * C2,
                w[start + k, 4] - a3 * C1 - b3 * C2,
            )
            C[count] -= C[k]
            s[count] -= s[k]
        C1, C2 = C[:, 0], C[:, 1]
        c = np.sqrt(np.maximum(0.0, (G22 * C1 * C1 - 2.0 * G12 * C1 * C2 + G11 * C2 * C2) / JJ))
        m = np.abs(m11 * s[:, 0] + m22 * s[:, 1] + m12 * s[:, 2])
        all_c, all_m = np.sum(c), np.sum(m)
        for k in range(count + 1):
            j = stencils.neighbour[start + k] if k < count else i
            dm = bending_moments(B, s[k, 0], s[k, 1], s[k, 2])
            material = 0.0
            for l in range(count + 1):
                material += abs(dot(dm, s[l]))
            bound[j] += body.reference_area[i] * (material + m[k] * all_c + c[k] * all_m + work * c[k] * all_c)


@generic.edge_conductances.register(Surface)
@njit
def edge_conductances(body, x, conductance):
    """See `vesdyn.body.edge_conductances`: half the sum of the two cotangents facing the edge."""
    conductance[:] = 0.0
    for e in range(body.elements.shape[0]):
        a, b, c = body.elements[e, 0], body.elements[e, 1], body.elements[e, 2]
        if x[a, 2] <= 0.0 and x[b, 2] <= 0.0 and x[c, 2] <= 0.0:
            continue
        la, lb, lc, A = squared_lengths(body, x, e)
        conductance[body.element_edges[e, 0]] += (lb + lc - la) / (8.0 * A)
        conductance[body.element_edges[e, 1]] += (lc + la - lb) / (8.0 * A)
        conductance[body.element_edges[e, 2]] += (la + lb - lc) / (8.0 * A)
    clipped = 0
    for i in range(conductance.shape[0]):
        if conductance[i] < 0.0:
            clipped += conductance[i] < -1e-9  # less is the rounding of a right angle
            conductance[i] = 0.0
    return clipped


@generic.set_shares_below.register(Surface)
@njit
def set_shares_below(body, x, level, share):
    """See `vesdyn.body.set_shares_below`.

    The slope of a free vertex is the area mean over its free faces, taken at their common centroid; the
    curvature the change of that slope towards its free neighbours.
    """
    n = x.shape[0]
    ascent, centroid = np.zeros((n, 3)), np.zeros((n, 3))  # surface gradient of the height, where
    weight, spread, bend = np.zeros(n), np.zeros(n), np.zeros(n)
    for e in range(body.elements.shape[0]):
        a, b, c = body.elements[e, 0], body.elements[e, 1], body.elements[e, 2]
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
    for e in range(body.edges.shape[0]):
        for i, j in ((body.edges[e, 0], body.edges[e, 1]), (body.edges[e, 1], body.edges[e, 0])):
            if weight[i] > 0.0 and weight[j] > 0.0 and steep[i] > 0.0:
                ahead = 0.0
                for k in range(3):
                    ahead += (centroid[j, k] - centroid[i, k]) * ascent[i, k] / steep[i]
                spread[i] += ahead * ahead
                bend[i] += ahead * (steep[j] - steep[i])
    for e in range(body.edges.shape[0]):
        i, j = body.edges[e, 0], body.edges[e, 1]
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


@generic.area_below.register(Surface)
@njit
def area_below(body, x, level, share):
    """See `vesdyn.body.area_below`: a corner cut off, or a triangle with a corner missing."""
    total = 0.0
    for e in range(body.elements.shape[0]):
        below = 0
        odd = 0  # the corner that is alone on its side
        for k in range(3):
            below += x[body.elements[e, k], 2] < level
        if below == 0:
            continue
        A = squared_lengths(body, x, e)[3]
        if below == 3:
            total += A
            continue
        for k in range(3):
            if (x[body.elements[e, k], 2] < level) == (below == 1):
                odd = k
        first, second = share[body.element_edges[e, (odd + 1) % 3]], share[body.element_edges[e, (odd + 2) % 3]]
        total += A * first * second if below == 1 else A * (1.0 - (1.0 - first) * (1.0 - second))
    return total
