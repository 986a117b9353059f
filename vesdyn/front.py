"""Contact front: the contour on which the membrane leaves the plane.

The front is cut out of the edges: every edge with one node below the level and one above gives a point.
Nothing here knows what an element is, so the same functions serve a meridian and a triangle mesh.
"""
import numpy as np


def front_points(x, edges, share):
    """Horizontal coordinates (n_points, d - 1) [a0] where ``edges`` are cut at ``share`` of their length.

    ``share`` (n_edges,) counts from the lower end (`vesdyn.body.set_shares_below`).
    """
    cut = (share > 0.0) & (share < 1.0)
    a, b = x[edges[cut, 0]], x[edges[cut, 1]]
    rising = (a[:, -1] <= b[:, -1])[:, None]
    low, high = np.where(rising, a, b), np.where(rising, b, a)
    return (low + share[cut, None] * (high - low))[:, :-1]


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
    landed = x[:, -1] <= 0.0
    rim = np.zeros(len(x), dtype=bool)
    rim[a[landed[a] & ~landed[b]]] = rim[b[landed[b] & ~landed[a]]] = True
    shortest, length = np.full(len(x), np.inf), np.linalg.norm(x[a] - x[b], axis=1)
    np.minimum.at(shortest, a, length)
    np.minimum.at(shortest, b, length)
    radius = np.hypot(x[rim, 0], x[rim, 1])
    share = rng.uniform(-largest, largest, len(radius))
    most = np.divide(shortest[rim] / 3.0, radius, out=np.zeros_like(radius), where=radius > 0.0)
    displaced = x.copy()
    displaced[rim, :-1] *= 1.0 + np.clip(share, -most, most)[:, None]
    return displaced
