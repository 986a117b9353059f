"""Start shapes that touch the plane z = 0 from above: graded spheres and spheroids, and meshes from a file.

All enclose the same volume, that of a sphere of diameter a0: the unit of length is the diameter of the sphere of equal
volume whatever the shape. The edge length is `front_edge` up to where the membrane is FINE_ANGLE steep, where the front
passes, and grows by GROWTH per unit of arc to `far_edge`. Three layouts of the same gradation:

scalloped  Rows of equal latitude that swing by one row spacing in each of six sectors, triangulated as a
           Delaunay mesh. The front meets its nodes one by one instead of a ring at a time, so its area
           grows smoothly: the default.
rings      The rows themselves: symmetric under turns of sixty degrees to round-off, so that any other
           azimuthal mode of a front is physics.
spiral     One curve from pole to pole, triangulated as a Delaunay mesh: no direction is special.

A spheroid is mapped conformally onto a sphere to be triangulated: what is a Delaunay mesh there nearly is one here.
"""
import hashlib
import io
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import psutil
import scipy.spatial
import trimesh
from scipy.special import ellipeinc

from vesdyn.errors import CaseError

VOLUME = np.pi / 6.0  # [a0^3]
FINE_ANGLE = np.radians(80.0)
GROWTH = 0.25
SECTORS = 6
_SAMPLES = 20_001  # of a function along the meridian, between which it is linear
_FADE = 6.0  # rows from a pole within which the scallops fade out
_NEAR_CONTACT = 0.1  # [a0]
_ROW = np.sqrt(3.0) / 2.0  # distance of rows of equilateral triangles, in edges


class Profile(NamedTuple):
    """A spheroid about its centre, by the angle t = arc / radius along its meridian from the contact, 0 to pi.

    The functions take and return arrays; those of a sphere are sine, cosine, arc cosine and the identity.
    """

    radius: float  # length of the meridian / pi [a0]
    fine: float  # angle t up to which the mesh is fine
    across: Callable  # distance from the axis [radius]
    along: Callable  # depth under the centre [radius]
    angle: Callable  # the angle t at a depth [radius]
    conformal: Callable  # polar angle of the point's image on a sphere


def profile(axes=(1.0, 1.0), volume=VOLUME, fine_angle=FINE_ANGLE):
    """`Profile` of the spheroid of ``volume`` [a0^3] whose equatorial and polar axes are as ``axes``."""
    radius = (3.0 * volume / (4.0 * np.pi)) ** (1.0 / 3.0)
    equatorial, polar = axes
    if equatorial == polar:
        return Profile(radius, fine_angle, np.sin, np.cos, lambda depth: np.arccos(np.clip(depth, -1.0, 1.0)), lambda t: t)
    ratio = (equatorial / polar) ** (1.0 / 3.0)
    a, b = radius * ratio, radius / ratio**2  # semi-axes; a point is (a sin u, -b cos u)
    m = 1.0 - (b / a) ** 2
    radius = a * ellipeinc(np.pi, m) / np.pi
    e = np.sqrt(abs(m))

    def angle_of(u):
        return a * ellipeinc(u, m) / radius

    us = np.linspace(0.0, np.pi, _SAMPLES)
    ts = angle_of(us)

    def parameter(t):
        u = np.interp(t, ts, us)
        slope = np.hypot(a * np.cos(u), b * np.sin(u)) / radius
        return u - (angle_of(u) - t) / slope  # Newton: round-off is left of the interpolation's error

    def conformal(t):
        """Conformal latitude of a spheroid: tan(chi/2) of the geodetic latitude times a power (Snyder 1987, 3-1)."""
        u = parameter(t)
        sine = -a * np.cos(u) / np.hypot(a * np.cos(u), b * np.sin(u))  # of the latitude
        shift = e * np.arctan(e * sine) if m < 0.0 else -e * np.arctanh(e * sine)
        return 2.0 * np.arctan(np.tan(0.5 * np.arccos(-sine)) * np.exp(shift))

    return Profile(
        radius,
        float(angle_of(np.arctan2(a * np.sin(fine_angle), b * np.cos(fine_angle)))),
        lambda t: a * np.sin(parameter(t)) / radius,
        lambda t: b * np.cos(parameter(t)) / radius,
        lambda depth: angle_of(np.arccos(np.clip(depth * radius / b, -1.0, 1.0))),
        conformal,
    )


def spheroid_area(axes):
    """Area [a0^2] of the spheroid of volume `VOLUME` whose equatorial and polar axes are as ``axes``."""
    p = profile(axes)
    t = np.linspace(0.0, np.pi, _SAMPLES)
    return 2.0 * np.pi * p.radius**2 * float(np.trapezoid(p.across(t), t))


def reduced_volume(area, volume=VOLUME):
    """Volume over that of a sphere of the same ``area`` [a0^2]: 1 for a sphere, less for any other shape."""
    return volume / (np.pi / 6.0 * (area / np.pi) ** 1.5)


def edge_length(arc, fine, front_edge, far_edge):
    """Edge length wanted at distance ``arc`` [a0] along the meridian from the contact; ``fine`` up to that arc."""
    return np.clip(front_edge + GROWTH * (arc - fine), front_edge, far_edge)


def _integral(density, arc):
    """Integral of the samples ``density`` up to each of ``arc``."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(arc))])


def _count_edges(p, front_edge, far_edge):
    """Meridian arc (fine samples) and the number of edges passed up to there."""
    arc = np.linspace(0.0, np.pi * p.radius, _SAMPLES)
    return arc, _integral(1.0 / edge_length(arc, p.fine * p.radius, front_edge, far_edge), arc)


def _count_vertices(p, front_edge, far_edge):
    """Meridian arc (fine samples) and the number of vertices of equilateral triangles passed up to there."""
    arc = np.linspace(0.0, np.pi * p.radius, _SAMPLES)
    edge = edge_length(arc, p.fine * p.radius, front_edge, far_edge)
    return arc, _integral(2.0 * np.pi * p.radius * p.across(arc / p.radius) / (_ROW * edge**2), arc)


def expected_nodes(front_edge, far_edge, axes=(1.0, 1.0), fine_angle=FINE_ANGLE):
    """About how many nodes a graded meridian has, and how many vertices a graded surface (within 5 %)."""
    counts = (count(profile(axes, fine_angle=fine_angle), front_edge, far_edge)[1][-1] for count in (_count_edges, _count_vertices))
    return tuple(map(float, counts))


def _rings(p, front_edge, far_edge):
    radius = p.radius
    arc, passed = _count_edges(p, front_edge, far_edge)
    rows = int(np.ceil(passed[-1] / _ROW))
    ring_arc = np.interp(np.linspace(0.0, passed[-1], rows + 1), passed, arc)[1:-1]
    edges = edge_length(ring_arc, p.fine * radius, front_edge, far_edge)
    rings, depths = radius * p.across(ring_arc / radius), radius * p.along(ring_arc / radius)
    low, high = -radius * p.along(np.array([0.0, np.pi]))
    vertices, first, count, phase = [(0.0, 0.0, low)], [0], [1], [0.0]
    for edge, ring, depth in zip(edges, rings, depths):
        wanted = 2.0 * np.pi * ring / (SECTORS * edge)
        n = SECTORS * max(1, round(wanted))
        phase.append(0.5 - phase[-1] if n == count[-1] else 0.0)  # equal rows are staggered
        first.append(len(vertices))
        count.append(n)
        angle = 2.0 * np.pi * (np.arange(n) + phase[-1]) / n
        vertices += [(ring * np.cos(t), ring * np.sin(t), -depth) for t in angle]
    vertices.append((0.0, 0.0, high))
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


def _spiral(p, front_edge, far_edge):
    arc, passed = _count_vertices(p, front_edge, far_edge)
    n = int(np.ceil(passed[-1]))
    s = np.interp((np.arange(n) + 0.5) * passed[-1] / n, passed, arc) / p.radius
    golden = np.pi * (3.0 - np.sqrt(5.0))
    t = golden * np.arange(n)
    s[0] = 0.0  # the first vertex is the pole

    def wound(across, along):
        return p.radius * np.stack([across * np.cos(t), across * np.sin(t), -along], axis=1)

    image = p.conformal(s)
    return wound(p.across(s), p.along(s)), _delaunay(wound(np.sin(image), np.cos(image)))


def _scalloped(p, front_edge, far_edge):
    x, y, z = _rings(p, front_edge, far_edge)[0].T
    polar, turn = p.angle(-z / p.radius), np.arctan2(y, x)
    wave = 2.0 * np.abs((turn * SECTORS / (2.0 * np.pi)) % 1.0 - 0.5) - 0.5  # triangle: all offsets equally often
    row = _ROW * edge_length(p.radius * polar, p.fine * p.radius, front_edge, far_edge) / p.radius
    fade = np.minimum(1.0, polar / (_FADE * row)) * np.minimum(1.0, (np.pi - polar) / (_FADE * row))
    polar = polar + wave * row * fade**2

    def turned(across, along):
        ring = p.radius * across
        return np.stack([ring * np.cos(turn), ring * np.sin(turn), -p.radius * along], axis=1)

    image = p.conformal(polar)
    return turned(p.across(polar), p.along(polar)), _delaunay(turned(np.sin(image), np.cos(image)))


_LAYOUTS = {"rings": _rings, "scalloped": _scalloped, "spiral": _spiral}


def graded_sphere(front_edge, far_edge, layout="rings", axes=(1.0, 1.0), volume=VOLUME, fine_angle=FINE_ANGLE):
    """Triangulate the sphere that encloses ``volume`` [a0^3] and rests on z = 0, or the spheroid of ``axes``.

    ``axes`` are the equatorial and the polar one; only their ratio counts. The polyhedron itself is scaled to
    enclose ``volume`` exactly. Returns vertices (n_vertices, 3) [a0] and outward faces (n_faces, 3). Raises
    ValueError where the result is not a closed manifold.
    """
    mesh = trimesh.Trimesh(*_LAYOUTS[layout](profile(axes, volume, fine_angle), front_edge, far_edge), process=False)
    check_mesh(mesh)
    return _placed(mesh, volume)


def _placed(mesh, volume):
    """Vertices (n_vertices, 3) [a0] of ``mesh`` (trimesh) scaled to ``volume`` and put on the plane; its faces."""
    vertices = np.array(mesh.vertices) * (volume / mesh.volume) ** (1.0 / 3.0)
    vertices[:, 2] -= vertices[:, 2].min()
    return vertices, np.array(mesh.faces)


def graded_meridian(front_edge, far_edge, axes=(1.0, 1.0), volume=VOLUME, fine_angle=FINE_ANGLE):
    """Nodes (n_nodes, 2), (r, z) [a0], of a meridian graded as `graded_sphere`, from contact to top.

    The solid of revolution of the polygon encloses ``volume`` [a0^3] exactly.
    """
    p = profile(axes, volume, fine_angle)
    arc, passed = _count_edges(p, front_edge, far_edge)
    segments = int(np.ceil(passed[-1]))
    polar = np.interp(np.linspace(0.0, passed[-1], segments + 1), passed, arc) / p.radius
    lowest = p.along(np.zeros(1))[0]
    r, z = p.radius * p.across(polar), p.radius * (lowest - p.along(polar))
    r[0] = r[-1] = 0.0
    enclosed = np.pi / 3.0 * np.sum((r[:-1] ** 2 + r[:-1] * r[1:] + r[1:] ** 2) * np.diff(z))
    return np.stack([r, z], axis=1) * (volume / enclosed) ** (1.0 / 3.0)


def revolved(x, n_sectors, staggered=False):
    """Closed triangle surface of ``n_sectors`` equal sectors, a meridian turned about the axis.

    ``x`` (n_nodes, 2) are (r, z) [a0] from the lower to the upper pole, both on the axis. Where ``staggered``, every
    other ring is turned by half a sector, so that triangles lean to neither side. Returns vertices (n_vertices, 3)
    [a0], outward faces (n_faces, 3) and the node of each vertex (n_vertices,): the lower pole, ring by ring, the upper
    pole. Area and volume are second order in 1/n_sectors.
    """
    rings = len(x) - 2
    turned = 0.5 * staggered * (np.arange(rings) % 2)[:, None]
    angle = 2.0 * np.pi / n_sectors * (np.arange(n_sectors) + turned)
    r, z = x[1:-1, 0, None], np.broadcast_to(x[1:-1, 1, None], angle.shape)
    ring = np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=-1).reshape(-1, 3)
    vertices = np.concatenate([[[0.0, 0.0, x[0, 1]]], ring, [[0.0, 0.0, x[-1, 1]]]])
    node = np.concatenate([[0], np.repeat(np.arange(1, rings + 1), n_sectors), [rings + 1]])

    j = np.arange(n_sectors)
    k = (j + 1) % n_sectors
    first, last = 1, 1 + (rings - 1) * n_sectors
    faces = [np.stack([np.zeros_like(j), first + k, first + j], axis=1)]
    for i in range(rings - 1):
        low, high = first + i * n_sectors, first + (i + 1) * n_sectors
        if staggered and i % 2 == 0:  # the upper ring is ahead by half a sector
            pairs = [(low + j, low + k, high + j), (low + k, high + k, high + j)]
        else:
            pairs = [(low + j, low + k, high + k), (low + j, high + k, high + j)]
        faces += [np.stack(corners, axis=1) for corners in pairs]
    faces.append(np.stack([np.full_like(j, len(vertices) - 1), last + j, last + k], axis=1))
    return vertices, np.concatenate(faces), node


def read_mesh(path, digest=None, volume=VOLUME):
    """Read the closed triangle mesh in the file ``path``, scale it to ``volume`` [a0^3] and put it on z = 0.

    Whatever trimesh reads (PLY, OBJ, STL, OFF, ...); its unit of length is of no matter. Vertices in one place are
    taken for one, as an STL file needs. Returns vertices (n_vertices, 3) [a0] and outward faces (n_faces, 3).

    Raises CaseError where there is no such file, where it cannot be read or its SHA-256 is not ``digest``, or where it
    is not one closed, outward-oriented surface of genus 0 without degenerate faces.
    """
    where = f"mesh.file: {path}:"
    try:
        content = Path(path).read_bytes()
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or "is not a path"
        raise CaseError(f"{where} {why}; give the path of a closed triangle mesh.") from None
    if digest is not None and hashlib.sha256(content).hexdigest() != digest:
        raise CaseError(f"{where} is not the file that this case was made with (SHA-256 {digest[:12]}...); give that one.")
    try:
        mesh = trimesh.load_mesh(io.BytesIO(content), file_type=Path(path).suffix.lower(), process=False)
    except Exception as error:  # each format's reader fails in its own way
        why = str(error).splitlines()[0][:60] if str(error) else type(error).__name__
        raise CaseError(f"{where} not readable ({why}); give a triangle mesh as PLY, OBJ, STL or OFF.") from None
    if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) == 0:
        raise CaseError(f"{where} holds no triangles; give a closed triangle mesh.")
    if not np.all(np.isfinite(mesh.vertices)):
        raise CaseError(f"{where} a vertex is not finite; correct the file.")
    mesh.remove_unreferenced_vertices()
    if not mesh.is_watertight:
        mesh.merge_vertices()
    try:
        check_mesh(mesh)
    except ValueError as error:
        raise CaseError(f"{where} {str(error).removeprefix('mesh: ')}.") from None
    return _placed(mesh, volume)


def triangles_area(x, faces):
    """Area [a0^2] of the triangles ``faces`` (n_faces, 3) of the vertices ``x`` (n_vertices, 3) [a0]."""
    a, b, c = np.moveaxis(x[faces], 1, 0)
    return float(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def measured_edges(x, faces):
    """Mean edge length [a0] near the contact, below a tenth of a0, and the longest edge of all."""
    edges = np.unique(np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    length, height = np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1), x[edges, 2].min(axis=1)
    return float(length[height < _NEAR_CONTACT].mean()), float(length.max())


def check_memory(nodes, each):
    """Raise CaseError where ``nodes`` of ``each`` [bytes] are more than this machine holds."""
    if nodes * each > machine_memory():
        raise CaseError(
            f"mesh.front_edge: about {nodes:.2g} nodes would need {nodes * each / 1e9:.2g} GB of memory and there are"
            f" {machine_memory() / 1e9:.2g} GB; lengthen front_edge (or far_edge)."
        )


def machine_memory():
    """Memory [bytes] that this process may have: that of the machine, or of the container it runs in if less."""
    limit = psutil.virtual_memory().total
    for file in ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"):
        try:
            limit = min(limit, int(Path(file).read_text()))
        except (OSError, ValueError):  # another system, or no limit
            continue
    return limit


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
