"""Start shapes: closed, outward, of exact volume, graded and symmetric as promised; bad meshes are refused."""

import hashlib

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from vesdyn.meridian import build_meridian
from vesdyn import meshing
from vesdyn.errors import CaseError
from vesdyn.meshing import (
    FINE_ANGLE,
    check_mesh,
    edge_length,
    expected_nodes,
    graded_meridian,
    graded_sphere,
    profile,
    read_mesh,
    reduced_volume,
    revolved,
    spheroid_area,
)
from vesdyn.surface import build_surface

LAYOUTS = ("rings", "scalloped", "spiral")
VOLUME = np.pi / 6.0


@pytest.mark.parametrize("front, far", [(0.04, 0.1), (0.1, 0.1), (0.3, 0.5)])
@pytest.mark.parametrize("layout", LAYOUTS)
def test_sphere_is_closed_outward_and_of_exact_volume(layout, front, far):
    x, faces = graded_sphere(front, far, layout)
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, count = np.unique(edges, axis=0, return_counts=True)
    assert np.all(count == 2)
    directed = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    assert len(np.unique(directed, axis=0)) == len(directed)  # neighbours run along an edge in opposite senses
    assert len(x) - len(count) + len(faces) == 2
    assert np.array_equal(np.unique(faces), np.arange(len(x)))
    a, b, c = np.moveaxis(x[faces], 1, 0)
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0 == pytest.approx(VOLUME, rel=1e-13)
    outward = np.einsum("ij,ij->i", np.cross(b - a, c - a), (a + b + c) / 3.0 - [0.0, 0.0, 0.5])
    assert outward.min() > 0.0
    assert x[:, 2].min() == 0.0 and x[0] == pytest.approx([0.0, 0.0, 0.0], abs=1e-15)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_vertices_lie_on_one_sphere(layout):
    x, _ = graded_sphere(0.05, 0.1, layout)
    # |x|^2 = 2 c . x + d for centre c
    unknown = np.linalg.lstsq(np.column_stack([2.0 * x, np.ones(len(x))]), np.sum(x**2, axis=1), rcond=None)[0]
    assert unknown[:2] == pytest.approx(0.0, abs=1e-14)
    assert np.ptp(np.linalg.norm(x - unknown[:3], axis=1)) < 1e-14


@pytest.mark.parametrize("front, far", [(0.04, 0.1), (0.03, 0.05)])
def test_rings_are_alike_in_six_sectors(front, far):
    x, faces = graded_sphere(front, far, "rings")
    c, s = 0.5, np.sqrt(0.75)
    turned = x @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    distance, image = cKDTree(x).query(turned)
    assert distance.max() < 1e-15
    assert len(np.unique(image)) == len(x)
    canonical = {tuple(np.roll(face, -np.argmin(face))) for face in faces}
    assert {tuple(np.roll(face, -np.argmin(face))) for face in image[faces]} == canonical


@pytest.mark.parametrize("layout", LAYOUTS)
def test_edges_follow_the_gradation(layout):
    front, far = 0.03, 0.09
    x, faces = graded_sphere(front, far, layout)
    edges = trimesh.Trimesh(x, faces, process=False).edges_unique
    length = np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1)
    middle = x[edges].mean(axis=1)
    polar = np.arctan2(np.hypot(middle[:, 0], middle[:, 1]), 0.5 - middle[:, 2])
    ratio = length / edge_length(0.5 * polar, 0.5 * FINE_ANGLE, front, far)
    assert 0.45 < ratio.min() and ratio.max() < 1.8  # six sectors, and whole numbers of edges, at the poles
    assert ratio[polar < FINE_ANGLE].mean() == pytest.approx(1.0, abs=0.1)
    assert ratio[polar > np.radians(130.0)].mean() == pytest.approx(1.0, abs=0.15)


# Spheroids


SPHEROIDS = [(1.5, 1.0), (4.0, 1.0), (1.0, 2.0), (1.0, 4.0)]


@pytest.mark.parametrize("axes", SPHEROIDS)
def test_profile_is_the_ellipse_by_its_arc(axes):
    p = profile(axes)
    t = np.linspace(0.0, np.pi, 4001)
    r, depth = p.radius * p.across(t), p.radius * p.along(t)
    a, b = r.max(), depth[0]
    assert a / b == pytest.approx(axes[0] / axes[1], rel=1e-6)  # the widest sample is half a step off the equator
    assert 4.0 / 3.0 * np.pi * a**2 * b == pytest.approx(VOLUME, rel=1e-6)
    assert (r / a) ** 2 + (depth / b) ** 2 == pytest.approx(1.0, abs=1e-6)
    step = np.hypot(np.diff(r), np.diff(depth))  # equal arcs, up to the chords: h^2 k^2 / 24 and k < 60
    assert np.abs(step / step.mean() - 1.0).max() < 1e-4
    assert p.angle(p.along(t)) == pytest.approx(t, abs=1e-7)  # the arc cosine of round-off at the poles
    steep = np.interp(p.fine, 0.5 * (t[1:] + t[:-1]), np.arctan2(-np.diff(depth), np.diff(r)))
    assert steep == pytest.approx(FINE_ANGLE, abs=1e-3)


@pytest.mark.parametrize("axes", [*SPHEROIDS, (1.0, 1.0)])
def test_image_on_the_sphere_is_conformal(axes):
    """d theta / sin theta = ds / r: the same stretch along the meridian and around it."""
    p, t = profile(axes), np.linspace(0.0, np.pi, 4001)
    image, middle = p.conformal(t), 0.5 * (t[1:] + t[:-1])
    along = np.diff(np.log(np.tan(0.5 * image[1:-1])))
    around = np.diff(t)[1:-1] / p.across(middle[1:-1])
    inside = slice(200, -200)  # both are singular at the poles
    assert along[inside] == pytest.approx(around[inside], rel=1e-4)
    assert image[0] == 0.0 and image[-1] == pytest.approx(np.pi, abs=1e-15)


@pytest.mark.parametrize("axes", SPHEROIDS)
@pytest.mark.parametrize("layout", LAYOUTS)
def test_spheroid_is_a_good_mesh_of_exact_volume_on_the_plane(layout, axes):
    front, far = 0.04, 0.06
    x, faces = graded_sphere(front, far, layout, axes)
    mesh = trimesh.Trimesh(x, faces, process=False)
    check_mesh(mesh)
    assert mesh.volume == pytest.approx(VOLUME, rel=1e-13)
    assert x[:, 2].min() == 0.0 and x[0] == pytest.approx([0.0, 0.0, 0.0], abs=1e-15)
    # r^2 = A + B z + C z^2 with C = -(a/b)^2
    powers, rr = x[:, 2, None] ** np.arange(3), x[:, 0] ** 2 + x[:, 1] ** 2
    fit = np.linalg.lstsq(powers, rr, rcond=None)[0]
    assert np.abs(powers @ fit - rr).max() < 1e-12
    assert fit[2] == pytest.approx(-((axes[0] / axes[1]) ** 2), rel=1e-9)
    angles = np.degrees(mesh.face_angles)
    assert angles.min() > 30.0 and angles.max() < 110.0  # as on a sphere, though it is four times wider than high
    assert len(x) == pytest.approx(expected_nodes(front, far, axes)[1], rel=0.05)
    length, low = mesh.edges_unique_length, x[mesh.edges_unique, 2].max(axis=1) < 0.06
    assert length[low].mean() == pytest.approx(front, rel=0.1) and length.max() < 1.8 * far


@pytest.mark.parametrize("axes", SPHEROIDS)
def test_meridian_of_a_spheroid(axes):
    x = graded_meridian(0.01, 0.03, axes)
    r, z = x.T
    assert r[0] == r[-1] == 0.0 and z[0] == 0.0 and np.all(r[1:-1] > 0.0) and np.all(np.diff(z) > 0.0)
    cones = np.pi / 3.0 * (r[:-1] ** 2 + r[:-1] * r[1:] + r[1:] ** 2) * np.diff(z)
    assert cones.sum() == pytest.approx(VOLUME, rel=1e-14)
    assert 2.0 * r.max() / z.max() == pytest.approx(axes[0] / axes[1], rel=1e-2)  # a node next to the equator
    assert len(x) == pytest.approx(expected_nodes(0.01, 0.03, axes)[0], abs=2)


def test_area_and_reduced_volume_of_spheroids_are_the_textbook_ones():
    assert spheroid_area((1.0, 1.0)) == pytest.approx(np.pi, rel=1e-8)
    for a, b in SPHEROIDS:
        e = np.sqrt(1.0 - min(a / b, b / a) ** 2)
        area = (
            2.0 * np.pi * (a * a + b * b / e * np.arctanh(e)) if a > b else 2.0 * np.pi * (a * a + a * b / e * np.arcsin(e))
        )
        volume = 4.0 / 3.0 * np.pi * a * a * b
        assert spheroid_area((a, b)) == pytest.approx(area * (VOLUME / volume) ** (2.0 / 3.0), rel=1e-6)
        assert reduced_volume(spheroid_area((a, b))) == pytest.approx(reduced_volume(area, volume), rel=1e-6)
    assert reduced_volume(np.pi) == pytest.approx(1.0, rel=1e-15)


@pytest.mark.parametrize("front, far", [(0.015, 0.05), (0.03, 0.06), (0.05, 0.05)])
def test_nodes_are_estimated_before_a_mesh_is_made(front, far):
    on_meridian, on_surface = expected_nodes(front, far)
    assert len(graded_meridian(front, far)) == pytest.approx(on_meridian, abs=2)
    for layout in LAYOUTS:
        assert len(graded_sphere(front, far, layout)[0]) == pytest.approx(on_surface, rel=0.05)


def test_mesh_beyond_the_memory_is_refused_by_a_sentence(monkeypatch):
    monkeypatch.setattr(meshing, "machine_memory", lambda: 8e9)
    meshing.check_memory(8e5, 9000.0)
    with pytest.raises(CaseError, match=r"^mesh.front_edge: about 1e\+06 nodes would need 9 GB of memory and there are 8 GB; lengthen"):
        meshing.check_memory(1e6, 9000.0)


def test_machine_has_some_memory():
    assert 1e8 < meshing.machine_memory() < 1e15


# Meridians


def test_meridian_runs_from_the_contact_to_the_top_and_encloses_the_volume():
    x = graded_meridian(0.03, 0.09)
    r, z = x.T
    assert r[0] == r[-1] == 0.0 and z[0] == 0.0 and np.all(r[1:-1] > 0.0) and np.all(np.diff(z) > 0.0)
    cones = np.pi / 3.0 * (r[:-1] ** 2 + r[:-1] * r[1:] + r[1:] ** 2) * np.diff(z)
    assert cones.sum() == pytest.approx(VOLUME, rel=1e-14)
    length = np.linalg.norm(np.diff(x, axis=0), axis=1)
    assert length.min() == pytest.approx(0.03, rel=0.1) and length.max() == pytest.approx(0.09, rel=0.1)


# Turned about the axis


@pytest.mark.parametrize("staggered", [False, True])
@pytest.mark.parametrize("sectors", [3, 12])
def test_revolved_meridian_is_a_closed_outward_sphere(sectors, staggered):
    x = graded_meridian(0.1, 0.2)
    vertices, faces, node = revolved(x, sectors, staggered)
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    check_mesh(mesh)
    assert len(vertices) == 2 + sectors * (len(x) - 2)
    assert np.bincount(node).tolist() == [1, *[sectors] * (len(x) - 2), 1]
    assert np.hypot(vertices[:, 0], vertices[:, 1]) == pytest.approx(x[node, 0], abs=1e-16)
    assert np.array_equal(vertices[:, 2], x[node, 1])


def test_staggered_triangles_are_mirror_images_of_themselves():
    """Every other ring is half a sector ahead: x -> -y maps the mesh to itself, with no lean to either side."""
    vertices, faces, _ = revolved(graded_meridian(0.1, 0.2), 10, staggered=True)
    distance, image = cKDTree(vertices).query(vertices * [1.0, -1.0, 1.0])
    assert distance.max() < 1e-15
    assert {frozenset(face) for face in image[faces]} == {frozenset(face) for face in faces}
    vertices, faces, _ = revolved(graded_meridian(0.1, 0.2), 10)
    _, image = cKDTree(vertices).query(vertices * [1.0, -1.0, 1.0])
    assert {frozenset(face) for face in image[faces]} != {frozenset(face) for face in faces}


@pytest.mark.parametrize("staggered", [False, True])
def test_revolved_area_converges_to_that_of_the_cones_at_second_order(staggered):
    x = graded_meridian(0.05, 0.1)
    slant = np.linalg.norm(np.diff(x, axis=0), axis=1)
    cones = np.pi * np.sum((x[1:, 0] + x[:-1, 0]) * slant)
    sectors = np.array([64, 128, 256, 512])
    areas = [trimesh.Trimesh(*revolved(x, n, staggered)[:2], process=False).area for n in sectors]
    order = -np.polyfit(np.log(sectors), np.log(np.abs(cones - np.array(areas))), 1)[0]
    assert order == pytest.approx(2.0, abs=0.05)


# A mesh from a file


BALL = trimesh.creation.icosphere(2, 3.7)


@pytest.mark.parametrize("ending", ["ply", "obj", "stl", "off"])
def test_mesh_in_a_file_is_scaled_and_put_on_the_plane(tmp_path, ending):
    """An STL file repeats each vertex for each of its faces, in single precision."""
    file = tmp_path / f"cell.{ending}"
    BALL.export(file)
    x, faces = read_mesh(file)
    mesh = trimesh.Trimesh(x, faces, process=False)
    check_mesh(mesh)
    assert len(x) == len(BALL.vertices) and len(faces) == len(BALL.faces)
    assert mesh.volume == pytest.approx(VOLUME, rel=1e-13)
    assert x[:, 2].min() == 0.0 and x[:, 2].max() == pytest.approx(1.0, rel=0.02)  # facets hold less than the sphere
    digest = hashlib.sha256(file.read_bytes()).hexdigest()
    assert np.array_equal(read_mesh(file, digest)[0], x)
    with pytest.raises(CaseError, match=rf"^mesh\.file: {file}: is not the file that this case was made with"):
        read_mesh(file, digest[::-1])


def test_edges_and_area_of_a_mesh_are_measured():
    x, faces = graded_sphere(0.03, 0.09, "spiral")
    near, longest = meshing.measured_edges(x, faces)
    assert near == pytest.approx(0.03, rel=0.05) and 0.09 < longest < 0.16
    assert meshing.triangles_area(x, faces) == pytest.approx(trimesh.Trimesh(x, faces, process=False).area, rel=1e-14)


def test_vertices_of_no_face_are_left_out(tmp_path):
    lonely = trimesh.Trimesh(np.vstack([BALL.vertices, [[9.0, 9.0, -9.0]]]), BALL.faces, process=False)
    lonely.export(tmp_path / "cell.ply")
    x, _ = read_mesh(tmp_path / "cell.ply")
    assert len(x) == len(BALL.vertices)


@pytest.mark.parametrize(
    "change, reason",
    [
        (lambda v, f: (v, f[1:]), "an edge does not have exactly two faces; give a closed surface"),
        (lambda v, f: (v, f[:, ::-1]), r"faces are oriented inward \(negative volume\); reverse them"),
        (lambda v, f: (v, np.vstack([f[:1, ::-1], f[1:]])), "neighbouring faces are oriented differently"),
        (lambda v, f: (np.vstack([v, v + 9.0]), np.vstack([f, f + len(v)])), "Euler number 4 instead of 2"),
        (lambda v, f: (np.where(np.arange(len(v))[:, None] == 7, np.nan, v), f), "a vertex is not finite"),
        (lambda v, f: (v, f[:0]), "holds no triangles"),
    ],
)
def test_bad_mesh_in_a_file_is_refused_by_key_and_file(tmp_path, change, reason):
    vertices, faces = change(np.array(BALL.vertices), np.array(BALL.faces))
    trimesh.Trimesh(vertices, faces, process=False).export(tmp_path / "cell.ply")
    with pytest.raises(CaseError, match=rf"^mesh\.file: {tmp_path}/cell\.ply: {reason}.*\.$"):
        read_mesh(tmp_path / "cell.ply")


@pytest.mark.parametrize("name, content", [("cell.ply", b"ply\nformat ascii 1.0\nelement vertex 5\n"), ("cell.ply", b""),
                                           ("cell.txt", b"1 2 3\n"), ("cell.stl", b"\0" * 100), ("cell.obj", b"v 1 2\nf 1 2 9\n")])  # fmt: skip
def test_file_that_is_no_mesh_is_refused_by_key_and_file(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(CaseError, match=rf"^mesh\.file: {tmp_path}/{name}: [^\n]*\.$"):
        read_mesh(tmp_path / name)


def test_missing_file_is_refused_by_key_and_file(tmp_path):
    with pytest.raises(CaseError, match=rf"^mesh\.file: {tmp_path}/none\.ply: No such file or directory; give"):
        read_mesh(tmp_path / "none.ply")


# What is no mesh


def refused(vertices, faces, reason):
    with pytest.raises(ValueError, match=reason):
        check_mesh(trimesh.Trimesh(vertices, faces, process=False))
    with pytest.raises(ValueError, match=reason):
        build_surface(np.array(vertices), np.array(faces), 1.0)


def test_bad_meshes_are_refused_with_the_reason():
    ball = trimesh.creation.icosphere(1)
    vertices, faces = np.array(ball.vertices), np.array(ball.faces)
    check_mesh(ball)
    refused(vertices, faces[1:], "does not have exactly two faces")
    flipped = faces.copy()
    flipped[0] = flipped[0][::-1]
    refused(vertices, flipped, "oriented differently")
    refused(vertices, faces[:, ::-1], "oriented inward")
    torus = trimesh.creation.torus(1.0, 0.3, 8, 8)
    refused(torus.vertices, torus.faces, "Euler number 0")
    two = np.concatenate([vertices, vertices + 5.0]), np.concatenate([faces, faces + len(vertices)])
    refused(*two, "Euler number 4")
    flat = vertices.copy()
    flat[faces[0, 0]] = 0.5 * (flat[faces[0, 1]] + flat[faces[0, 2]])
    refused(flat, faces, "no area")


def test_bad_meridians_are_refused_with_the_reason():
    x = graded_meridian(0.1, 0.2)
    off_axis, inside, upside_down = x.copy(), x.copy(), x[::-1].copy()
    off_axis[0, 0] = 0.1
    inside[3, 0] = -0.1
    for bad, reason in ((off_axis, "on the axis"), (inside, "r <= 0"), (upside_down, "negative volume")):
        with pytest.raises(ValueError, match=reason):
            build_meridian(bad, 1.0)


def test_edges_grow_by_a_quarter_of_the_way_from_the_fine_zone():
    arc = np.array([0.0, 0.3, 0.4, 0.5, 2.0])
    assert edge_length(arc, 0.3, 0.03, 0.09) == pytest.approx([0.03, 0.03, 0.055, 0.08, 0.09], abs=1e-15)
