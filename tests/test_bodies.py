"""Both discretised membranes: forces are gradients, invariances, bounds, and each kernel against plain geometry."""

import numpy as np
import pytest
from measure import fitted_order, forces, shaken, sphere, stiffness_ratio, straight_shares
from numba.core.runtime import _nrt_python, rtsys

from vesdyn._jit import njit
from vesdyn.body import (
    add_elastic_forces,
    add_stiffness_bounds,
    area_below,
    edge_conductances,
    elastic_energy,
    element_areas,
    principal_tensions,
    set_shares_below,
)
from vesdyn.front import front_points
from vesdyn.kinds import KINDS

H = np.array([8e-3, 4e-3, 2e-3, 1e-3])  # relative steps: truncation far above round-off
SLOPE = 0.03  # a fitted slope differs from 2 by the next term of the series, about H^2


def shape(model, layout="rings", thickness=0.0, seed=0, prestretch=1.1, front_edge=0.12, size=0.02):
    """A randomly perturbed, stretched vesicle with K = 1.3."""
    x, body = sphere(model, front_edge, 0.2, 1.3, prestretch, layout, thickness)
    return shaken(x, size, seed), body


def direction(x, seed):
    """A random direction in which the membrane can move, of about one element."""
    return shaken(np.zeros_like(x), 0.1, seed + 100)


LAYOUTS = [("axisymmetric", "rings"), ("surface", "scalloped"), ("surface", "spiral")]


@pytest.fixture(
    params=[layout + (thickness,) for thickness in (0.0, 0.1) for layout in LAYOUTS],
    ids=lambda kind: "-".join(kind[:2]) + ("-shell" if kind[2] else ""),
)
def kind(request):
    """Model, layout and thickness: a pure membrane, or a shell so thick that bending carries its share."""
    return request.param


# Gradients


@pytest.mark.parametrize("seed", range(3))
def test_elastic_force_is_the_gradient_of_the_energy_to_second_order(kind, seed):
    x, body = shape(*kind, seed=seed)
    d = direction(x, seed)
    power = np.sum(forces(body, x)[0] * d)
    error = [(elastic_energy(body, x + h * d) - elastic_energy(body, x - h * d)) / (2 * h) + power for h in H]
    assert fitted_order(H, error) == pytest.approx(2.0, abs=SLOPE)


@pytest.mark.parametrize("seed", range(3))
def test_volume_gradient_is_that_of_the_volume_to_second_order(kind, seed):
    x, body = shape(*kind, seed=seed)
    d = direction(x, seed)
    rate = np.sum(forces(body, x)[1] * d)
    error = [(forces(body, x + h * d)[3] - forces(body, x - h * d)[3]) / (2 * h) - rate for h in H]
    assert fitted_order(H, error) == pytest.approx(2.0, abs=SLOPE)  # V is cubic: the error is one term


def test_each_component_of_the_gradients(kind):
    """Every coordinate of every node, by central differences extrapolated to fourth order."""
    x, body = shape(*kind)
    force, dV_dx, _, _ = forces(body, x)
    error_E = error_V = 0.0
    for i, k in np.ndindex(x.shape):
        if x.shape[1] == 2 and k == 0 and i in (0, len(x) - 1):
            assert force[i, 0] == dV_dx[i, 0] == 0.0  # a pole stays on the axis
            continue
        E, V = [], []
        for h in (1e-3, 5e-4):
            up, down = x.copy(), x.copy()
            up[i, k] += h
            down[i, k] -= h
            E.append((elastic_energy(body, up) - elastic_energy(body, down)) / (2 * h))
            V.append((forces(body, up)[3] - forces(body, down)[3]) / (2 * h))
        error_E = max(error_E, abs((4 * E[1] - E[0]) / 3 + force[i, k]))
        error_V = max(error_V, abs((4 * V[1] - V[0]) / 3 - dV_dx[i, k]))
    # h^4 times the fifth derivative (about edge^-4), and round-off 1e-16 / h
    assert error_E < 1e-6 * np.abs(force).max()
    assert error_V < 1e-11


def test_a_step_along_the_force_gains_its_work_up_to_second_order(kind):
    x, body = shape(*kind)
    force = forces(body, x)[0]
    steps = 1e-4 * np.array([1.0, 2.0, 4.0, 8.0])
    gain = np.array([elastic_energy(body, x) - elastic_energy(body, x + h * force) for h in steps])
    assert np.all(gain > 0.0)
    assert fitted_order(steps, gain - steps * np.sum(force**2)) == pytest.approx(2.0, abs=0.05)


# Invariances


def test_no_net_force_and_no_net_torque(kind):
    x, body = shape(*kind)
    for vectors in forces(body, x)[:2]:
        size = np.abs(vectors).sum()
        if kind[0] == "axisymmetric":
            assert abs(vectors[:, 1].sum()) < 1e-15 * size * len(x)
        else:
            assert np.abs(vectors.sum(axis=0)).max() < 1e-15 * size
            assert np.abs(np.cross(x, vectors).sum(axis=0)).max() < 1e-15 * size


def test_volume_is_homogeneous_of_degree_three(kind):
    x, body = shape(*kind)
    _, dV_dx, _, volume = forces(body, x)
    assert np.sum(x * dV_dx) == pytest.approx(3.0 * volume, rel=1e-13)
    assert forces(body, 2.0 * x)[3] == pytest.approx(8.0 * volume, rel=1e-14)


def test_inside_out_is_a_negative_volume(kind):
    x, body = shape(*kind)
    mirrored = x.copy()
    mirrored[:, -1] *= -1.0
    assert forces(body, mirrored)[3] == pytest.approx(-forces(body, x)[3], rel=1e-14)


@pytest.mark.parametrize("thickness", [0.0, 0.1], ids=["membrane", "shell"])
def test_nothing_moves_the_poles_of_a_meridian_off_the_axis(thickness):
    force, dV_dx, _, _ = forces(*shape("axisymmetric", thickness=thickness)[::-1])
    assert np.all(force[[0, -1], 0] == 0.0) and np.all(dV_dx[[0, -1], 0] == 0.0)
    assert np.all(force[[0, -1], 1] != 0.0)


def test_a_meridian_across_its_axis_is_no_shape():
    """Squares of stretches do not see r < 0, so the volume says it: a relaxation then diverges instead of going on."""
    x, body = shape("axisymmetric")
    assert np.isfinite(forces(body, x)[3])
    x[2, 0] *= -0.01
    assert np.isnan(forces(body, x)[3])


def test_rigid_motion_changes_nothing_but_directions(kind):
    x, body = shape(*kind)
    if kind[0] == "axisymmetric":
        turn, shift = np.eye(2), np.array([0.0, 0.7])
    else:
        turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
        turn *= np.sign(np.linalg.det(turn))
        shift = np.array([0.3, -0.5, 0.7])
    moved = x @ turn.T + shift
    before, after = forces(body, x), forces(body, moved)
    assert elastic_energy(body, moved) == pytest.approx(elastic_energy(body, x), rel=1e-13)
    assert after[3] == pytest.approx(before[3], rel=1e-13)
    for vectors, vectors_moved in zip(before[:2], after[:2]):
        assert np.abs(vectors @ turn.T - vectors_moved).max() < 1e-13 * np.abs(vectors).max() * len(x)
    assert np.abs(before[2] - after[2]).max() < 1e-15
    tension, tension_moved = np.zeros((2, len(body.elements), 2))
    principal_tensions(body, x, tension)
    principal_tensions(body, moved, tension_moved)
    # equal stretches are the root of a difference: round-off 1e-16 becomes 1e-8
    assert np.abs(tension - tension_moved).max() < 1e-7 if kind[0] == "surface" else 1e-13


def test_start_state_is_the_reference_stretched_uniformly(kind):
    x, body = shape(*kind, prestretch=1.1, size=0.0)
    area = forces(body, x)[2]
    assert body.reference_area * 1.21 == pytest.approx(area, rel=1e-12)
    W = 1.3 / 2.0 * (2 * 1.21 + 1.1**-4 - 3.0)
    assert elastic_energy(body, x) == pytest.approx(W * body.reference_area.sum(), rel=1e-12)
    tension = np.zeros((len(body.elements), 2))
    principal_tensions(body, x, tension)
    assert tension == pytest.approx(1.3 * (1.0 - 1.1**-6), abs=1e-7)


@pytest.mark.parametrize("prestretch", [1.0, 1.2])
@pytest.mark.parametrize("model, layout", LAYOUTS + [("surface", "shaken")])
def test_start_state_is_free_of_moments(model, layout, prestretch):
    """A shell's forces and energy at the start are those of the membrane: none without a prestretch."""
    (x, shell), (_, membrane) = (
        sphere(model, 0.12, None, 1.3, prestretch, layout, thickness) for thickness in (0.1, 0.0)
    )
    assert shell.bending_stiffness == pytest.approx(1.3 * 0.1**2 / 3.0) and membrane.bending_stiffness == 0.0
    assert np.abs(forces(shell, x)[0] - forces(membrane, x)[0]).max() < 1e-14  # moments of round-off
    assert elastic_energy(shell, x) == pytest.approx(elastic_energy(membrane, x), abs=1e-15)
    if prestretch == 1.0:
        assert np.abs(forces(shell, x)[0]).max() < 1e-14
    stretched = 1.1 * x  # n . x,ab grows by 1.1 and is there no longer that of the rest shape
    assert elastic_energy(shell, stretched) > elastic_energy(membrane, stretched)
    # rho = 0.1 b_0 on either axis, W_b = 3/2 B rho^2, b_0 = -prestretch^2 / R in lengths of the reference
    expected = 1.5 * shell.bending_stiffness * (0.1 * prestretch**2 / 0.5) ** 2 * np.pi / prestretch**2
    bending = elastic_energy(shell, stretched) - elastic_energy(membrane, stretched)
    assert bending == pytest.approx(expected, rel=0.1)  # facets, at 15 to a circumference


# Geometry, plainly


def test_element_areas_are_those_of_whole_elements(kind):
    """A square of two triangles; a cone of radii 1 and 2 and of height 1 (slant 2^(1/2), mean radius 3/2)."""
    if kind[0] == "surface":
        topology, x = KINDS["surface"].topology(np.array([[0, 1, 2], [0, 2, 3]])), np.eye(3)[[0, 0, 1, 1]] * 0.0
        x[[1, 2], 0] = x[[2, 3], 1] = 3.0
        assert element_areas(topology, x) == pytest.approx([4.5, 4.5])
    else:
        topology, x = KINDS["axisymmetric"].topology(np.array([[0, 1]])), np.array([[1.0, 0.0], [2.0, 1.0]])
        assert element_areas(topology, x) == pytest.approx([3.0 * np.pi * 2.0**0.5])


def test_nodal_areas_sum_to_the_area(kind):
    x, body = shape(*kind)
    area = forces(body, x)[2]
    assert area.min() > 0.0
    assert area.sum() == pytest.approx(element_areas(body.topology, x).sum(), rel=1e-14)


def test_triangle_tensions_against_the_singular_values_of_the_deformation_gradient():
    X, _ = shape("surface", size=0.0)
    X = X / 1.1  # stress-free
    x, body = shape("surface", seed=5)
    expected = []
    for face in body.elements:
        to_plane = np.linalg.qr((X[face[1:]] - X[face[0]]).T)[0].T
        F = (x[face[1:]] - x[face[0]]).T @ np.linalg.inv(to_plane @ (X[face[1:]] - X[face[0]]).T)
        l1, l2 = np.linalg.svd(F, compute_uv=False)
        T1 = 1.3 * (l1**2 - 1.0 / (l1 * l2) ** 2) / (l1 * l2)
        T2 = 1.3 * (l2**2 - 1.0 / (l1 * l2) ** 2) / (l1 * l2)
        expected.append((T1, T2))
    tension = np.zeros((len(body.elements), 2))
    principal_tensions(body, x, tension)
    assert tension == pytest.approx(np.array(expected), rel=1e-9, abs=1e-9)


def test_cone_tensions_against_lengths_and_circumferences():
    X, _ = shape("axisymmetric", size=0.0)
    X = X / 1.1
    x, body = shape("axisymmetric", seed=5)
    l1 = np.linalg.norm(np.diff(x, axis=0), axis=1) / np.linalg.norm(np.diff(X, axis=0), axis=1)
    l2 = (x[1:, 0] + x[:-1, 0]) / (X[1:, 0] + X[:-1, 0])
    tension = np.zeros((len(body.elements), 2))
    principal_tensions(body, x, tension)
    assert tension[:, 0] == pytest.approx(1.3 * (l1**2 - 1.0 / (l1 * l2) ** 2) / (l1 * l2), rel=1e-12, abs=1e-12)
    assert tension[:, 1] == pytest.approx(1.3 * (l2**2 - 1.0 / (l1 * l2) ** 2) / (l1 * l2), rel=1e-12, abs=1e-12)


def clipped_area(corners, level):
    """Area of the part of a triangle below ``level``: its polygon, clipped edge by edge."""
    polygon = []
    for p, q in zip(corners, np.roll(corners, -1, axis=0)):
        if p[2] <= level:
            polygon.append(p)
        if (p[2] <= level) != (q[2] <= level):
            polygon.append(p + (level - p[2]) / (q[2] - p[2]) * (q - p))
    total = np.zeros(3)
    for p, q in zip(polygon[1:-1], polygon[2:]):
        total += 0.5 * np.cross(p - polygon[0], q - polygon[0])
    return np.linalg.norm(total)


@pytest.mark.parametrize("level", [0.003, 0.02, 0.3, 0.9])
@pytest.mark.parametrize("layout", ["scalloped", "spiral"])
def test_triangle_area_below_a_level_against_clipped_polygons(layout, level):
    x, body = shape("surface", layout=layout)
    expected = sum(clipped_area(x[face], level) for face in body.elements)
    assert area_below(body.topology, x, level, straight_shares(x, body.edges, level)) == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("level", [0.003, 0.02, 0.3, 0.9])
def test_cone_area_below_a_level_against_fine_strips(level):
    x, body = shape("axisymmetric")
    strips = 2000
    share = (np.arange(strips) + 0.5) / strips
    expected = 0.0
    for a, b in x[body.elements]:
        r, z = a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])
        expected += np.sum(2.0 * np.pi * r * np.linalg.norm(b - a) / strips * (z < level))
    # at most one strip of each element that is cut is counted wrongly
    assert area_below(body.topology, x, level, straight_shares(x, body.edges, level)) == pytest.approx(expected, abs=3 * np.pi * 0.2 / strips)


def test_area_below_everything_and_below_nothing(kind):
    x, body = shape(*kind)
    share = np.full(len(body.edges), np.nan)
    set_shares_below(body.topology, x, 2.0, share)
    assert np.all(share == 1.0)
    assert area_below(body.topology, x, 2.0, share) == pytest.approx(element_areas(body.topology, x).sum(), rel=1e-13)
    lowest = x[:, -1].min()
    set_shares_below(body.topology, x, lowest, share)
    assert np.all(share == 0.0) and area_below(body.topology, x, lowest, share) == 0.0


@pytest.mark.parametrize("level", [1e-3, 0.02])
def test_shares_reach_at_least_as_far_as_straight_interpolation(kind, level):
    x, body = shape(*kind, size=0.005)
    x[:, -1] = np.maximum(x[:, -1] - 0.1, 0.0)
    share = np.full(len(body.edges), np.nan)
    set_shares_below(body.topology, x, level, share)
    straight = straight_shares(x, body.edges, level)
    assert np.all((share >= straight - 1e-14) & (share <= 1.0))
    assert np.array_equal(share == 0.0, straight == 0.0)


@pytest.mark.parametrize("position", [0.1, 0.5, 0.9])
def test_kink_of_a_meridian_is_found_inside_its_edge(position):
    """Flat up to r_c, then a cone of slope 0.02: found to the square of the slope, wherever it lies."""
    x, body = sphere("axisymmetric", 0.05)
    slope, element = 0.02, 5
    kink = (1.0 - position) * x[element, 0] + position * x[element + 1, 0]
    near = slice(0, 9)  # the sphere beyond is out of the way
    x[near, 1] = slope * np.maximum(0.0, x[near, 0] - kink)
    share = np.zeros(len(body.edges))
    set_shares_below(body.topology, x, 1e-12, share)
    (point,) = front_points(x, body.edges, share)
    assert point[0] == pytest.approx(kink, abs=0.05 * slope**2)


@pytest.mark.parametrize("position", [0.3, 0.5, 0.7])
def test_curvature_beyond_the_kink_of_a_meridian_counts(position):
    """Flat up to r_c, then z = s/10 + s^2/2: without the curvature a tenth of an edge is missing and more."""
    x, body = sphere("axisymmetric", 0.02)
    element = 8
    kink = (1.0 - position) * x[element, 0] + position * x[element + 1, 0]
    near = slice(0, 16)
    s = np.maximum(0.0, x[near, 0] - kink)
    x[near, 1] = 0.1 * s + 0.5 * s**2
    share = np.zeros(len(body.edges))
    set_shares_below(body.topology, x, 1e-12, share)
    (point,) = front_points(x, body.edges, share)
    assert point[0] == pytest.approx(kink, abs=0.02 * 0.02)


# Receptors' edges


def test_triangle_conductances_against_the_angles_facing_each_edge():
    x, body = shape("surface", size=0.035)
    expected = dict.fromkeys(map(tuple, body.edges), 0.0)
    for face in body.elements:
        for corner in range(3):
            i, j, k = face[corner], face[corner - 2], face[corner - 1]
            u, v = x[j] - x[i], x[k] - x[i]
            angle = np.arccos(u @ v / np.linalg.norm(u) / np.linalg.norm(v))
            expected[min(j, k), max(j, k)] += 0.5 / np.tan(angle)
    expected = np.array([expected[tuple(edge)] for edge in body.edges])
    conductance = np.zeros(len(body.edges))
    clipped = edge_conductances(body.topology, x, conductance)
    assert clipped == np.sum(expected < 0.0) > 0
    assert conductance == pytest.approx(np.maximum(expected, 0.0), abs=1e-12)


def test_cone_conductances_are_area_over_squared_length():
    x, body = shape("axisymmetric")
    x[:, 1] += 1.0  # off the plane
    conductance = np.zeros(len(body.edges))
    assert edge_conductances(body.topology, x, conductance) == 0
    length = np.linalg.norm(np.diff(x, axis=0), axis=1)
    assert conductance == pytest.approx(element_areas(body.topology, x) / length**2, rel=1e-13)


def test_an_element_conducts_nothing_when_all_its_nodes_touch(kind):
    x, body = shape(*kind, size=0.0, front_edge=0.1)
    touching = x[:, -1] < 0.15
    x[touching, -1] = 0.0
    conductance, of_free_elements = np.zeros(len(body.edges)), np.zeros(len(body.edges))
    edge_conductances(body.topology, x, conductance)
    held = touching[body.elements].all(axis=1)
    free_edges = {
        frozenset(pair) for element in body.elements[~held] for pair in zip(element, np.roll(element, 1))
    }
    free = np.array([frozenset(edge) in free_edges for edge in body.edges])
    assert 0 < free.sum() < len(free)
    assert np.all(conductance[~free] == 0.0)
    # the free elements alone: the held ones are taken out of a copy of the topology
    if kind[0] == "surface":
        topology = body.topology
        lifted = topology._replace(elements=topology.elements[~held], element_edges=topology.element_edges[~held])
        edge_conductances(lifted, x, of_free_elements)
        assert conductance == pytest.approx(of_free_elements, abs=1e-15)
    else:
        assert np.all(conductance[free] > 0.0)


# The bound on the stiffness


def flattened(x):
    """Pressed flat below, and drawn out above: strongly unequal stretches."""
    y = x.copy()
    y[:, -1] = np.maximum(0.0, x[:, -1] - 0.3) * 1.8
    y[:, :-1] *= 1.3
    return y


@pytest.mark.parametrize(
    "deformed, pressure",
    [(lambda x: x, 0.0), (lambda x: shaken(x, 0.02, 0), 1.0), (lambda x: 1.5 * x, 3.0),
     (lambda x: 2.0 * x, 1.3 * 1.97), (flattened, 2.0), (lambda x: x * 0.9, -0.3)],
    ids=["start", "shaken", "inflated", "inflated-twice", "flattened", "compressed"],
)
def test_stiffness_bound_is_above_the_largest_eigenvalue(kind, deformed, pressure):
    x, body = sphere(kind[0], 0.1, 0.15, 1.3, 1.05, *kind[1:])
    ratio = stiffness_ratio(body, deformed(x), pressure)
    print(f"{kind[0]} {kind[1]}: largest eigenvalue / bound = {ratio:.3f}")
    assert ratio < 1.0
    assert ratio > 0.3  # a bound several times too large would cost its root in iterations


@pytest.mark.parametrize("model", ["axisymmetric", "surface"])
@pytest.mark.parametrize("pressure", [1.0, -1.0])
def test_bound_of_the_fluid_alone(model, pressure):
    """Of a membrane as soft as none, held by the pressure: the curvature of the volume."""
    x, body = sphere(model, 0.25, 0.25, 1e-9, 1.0)
    ratio = stiffness_ratio(body, shaken(x, 0.02, 0), pressure)
    assert 0.1 < ratio < 1.0


@pytest.mark.parametrize("size", [0.0, 0.01, 0.03])
@pytest.mark.parametrize(
    "deformed", [lambda x: x, lambda x: 2.0 * x, flattened, lambda x: 0.85 * x],
    ids=["start", "inflated-twice", "flattened", "compressed"],
)  # fmt: skip
@pytest.mark.parametrize("model, layout", LAYOUTS + [("surface", "shaken")])
def test_bound_of_bending_alone(model, layout, deformed, size):
    """A proof stands behind it (Gerschgorin, vertex by vertex), so it holds on any mesh and shape."""
    x, body = sphere(model, 0.12, None, 1.3, 1.05, layout, 0.1)
    bending = body._replace(shear_modulus=0.0)  # its own stiffness was settled above
    ratio = stiffness_ratio(bending, shaken(deformed(x), size, 1), 0.0)
    print(f"{model} {layout} shaken {size}: largest eigenvalue / bound of bending = {ratio:.3f}")
    assert 0.5 < ratio < 1.0


# No allocation


@njit
def again_and_again(body, x, nodal, bound, times):
    """Forces and bounds, ``times`` times."""
    for _ in range(times):
        add_elastic_forces(body, x, nodal)
        add_stiffness_bounds(body, x, 1.0, bound)


@njit
def allocating(body, x, nodal, bound, times):
    """The same with an array made each time, which the compiler cannot leave out."""
    for _ in range(times):
        nodal += np.full(nodal.shape, bound[0])


def allocations(kernel, *arguments):
    before = rtsys.get_allocation_stats().alloc
    kernel(*arguments)
    return rtsys.get_allocation_stats().alloc - before


def test_forces_and_bounds_allocate_nothing(kind):
    """A hundred rounds allocate as much as one: what the call itself needs."""
    x, body = shape(*kind)
    arguments = body, x, np.zeros((len(x), 2 * x.shape[1] + 1)), np.zeros(len(x))
    _nrt_python.memsys_enable_stats()
    try:
        once, often = (allocations(again_and_again, *arguments, times) for times in (1, 100))
        assert often == once
        assert allocations(allocating, *arguments, 100) >= once + 99  # the counter counts
    finally:
        _nrt_python.memsys_disable_stats()
