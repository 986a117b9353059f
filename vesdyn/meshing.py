"""Triangulations of a sphere that touches the plane z = 0 from above, graded from the contact to the top.

The edge length is `front_edge` up to the polar angle FINE_ANGLE (measured from the contact), where the front
passes, and grows by GROWTH per unit of arc to `far_edge`. Three layouts of the same gradation:

scalloped  Rows of equal latitude that swing by one row spacing in each of six sectors, triangulated as a
           Delaunay mesh. The front meets its nodes one by one instead of a ring at a time, so its area
           grows smoothly: the default.
rings      The rows themselves: symmetric under turns of sixty degrees to round-off, so that any other
           azimuthal mode of a front is physics.
spiral     One curve from pole to pole, triangulated as a Delaunay mesh: no direction is special.
"""
import numpy as np
import scipy.spatial
import trimesh

FINE_ANGLE = np.radians(80.0)
GROWTH = 0.25
SECTORS = 6
_ROW = np.sqrt(3.0) / 2.0  # distance of rows of equilateral triangles, in edges


def edge_length(arc, radius, front_edge, far_edge):
    """Edge length wanted at distance ``arc`` [a0] along the meridian from the contact."""
    return np.clip(front_edge + GROWTH * (arc - FINE_ANGLE * radius), front_edge, far_edge)


def _count_edges(radius, front_edge, far_edge):
    """Meridian arc (fine samples) and the number of edges passed up to there."""
    arc = np.linspace(0.0, np.pi * radius, 20_001)
    density = 1.0 / edge_length(arc, radius, front_edge, far_edge)
    passed = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(arc))])
    return arc, passed


def _rings(radius, front_edge, far_edge):
    arc, passed = _count_edges(radius, front_edge, far_edge)
    rows = int(np.ceil(passed[-1] / _ROW))
    ring_arc = np.interp(np.linspace(0.0, passed[-1], rows + 1), passed, arc)
    vertices, first, count, phase = [(0.0, 0.0, -radius)], [0], [1], [0.0]
    for s in ring_arc[1:-1]:
        circumference = 2.0 * np.pi * radius * np.sin(s / radius)
        wanted = circumference / (SECTORS * edge_length(s, radius, front_edge, far_edge))
        n = SECTORS * max(1, round(wanted))
        phase.append(0.5 - phase[-1] if n == count[-1] else 0.0)  # equal rows are staggered
        first.append(len(vertices))
        count.append(n)
        angle = 2.0 * np.pi * (np.arange(n) + phase[-1]) / n
        ring = radius * np.sin(s / radius)
        height = -radius * np.cos(s / radius)
        vertices += [(ring * np.cos(t), ring * np.sin(t), height) for t in angle]
    vertices.append((0.0, 0.0, radius))
    vertices = np.array(vertices)
    faces = [(0, 1 + (j + 1) % count[1], 1 + j) for j in range(count[1])]
    for row in range(1, len(count) - 1):
        faces += _strip(vertices, first[row], count[row], first[row + 1], count[row + 1])
    top, last = len(vertices) - 1, first[-1]
    faces += [(top, last + j, last + (j + 1) % count[-1]) for j in range(count[-1])]
    return vertices, np.array(faces)


def _strip(vertices, lower, n_lower, upper, n_upper):
    """Triangles between two rings, one sector by the shorter diagonal, repeated for all sectors."""
    per_lower, per_upper = n_lower // SECTORS, n_upper // SECTORS
    i = j = 0
    pattern = []
    while i < per_lower or j < per_upper:
        a, b = vertices[lower + i % n_lower], vertices[upper + j % n_upper]
        next_a, next_b = vertices[lower + (i + 1) % n_lower], vertices[upper + (j + 1) % n_upper]
        go_lower = np.linalg.norm(next_a - b) < np.linalg.norm(next_b - a) - 1e-12
        if j == per_upper or (i < per_lower and go_lower):
            pattern.append((lower, i, lower, i + 1, upper, j))
            i += 1
        else:
            pattern.append((upper, j + 1, upper, j, lower, i))
            j += 1
    return [
        tuple(start + (k + sector * (per_lower if start == lower else per_upper))
              % (n_lower if start == lower else n_upper)
              for start, k in zip(triangle[::2], triangle[1::2]))
        for sector in range(SECTORS)
        for triangle in pattern
    ]


def _delaunay(points):
    """Outward Delaunay faces of points on a sphere around the origin: their convex hull."""
    faces = scipy.spatial.ConvexHull(points).simplices
    a, b, c = np.moveaxis(points[faces], 1, 0)
    inward = np.einsum("fk,fk->f", np.cross(b - a, c - a), a) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    return faces


def _spiral(radius, front_edge, far_edge):
    arc = np.linspace(0.0, np.pi * radius, 20_001)
    edge = edge_length(arc, radius, front_edge, far_edge)
    density = 2.0 * np.pi * radius * np.sin(arc / radius) / (_ROW * edge**2)
    passed = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(arc))])
    n = int(np.ceil(passed[-1]))
    s = np.interp((np.arange(n) + 0.5) * passed[-1] / n, passed, arc) / radius
    golden = np.pi * (3.0 - np.sqrt(5.0))
    t = golden * np.arange(n)
    points = radius * np.stack([np.sin(s) * np.cos(t), np.sin(s) * np.sin(t), -np.cos(s)], axis=1)
    points = np.concatenate([[[0.0, 0.0, -radius]], points[1:]])
    return points, _delaunay(points)


def _scalloped(radius, front_edge, far_edge):
    x, y, z = _rings(radius, front_edge, far_edge)[0].T
    polar, turn = np.arccos(np.clip(-z / radius, -1.0, 1.0)), np.arctan2(y, x)
    wave = 2.0 * np.abs((turn * SECTORS / (2.0 * np.pi)) % 1.0 - 0.5) - 0.5  # triangle: all offsets equally often
    row = _ROW * edge_length(radius * polar, radius, front_edge, far_edge) / radius
    fade = np.minimum(1.0, polar / (6.0 * row)) * np.minimum(1.0, (np.pi - polar) / (6.0 * row))
    polar = polar + wave * row * fade**2
    ring = radius * np.sin(polar)
    points = np.stack([ring * np.cos(turn), ring * np.sin(turn), -radius * np.cos(polar)], axis=1)
    return points, _delaunay(points)


_LAYOUTS = {"rings": _rings, "scalloped": _scalloped, "spiral": _spiral}


def graded_sphere(front_edge, far_edge, layout="rings", volume=np.pi / 6.0):
    """Triangulate the sphere that encloses ``volume`` [a0^3] and rests on z = 0.

    The polyhedron itself is scaled to enclose ``volume`` exactly. Returns vertices (n_vertices, 3) [a0]
    and outward faces (n_faces, 3). Raises ValueError where the result is not a closed manifold.
    """
    radius = (3.0 * volume / (4.0 * np.pi)) ** (1.0 / 3.0)
    mesh = trimesh.Trimesh(*_LAYOUTS[layout](radius, front_edge, far_edge), process=False)
    check_mesh(mesh)
    vertices = np.array(mesh.vertices) * (volume / mesh.volume) ** (1.0 / 3.0)
    vertices[:, 2] -= vertices[:, 2].min()
    return vertices, np.array(mesh.faces)


def graded_meridian(front_edge, far_edge, volume=np.pi / 6.0):
    """Nodes (n_nodes, 2), (r, z) [a0], of a half circle graded as `graded_sphere`, from contact to top.

    The solid of revolution of the polygon encloses ``volume`` [a0^3] exactly.
    """
    radius = (3.0 * volume / (4.0 * np.pi)) ** (1.0 / 3.0)
    arc, passed = _count_edges(radius, front_edge, far_edge)
    segments = int(np.ceil(passed[-1]))
    polar = np.interp(np.linspace(0.0, passed[-1], segments + 1), passed, arc) / radius
    r, z = radius * np.sin(polar), radius * (1.0 - np.cos(polar))
    r[0] = r[-1] = 0.0
    enclosed = np.pi / 3.0 * np.sum((r[:-1] ** 2 + r[:-1] * r[1:] + r[1:] ** 2) * np.diff(z))
    return np.stack([r, z], axis=1) * (volume / enclosed) ** (1.0 / 3.0)


def check_mesh(mesh):
    """Raise ValueError unless ``mesh`` (trimesh) is one closed, outward-oriented surface of genus 0."""
    if not mesh.is_watertight:
        raise ValueError("mesh: an edge does not have exactly two faces; give a closed surface")
    if not mesh.is_winding_consistent:
        raise ValueError("mesh: neighbouring faces are oriented differently; orient all faces outward")
    if mesh.euler_number != 2:
        raise ValueError(f"mesh: Euler number {mesh.euler_number} instead of 2; give one sphere without handles")
    if not mesh.volume > 0.0:
        raise ValueError("mesh: faces are oriented inward (negative volume); reverse them")
    if not mesh.area_faces.min() > 0.0:
        raise ValueError("mesh: a face has no area; remove degenerate faces")
