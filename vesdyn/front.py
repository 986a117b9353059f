"""Contact front: the contour on which the membrane leaves the plane.

The front is cut out of the edges: every edge with one node below `level` and one above gives a point.
Nothing here knows what an element is, so the same functions serve a meridian and a triangle mesh.
"""
import numpy as np


def front_points(x, edges, level):
    """Horizontal coordinates (n_points, d - 1) [a0] where ``edges`` cross height ``level`` [a0]."""
    low, high = x[edges[:, 0]], x[edges[:, 1]]
    crossing = (low[:, -1] < level) != (high[:, -1] < level)
    low, high = low[crossing], high[crossing]
    share = (level - low[:, -1]) / (high[:, -1] - low[:, -1])
    return (low + share[:, None] * (high - low))[:, :-1]


def front_radius(x, edges, level, n_angles=360):
    """Radius (n_angles,) [a0] of the front about its own centre at equal angles; empty before contact.

    An axisymmetric body has one radius, its outermost crossing.
    """
    points = front_points(x, edges, level)
    if len(points) == 0:
        return np.zeros(0)
    if points.shape[1] == 1:
        return points.max(keepdims=True)[0]
    points = points - points.mean(axis=0)
    angle = np.arctan2(points[:, 1], points[:, 0])
    order = np.argsort(angle)
    radius = np.hypot(points[order, 0], points[order, 1])
    at = np.linspace(-np.pi, np.pi, n_angles, endpoint=False)
    return np.interp(at, angle[order], radius, period=2.0 * np.pi)


def contact_radius(x, edges, level):
    """Mean radius [a0] of the front at height ``level`` [a0]; 0 before contact."""
    radius = front_radius(x, edges, level)
    return float(radius.mean()) if len(radius) else 0.0
