"""Decay of spherical harmonics by diffusion on a frozen sphere: c - 1 ~ exp(-l (l + 1) D t / R^2) Y_lm.

With D = 1 and R = 1/2 the rate is 4 l (l + 1). Zonal harmonics P_l(n . axis) about several axes, so that
every direction of a triangle mesh is met. The implicit Euler step turns the rate s into
(1 + s dt)^-1 a step, which is undone where the order in space is measured.
"""

import numpy as np
import pytest
from measure import fitted_order, forces, sphere
from scipy.special import eval_legendre

from vesdyn import receptors
from vesdyn.body import edge_conductances

AXES = {"pole": (0.0, 0.0, 1.0), "equator": (1.0, 0.0, 0.0), "oblique": tuple(np.array([1, 2, 3]) / 14**0.5)}
CASES = [("axisymmetric", "rings", "pole")] + [
    ("surface", layout, axis) for layout in ("scalloped", "spiral") for axis in AXES
]


def amplitudes(model, layout, axis, edge, degree, dt, steps):
    """Amplitude of the harmonic after 0 and ``steps`` steps."""
    x, body = sphere(model, edge, layout=layout)
    x[:, -1] += 1.0  # off the plane: no receptor is immobile
    area = forces(body, x)[2].copy()
    scratch = receptors.transport(len(x), len(body.edges))
    edge_conductances(body.topology, x, scratch.conductance)
    normal = x.copy()
    normal[:, -1] -= np.sum(area * x[:, -1]) / area.sum()
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    harmonic = eval_legendre(degree, normal @ AXES[axis][-x.shape[1] :])
    number = area * (1.0 + 0.5 * harmonic)
    before = np.sum((number - area) * harmonic)
    for _ in range(steps):
        assert receptors.step_receptors(body.edges, area, 1e9, np.ones(len(area)), dt, number, scratch)
    return before, np.sum((number - area) * harmonic)


@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("kind", CASES, ids="-".join)
def test_second_order_in_space(kind, degree):
    dt, steps, edges, exact = 1e-4, 20, (0.08, 0.04, 0.02), 4.0 * degree * (degree + 1)
    error = []
    for edge in edges:
        before, after = amplitudes(*kind, edge, degree, dt, steps)
        error.append(((before / after) ** (1.0 / steps) - 1.0) / dt / exact - 1.0)
    order = fitted_order(edges, error)
    print(f"{'-'.join(kind)} l = {degree}: relative error of the rate {np.array(error)}, order {order:.2f}")
    # on the spiral no two meshes are alike, hence the scatter
    assert order == pytest.approx(2.0, abs=0.4 if kind[1] == "spiral" else 0.15)
    assert abs(error[-1]) < 3e-3


@pytest.mark.parametrize("degree", [1, 2, 3])
@pytest.mark.parametrize("kind", CASES[:2], ids="-".join)
def test_first_order_in_time(kind, degree):
    """Against the same mesh with a step so short that its own error is undone as above."""
    edge, rate = 0.06, 4.0 * degree * (degree + 1)
    before, after = amplitudes(*kind, edge, degree, 1e-5, 10)
    rate = ((before / after) ** 0.1 - 1.0) / 1e-5  # of this mesh
    time = 1.0 / rate
    error, counts = [], np.array([8, 16, 32, 64])
    for steps in counts:
        before, after = amplitudes(*kind, edge, degree, time / steps, steps)
        error.append(after / before / np.exp(-1.0) - 1.0)
    order = fitted_order(time / counts, error)
    print(f"{'-'.join(kind)} l = {degree}: order in time {order:.2f}")
    assert order == pytest.approx(1.0, abs=0.06)
