"""Graded spheres: closed, outward, of exact volume, symmetric where promised; bad meshes are refused."""

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from vesdyn.meridian import build_meridian
from vesdyn.meshing import FINE_ANGLE, check_mesh, edge_length, graded_meridian, graded_sphere
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
    ratio = length / edge_length(0.5 * polar, 0.5, front, far)
    assert 0.45 < ratio.min() and ratio.max() < 1.8  # six sectors, and whole numbers of edges, at the poles
    assert ratio[polar < FINE_ANGLE].mean() == pytest.approx(1.0, abs=0.1)
    assert ratio[polar > np.radians(130.0)].mean() == pytest.approx(1.0, abs=0.15)


def test_meridian_runs_from_the_contact_to_the_top_and_encloses_the_volume():
    x = graded_meridian(0.03, 0.09)
    r, z = x.T
    assert r[0] == r[-1] == 0.0 and z[0] == 0.0 and np.all(r[1:-1] > 0.0) and np.all(np.diff(z) > 0.0)
    cones = np.pi / 3.0 * (r[:-1] ** 2 + r[:-1] * r[1:] + r[1:] ** 2) * np.diff(z)
    assert cones.sum() == pytest.approx(VOLUME, rel=1e-14)
    length = np.linalg.norm(np.diff(x, axis=0), axis=1)
    assert length.min() == pytest.approx(0.03, rel=0.1) and length.max() == pytest.approx(0.09, rel=0.1)


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
