"""Bending of a triangle mesh: second differences around each vertex, and the forces made of them.

Around vertex i, in the tangent plane of the reference surface, with neighbours j at (u, v)_j:

    x,a  = sum_j C_a^j (x_j - x_i),      x,ab = sum_j D_ab^j (x_j - x_i)

The second fundamental form is b_ab = n . x,ab, and the energy of the vertex A0 W_b (`vesdyn.koiter`). The weights
are quadratic fits that balance constant moments. The least-squares quadratic (weights 1/distance^2) is exact for quadratics but lets a mesh bend too easily: the
forces of a constant moment field, sum_i A_i D_i^j, do not vanish at node j of an irregular mesh, and the minimum
of energy makes use of it. The error does not go away with refinement: 0.4 to 0.6 % of the compliance of a sphere
whose mesh is shaken by 30 % of an edge (tests/verification/test_bending.py). So the fits are moved, within those
exact for quadratics, to those nearest to the first ones whose constant moments balance (BALANCE says how strictly);
one sparse least-squares problem when the mesh is made; 0.05 % or less are left. A hinge of two triangles is not even
exact for quadratics and converges to a stiffness that depends on the mesh.

A shell here is any named tuple with the fields ``bending_stiffness`` B [kT], ``reference_area`` (n_vertices,) [a0^2],
``stencils``, ``rest_curvature`` (n_vertices, 3) b_0 as 11, 22 and 12 [1/a0], and ``scratch``.
"""
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import lsmr

from vesdyn._jit import njit
from vesdyn.koiter import bending_energy, bending_moments

BLOCK = 64  # vertices whose bending forces are computed together: few enough for the fastest cache
ROWS = 19  # numbers that are kept of each of them
BALANCE = 0.3  # weight of the change of the fits against the imbalance of constant moments
_MIXED = np.array([1.0, 1.0, np.sqrt(2.0)])  # a tensor's norm is uu^2 + vv^2 + 2 uv^2, whatever the frame


class Stencils(NamedTuple):
    """Vertex i has the entries ``start[i]`` to ``start[i + 1]`` of the other arrays."""

    start: np.ndarray  # (n_vertices + 1,)
    neighbour: np.ndarray  # (n_entries,) vertices
    weight: np.ndarray  # (n_entries, 5) C_u, C_v [1/a0], D_uu, D_vv, D_uv [1/a0^2]


NO_STENCILS = Stencils(np.zeros(1, np.uint32), np.zeros(0, np.uint32), np.zeros((0, 5)))  # of a pure membrane


class BendingScratch(NamedTuple):
    """Arrays of the kernels below, so that none of them allocates; each overwrites what it uses."""

    table: np.ndarray  # (ROWS * BLOCK,) one number of each vertex of a block after the other
    tangent: np.ndarray  # (largest stencil + 1, 2) C_a of the neighbours of one vertex and, last, of itself [1/a0]
    second: np.ndarray  # (largest stencil + 1, 3) the same for D_ab less the tangential part [1/a0^2]
    turn: np.ndarray  # (largest stencil + 1,) |C_a g^a| [1/a0]
    moment: np.ndarray  # (largest stencil + 1,) |m_ab s_ab| [kT/a0^3]


def bending_scratch(stencils):
    """`BendingScratch` for vertices with these ``stencils``."""
    members = 1 + int(np.diff(stencils.start.astype(np.int64)).max(initial=0))
    return BendingScratch(
        np.zeros(ROWS * BLOCK), np.zeros((members, 2)), np.zeros((members, 3)), np.zeros(members), np.zeros(members)
    )


def second_differences(vertices, faces, normals, area):
    """Fit `Stencils` on the reference ``vertices`` (n, 3) [a0] with unit ``normals`` (n, 3) and nodal ``area`` (n,)."""
    start, neighbour = _rings(faces, len(vertices))
    count = np.diff(start)
    frame = _frames(normals)
    centre = np.repeat(np.arange(len(vertices)), count)
    spoke = vertices[neighbour] - vertices[centre]
    plane = np.einsum("eka,ea->ek", frame[centre], spoke)
    scale = np.repeat(np.bincount(centre, np.linalg.norm(plane, axis=1)) / count, count)
    fit = np.empty((len(neighbour), 5))
    slack = []  # per number of neighbours: vertices, their entries, changes that keep quadratics exact
    for n in np.unique(count):
        at = np.flatnonzero(count == n)
        entries = start[at][:, None] + np.arange(n)
        u, v = np.moveaxis(plane[entries] / scale[entries][..., None], -1, 0)
        weight = 1.0 / (u * u + v * v)
        monomials = np.stack([u, v, 0.5 * u * u, 0.5 * v * v, u * v], axis=-1) * weight[..., None]
        left, singular, right = np.linalg.svd(monomials)
        inverse = np.einsum("eka,ek,enk->ean", right, 1.0 / singular, left[..., :5])
        fit[entries] = np.moveaxis(inverse * weight[:, None, :], 1, 2)
        slack.append((at, entries, left[..., 5:] * weight[..., None] / scale[entries][..., None] ** 2))
    tangent, second = fit[:, :2] / scale[:, None], fit[:, 2:] / scale[:, None] ** 2
    second += _balancing(second, slack, frame, normals, centre, neighbour, area)
    return Stencils(start.astype(np.uint32), neighbour.astype(np.uint32), np.hstack([tangent, second]))


def _rings(faces, n):
    """Neighbours of each vertex as (start, neighbour); those of the neighbours too where there are fewer than five."""
    pairs = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    both = np.concatenate([pairs, pairs[:, ::-1]]).T
    ring = sparse.csr_array((np.ones(both.shape[1]), both), (n, n))
    few = np.diff(ring.indptr) < 5
    ring = sparse.coo_array(ring + sparse.diags_array(few.astype(float)) @ ring @ ring)
    others = ring.row != ring.col
    ring = sparse.csr_array((ring.data[others], (ring.row[others], ring.col[others])), (n, n))
    return ring.indptr.astype(np.int64), ring.indices


def _frames(normals):
    """Two orthonormal tangents (n, 2, 3) for each of the ``normals``."""
    helper = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    first = np.cross(normals, helper)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([first, np.cross(normals, first)], axis=1)


def _balancing(second, slack, frame, normals, centre, neighbour, area):
    """Change (n_entries, 3) of the second differences after which constant moments (nearly) balance.

    "Constant" on a curved surface: carried from vertex to neighbour by the smallest rotation.
    """
    n, m = len(frame), len(centre)
    # the tensor of vertex i in the frame of its neighbour j: rotation Q (2, 2), tensor components (3, 3)
    a, b = normals[centre], normals[neighbour]
    half = a + b
    half /= np.linalg.norm(half, axis=1)[:, None]
    turned = frame[centre]
    turned = turned - 2.0 * np.einsum("eka,ea->ek", turned, half)[..., None] * half[:, None]  # two reflections
    turned = turned - 2.0 * np.einsum("eka,ea->ek", turned, b)[..., None] * b[:, None]
    Q = np.einsum("eka,ela->ekl", frame[neighbour], turned)
    (c, s), (p, q) = np.moveaxis(Q[:, 0], -1, 0), np.moveaxis(Q[:, 1], -1, 0)
    # second derivatives x,uu, x,vv, x,uv in the neighbour's frame
    turn = np.stack(
        [
            np.stack([c * c, s * s, 2 * c * s], -1),
            np.stack([p * p, q * q, 2 * p * q], -1),
            np.stack([c * p, s * q, c * q + s * p], -1),
        ],
        axis=1,
    )
    # imbalance at node j: what its neighbours' moments bring, less what its own stencil keeps
    rows = np.concatenate([3 * neighbour[:, None, None] + np.arange(3)[:, None] + np.zeros((m, 3, 3), int),
                           3 * centre[:, None, None] + np.arange(3)[:, None] + np.zeros((m, 3, 3), int)])
    columns = 3 * np.arange(m)[:, None, None] + np.arange(3)[None, None, :] + np.zeros((m, 3, 3), int)
    own = -np.broadcast_to(np.eye(3), (m, 3, 3)) * area[centre][:, None, None]
    values = np.concatenate([turn * area[centre][:, None, None], own]) * _MIXED[:, None]
    collect = sparse.csr_array(
        (values.ravel(), (rows.ravel(), np.concatenate([columns, columns]).ravel())), (3 * n, 3 * m)
    )
    rows, columns, values, used = [], [], [], 0
    for at, entries, changes in slack:
        free = changes.shape[-1]
        for k in range(3):
            column = used + np.arange(len(at) * free).reshape(len(at), 1, free)
            rows.append(np.broadcast_to(3 * entries[..., None] + k, changes.shape).ravel())
            columns.append(np.broadcast_to(column, changes.shape).ravel())
            values.append(changes.ravel() / _MIXED[k])
            used += len(at) * free
    span = sparse.csr_array(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), (3 * m, used)
    )
    amount = lsmr(collect @ span, -(collect @ second.ravel()), damp=BALANCE, atol=1e-13, btol=1e-13, maxiter=1000)[0]
    return (span @ amount).reshape(m, 3)


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
    """Three numbers of vertex ``e`` of the block, from ``row`` of the table on."""
    at = row * BLOCK + e
    return table[at], table[at + BLOCK], table[at + 2 * BLOCK]


@njit
def set_column(table, row, e, values):
    """Overwrite the three numbers that `column` returns."""
    at = row * BLOCK + e
    table[at], table[at + BLOCK], table[at + 2 * BLOCK] = values


@njit
def add_bending_forces(body, x, nodal):
    """Add the bending forces [kT/a0] to the first three columns of ``nodal``.

    Block by block in three loops, sums, moments, forces: the second, the longest chain of operations but free of
    lookups, is compiled to take several vertices at once: it sees one array, and the distance of its rows.
    """
    stencils, w, rest, table = body.stencils, body.stencils.weight, body.rest_curvature, body.scratch.table
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
            table[18 * BLOCK + e] = body.bending_stiffness * body.reference_area[i]
        for e in range(size):
            g1, g2, h11 = column(table, 0, e), column(table, 3, e), column(table, 6, e)
            h22, h12, b_0 = column(table, 9, e), column(table, 12, e), column(table, 15, e)
            m, f, n = moments(table[18 * BLOCK + e], b_0, g1, g2, h11, h22, h12)
            set_column(table, 0, e, m)
            set_column(table, 3, e, n)
            table[6 * BLOCK + e], table[7 * BLOCK + e] = f
        for e in range(size):
            i = first + e
            (m11, m22, m12), n = column(table, 0, e), column(table, 3, e)
            f1, f2 = table[6 * BLOCK + e], table[7 * BLOCK + e]
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
def bending_energy_total(body, x):
    """Bending energy E_b [kT]."""
    energy, rest = 0.0, body.rest_curvature
    for i in range(rest.shape[0]):
        _, b11, b22, b12 = curvature(body, x, i)
        energy += body.reference_area[i] * bending_energy(
            body.bending_stiffness, b11 - rest[i, 0], b22 - rest[i, 1], b12 - rest[i, 2]
        )
    return energy


@njit
def add_bending_bounds(body, x, bound):
    """Add to ``bound`` (n_vertices,) [kT/a0^2] what bounds the stiffness of bending.

    With s_ab = D_ab - Gamma_ab^c C_c and c = |C_c g^c| of a node, the second variation of the energy of a vertex
    is A0 (dm_ab s_ab dx . n + 2 m_ab s_ab dx . dn - m_ab b_ab |dn|^2), dm the moments of s dx . n and |dn| <=
    sum c |dx|: every node carries the sum over all of what a pair of them can contribute (Gerschgorin).
    """
    stencils, w, B = body.stencils, body.stencils.weight, body.bending_stiffness
    C, s, c, m = body.scratch.tangent, body.scratch.second, body.scratch.turn, body.scratch.moment
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
        for a in range(2):
            C[count, a] = 0.0
        for a in range(3):
            s[count, a] = 0.0
        for k in range(count):  # the neighbours and, last, vertex i
            C1, C2 = w[start + k, 0], w[start + k, 1]
            C[k, 0], C[k, 1] = C1, C2
            s[k, 0] = w[start + k, 2] - a1 * C1 - b1 * C2
            s[k, 1] = w[start + k, 3] - a2 * C1 - b2 * C2
            s[k, 2] = w[start + k, 4] - a3 * C1 - b3 * C2
            for a in range(2):
                C[count, a] -= C[k, a]
            for a in range(3):
                s[count, a] -= s[k, a]
        all_c = all_m = 0.0
        for k in range(count + 1):
            C1, C2 = C[k, 0], C[k, 1]
            c[k] = np.sqrt(max(0.0, (G22 * C1 * C1 - 2.0 * G12 * C1 * C2 + G11 * C2 * C2) / JJ))
            m[k] = abs(m11 * s[k, 0] + m22 * s[k, 1] + m12 * s[k, 2])
            all_c += c[k]
            all_m += m[k]
        for k in range(count + 1):
            j = stencils.neighbour[start + k] if k < count else i
            dm = bending_moments(B, s[k, 0], s[k, 1], s[k, 2])
            material = 0.0
            for l in range(count + 1):
                material += abs(dot(dm, s[l]))
            bound[j] += body.reference_area[i] * (material + m[k] * all_c + c[k] * all_m + work * c[k] * all_c)
