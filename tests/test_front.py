"""The front cut out of the edges, on curves whose front is known."""

import numpy as np
import pytest
from measure import sphere, straight_shares

from vesdyn.body import area_below, set_shares_below
from vesdyn.front import (
    contact_radius,
    faces_on_plane,
    front_points,
    front_radius,
    front_shape,
    modulation,
    rim_radius,
)


def fan(center, radius, n):
    """Spokes from a point below the plane to a circle of twice the radius: z = 0 halfway on each."""
    angle = 2.0 * np.pi * np.arange(n) / n
    rim = np.stack([2 * radius * np.cos(angle), 2 * radius * np.sin(angle), np.ones(n)], axis=1)
    x = np.concatenate([[[0.0, 0.0, -1.0]], rim]) + [*center, 0.0]
    return x, np.stack([np.zeros(n, dtype=int), 1 + np.arange(n)], axis=1)


def test_points_are_interpolated_on_crossing_edges_only():
    x = np.array([[0.0, 0.0], [1.0, 0.2], [2.0, 0.6], [3.0, 0.9]])
    edges = np.array([[0, 1], [1, 2], [2, 3]])
    assert front_points(x, edges, straight_shares(x, edges, 0.3))[:, 0] == pytest.approx([1.25], abs=1e-15)
    assert front_points(x, edges[:, ::-1], straight_shares(x, edges[:, ::-1], 0.3))[:, 0] == pytest.approx([1.25], abs=1e-15)
    assert len(front_points(x, edges, straight_shares(x, edges, 1.0))) == len(front_points(x, edges, straight_shares(x, edges, -1.0))) == 0


def test_meridian_has_one_radius_its_outermost_crossing():
    x = np.array([[0.0, 0.4], [0.1, 0.0], [0.3, 0.0], [0.5, 0.4]])  # lifted in the middle
    edges = np.array([[0, 1], [1, 2], [2, 3]])
    assert front_radius(x, edges, straight_shares(x, edges, 0.1)) == pytest.approx([0.35], abs=1e-15)


def test_circle_off_the_axis_is_measured_about_its_own_centre():
    x, edges = fan((0.3, -0.2), 0.25, 60)
    radius = front_radius(x, edges, straight_shares(x, edges, 0.0))
    assert radius.shape == (360,)
    assert radius == pytest.approx(0.25, abs=1e-15)
    assert contact_radius(x, edges, straight_shares(x, edges, 0.0)) == pytest.approx(0.25, abs=1e-15)


def test_a_mode_of_the_front_is_found_at_its_angle():
    x, edges = fan((0.0, 0.0), 0.25, 720)
    turn = 2.0 * np.pi * np.arange(720) / 720
    x[1:, :2] *= (1.0 + 0.02 * np.cos(3 * turn))[:, None]
    modes = np.fft.rfft(front_radius(x, edges, straight_shares(x, edges, 0.0))) / 180
    assert abs(modes[3]) == pytest.approx(0.02 * 0.25, rel=1e-3)  # linear between points half a degree apart
    assert np.abs(np.delete(modes, [0, 3])).max() < 1e-5


@pytest.mark.parametrize("columns", [2, 3])
def test_no_contact_no_front(columns):
    x = np.ones((3, columns))
    edges = np.array([[0, 1], [1, 2]])
    assert len(front_radius(x, edges, straight_shares(x, edges, 0.1))) == 0
    assert contact_radius(x, edges, straight_shares(x, edges, 0.1)) == 0.0


@pytest.mark.parametrize("model", ["axisymmetric", "surface"])
def test_an_annulus_is_counted_as_one(model):
    """A contact disc whose centre is lifted to a cone: its area is missing, and its rim is not the front."""
    flat, body = sphere(model, 0.02, 0.05, thickness=0.0)
    r = np.hypot(*flat[:, :-1].T) if model == "surface" else flat[:, 0]
    flat[:, -1] = np.where(flat[:, -1] < 0.1, 0.0, flat[:, -1])  # a disc of radius 0.3
    lifted = flat.copy()
    cone = (r < 0.1) & (flat[:, -1] == 0.0)
    lifted[cone, -1] = 0.1 - r[cone]
    area, radius = {}, {}
    for name, x in (("disc", flat), ("annulus", lifted)):
        share = np.zeros(len(body.edges))
        set_shares_below(body.topology, x, 0.002, share)
        area[name], radius[name] = area_below(body.topology, x, 0.002, share), contact_radius(x, body.edges, share)
    assert area["disc"] - area["annulus"] == pytest.approx(np.pi * 0.1**2, rel=0.1)  # half an edge of the rim
    assert radius["annulus"] == pytest.approx(radius["disc"], rel=1e-3)


def test_front_shape_of_a_circular_turn():
    turn = np.linspace(0.0, 1.2, 400)
    circle = 0.3 + 0.05 * np.sin(turn), 0.05 * (1.0 - np.cos(turn))
    rise = np.linspace(0.0, 0.3, 50)[1:]
    r = np.concatenate([np.linspace(0.0, 0.3, 50)[:-1], circle[0], circle[0][-1] + rise * np.cos(1.2)])
    z = np.concatenate([np.zeros(49), circle[1], circle[1][-1] + rise * np.sin(1.2)])
    shape = front_shape(np.column_stack([r, z]), cutoff=0.1)
    assert shape.radius_of_curvature == pytest.approx(0.05, rel=1e-3)
    assert shape.spreading_angle == pytest.approx(1.2, rel=1e-3)
    assert shape.lower_angle < 1.2 == pytest.approx(shape.upper_angle, rel=1e-3)  # the lower one is in the turn


def test_rim_of_the_faces_that_lie_on_the_plane():
    n = 60
    angle = 2.0 * np.pi * np.arange(n) / n
    inner, outer = (np.stack([r * np.cos(angle), r * np.sin(angle), 0.0 * angle], axis=1) for r in (0.3, 0.5))
    outer[:, 2] = 0.1  # above the plane
    x = np.concatenate([[[0.0, 0.0, 0.0]], inner, outer]) + [0.2, -0.1, 0.0]
    i, j = np.arange(n), (np.arange(n) + 1) % n
    disc, ring = np.stack([0 * i, 1 + i, 1 + j], axis=1), np.stack([1 + i, 1 + n + i, 1 + j], axis=1)
    landed = faces_on_plane(np.concatenate([ring, disc]), x[:, 2])
    assert np.array_equal(landed, disc)
    assert rim_radius(x, landed) == pytest.approx(0.3, rel=1e-12)


def test_modulation_of_a_wavy_front():
    angle = np.linspace(-np.pi, np.pi, 360, endpoint=False)
    wavy = 0.4 * (1.0 + 0.02 * np.cos(3 * angle))
    assert modulation(wavy) == pytest.approx(0.02 / 2**0.5, rel=1e-12)
    assert modulation(wavy - 0.4, np.full(360, 0.4)) == pytest.approx(0.02 / 2**0.5, rel=1e-12)
    assert modulation(np.full(360, 0.4)) == pytest.approx(0.0, abs=1e-15)
