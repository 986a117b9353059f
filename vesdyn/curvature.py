"""Second differences on a triangle mesh: quadratic fits around each vertex that balance constant moments.

Around vertex i, in the tangent plane of the reference surface, with neighbours j at (u, v)_j:

    x,a  = sum_j C_a^j (x_j - x_i),      x,ab = sum_j D_ab^j (x_j - x_i)

The least-squares quadratic (weights 1/distance^2) is exact for quadratics but lets a mesh bend too easily: the
forces of a constant moment field, sum_i A_i D_i^j, do not vanish at node j of an irregular mesh, and the minimum
of energy makes use of it. The error does not go away with refinement: 0.4 to 0.6 % of the compliance of a sphere
whose mesh is shaken by 30 % of an edge (tests/verification/test_bending.py). So the fits are moved, within those
exact for quadratics, to those nearest to the first ones whose constant moments balance (BALANCE says how strictly);
one sparse least-squares problem when the mesh is made; 0.05 % or less are left. A hinge of two triangles is not even
exact for quadratics and converges to a stiffness that depends on the mesh.
"""
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import lsmr

BALANCE = 0.3  # weight of the change of the fits against the imbalance of constant moments
_MIXED = np.array([1.0, 1.0, np.sqrt(2.0)])  # a tensor's norm is uu^2 + vv^2 + 2 uv^2, whatever the frame


class Stencils(NamedTuple):
    """Vertex i has the entries ``start[i]`` to ``start[i + 1]`` of the other arrays."""

    start: np.ndarray  # (n_vertices + 1,)
    neighbour: np.ndarray  # (n_entries,) vertices
    weight: np.ndarray  # (n_entries, 5) C_u, C_v [1/a0], D_uu, D_vv, D_uv [1/a0^2]


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
