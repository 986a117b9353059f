"""Contact front: the contour on which the membrane leaves the plane, and the shape it has there.

The front is cut out of the edges: every edge with one node below the level and one above gives a point.
Nothing there knows what an element is, so the same functions serve a meridian and a triangle mesh.

Where the membrane leaves the plane it turns within a few hundredths of a0, and then rises almost straight through the
range d_c of the traction. So, on a meridian,

    spreading angle      between substrate and membrane, at the height ANGLE_AT d_c;
    radius of curvature  arc / angle turned, between the heights ARC[0] d_c and ARC[1] d_c.
"""

from typing import NamedTuple

import numpy as np

from vesdyn.substrate import gaps, in_plane, touches

ARC = 0.02, 0.2  # heights / d_c between which the membrane turns; at the first it counts as bound
ANGLE_AT = 0.5  # height / d_c of the spreading angle
ANGLES_AT = 0.25, 1.0  # heights / d_c at which it is compared
_ROUND_OFF = 1e-12  # of heights [a0]

BINDING_GAP = 0.02  # of the cutoff: membrane closer than this counts as bound


def front_points(x, edges, share):
    """Horizontal coordinates (n_points, d - 1) [a0] where ``edges`` are cut at ``share`` of their length.

    ``share`` (n_edges,) counts from the lower end (`vesdyn.body.set_shares_below`).
    """
    cut = (share > 0.0) & (share < 1.0)
    a, b = x[edges[cut, 0]], x[edges[cut, 1]]
    rising = (gaps(a) <= gaps(b))[:, None]
    low, high = np.where(rising, a, b), np.where(rising, b, a)
    return in_plane(low + share[cut, None] * (high - low))


def front_radius(x, edges, share, n_angles=360):
    """Radius (n_angles,) [a0] of the front about its own centre at equal angles; empty before contact.

    The outer rim: where the centre has lifted off, points within half the largest radius are the inner one's. An
    axisymmetric body has one radius, its outermost.
    """
    points = front_points(x, edges, share)
    if len(points) == 0:
        return np.zeros(0)
    if points.shape[1] == 1:
        return points.max(axis=0)
    points = points - points.mean(axis=0)
    distance = np.hypot(*points.T)
    points = points[distance >= 0.5 * distance.max()]
    angle = np.arctan2(points[:, 1], points[:, 0])
    order = np.argsort(angle)
    radius = np.hypot(points[order, 0], points[order, 1])
    at = np.linspace(-np.pi, np.pi, n_angles, endpoint=False)
    return np.interp(at, angle[order], radius, period=2.0 * np.pi)


def contact_radius(x, edges, share):
    """Mean radius [a0] of the front cut by ``share``; 0 before contact."""
    radius = front_radius(x, edges, share)
    return float(radius.mean()) if len(radius) else 0.0


def displace_front(x, edges, largest, rng):
    """Positions (n_nodes, 3) [a0] with the rim of the contact displaced at random, each node by itself.

    A node on the plane with an edge to one above it moves along its radius about the axis, in the plane, by a
    share of that radius uniform in +- ``largest``, but at most by a third of its shortest edge, so that no
    triangle turns over.
    """
    a, b = edges.T
    landed = touches(gaps(x))
    rim = np.zeros(len(x), dtype=bool)
    rim[a[landed[a] & ~landed[b]]] = rim[b[landed[b] & ~landed[a]]] = True
    shortest, length = np.full(len(x), np.inf), np.linalg.norm(x[a] - x[b], axis=1)
    np.minimum.at(shortest, a, length)
    np.minimum.at(shortest, b, length)
    radius = np.hypot(*in_plane(x)[rim].T)
    share = rng.uniform(-largest, largest, len(radius))
    most = np.divide(shortest[rim] / 3.0, radius, out=np.zeros_like(radius), where=radius > 0.0)
    displaced = x.copy()
    in_plane(displaced)[rim] *= 1.0 + np.clip(share, -most, most)[:, None]
    return displaced


# Shape of the membrane at the front ----------------------------------------------------------------------


class FrontShape(NamedTuple):
    """How the membrane leaves the plane."""

    radius_of_curvature: float  # [a0]
    spreading_angle: float  # [rad]
    lower_angle: float  # [rad] at the heights ANGLES_AT
    upper_angle: float


def front_shape(x, cutoff):
    """`FrontShape` of a meridian ``x`` (n_nodes, 2) [a0] under a traction of range ``cutoff`` [a0]."""
    z, angle, arc = _lower_side(x)
    (low, high), (start, end) = (np.interp(np.multiply(ARC, cutoff), z, values) for values in (angle, arc))
    angles = np.interp(np.multiply((ANGLE_AT, *ANGLES_AT), cutoff), z, angle)
    return FrontShape((end - start) / (high - low), *map(float, angles))


def _lower_side(x):
    """Height, tangent angle and arc length, rising from the plane to the widest place, of a meridian ``x``."""
    r, z = in_plane(x)[:, 0], gaps(x)
    last_down = np.flatnonzero(z <= z.min() + _ROUND_OFF)[-1]
    widest = np.argmax(r)
    r, z = r[last_down : widest + 1], z[last_down : widest + 1]
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(r), np.diff(z)))])
    angle = np.interp(arc, 0.5 * (arc[1:] + arc[:-1]), np.arctan2(np.diff(z), np.diff(r)))
    return z, angle, arc


# The front over the azimuth ------------------------------------------------------------------------------


def faces_on_plane(faces, gap):
    """Those of ``faces`` (n_faces, 3) whose nodes all touch the plane; ``gap`` (n_nodes,) [a0]."""
    return faces[touches(gap)[faces].all(axis=1)]


def rim_radius(x, faces, n_angles=360):
    """Radius (n_angles,) [a0] at equal angles of the rim of ``faces``, from node to node about its own centre.

    An edge that one face has alone belongs to the rim. ``x`` (n_nodes, 3) [a0].
    """
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    once, count = np.unique(edges, axis=0, return_counts=True)
    points = in_plane(x)[np.unique(once[count == 1])]
    points = points - points.mean(axis=0)
    angle = np.arctan2(points[:, 1], points[:, 0])
    order = np.argsort(angle)
    at = np.linspace(-np.pi, np.pi, n_angles, endpoint=False)
    return np.interp(at, angle[order], np.hypot(*points.T)[order], period=2.0 * np.pi)


def modulation(radius, mean=None):
    """Standard deviation of ``radius`` (n_angles,) over the azimuth, of its mean or that of ``mean`` (n_angles,)."""
    return float(np.std(radius) / np.mean(radius if mean is None else mean))
