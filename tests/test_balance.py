"""The balance of one step: its tangent against dense differences, its symmetry, the banded one of a meridian."""

import numpy as np
import pytest
from measure import BODIES, balance_of, forces, shaken, sphere

from vesdyn.balance import allocate, apart, force_scale, incremental_potential, set_forces, set_stiffness_bound, tangent
from vesdyn.body import neighbours
from vesdyn.newton import BANDS, set_tangent

PRESSURE = 1.3


def spread(model, thickness, frozen=False, ligand_ratio=8.0, seed=0):
    """A shaken, stretched shape low above the plane, no node on it, and its balance with every force of (6)."""
    x, body = sphere(model, 0.12, 0.2, 1.81, 1.05, "spiral", thickness)
    balance = balance_of(body, x, viscosity=35.0, traction=2.416, cutoff=0.4, frozen=frozen)
    adhesion = balance.adhesion._replace(ligand_ratio=ligand_ratio)
    y = shaken(1.1 * x, 0.01, seed)
    y[:, -1] += 0.02
    return y, balance._replace(adhesion=adhesion)


def dense(balance, x, step):
    """-dF/dx by displacing one coordinate after the other."""
    n, d = x.shape
    K, scratch = np.zeros((n * d, n * d)), allocate(x)
    for column, (i, k) in enumerate(np.ndindex(n, d)):
        for side in (1.0, -1.0):
            y = x.copy()
            y[i, k] += side * step
            set_forces(balance, y, scratch)
            K[:, column] -= (
                side * (scratch.nodal[:, :d] + PRESSURE * scratch.nodal[:, d : 2 * d]).ravel() / (2 * step)
            )
    return K


def free(x):
    """The coordinates that a body does not hold fast: all but the r of the poles of a meridian."""
    at = np.arange(x.size)
    return np.setdiff1d(at, [0, x.size - 2]) if x.shape[1] == 2 else at


@pytest.mark.parametrize(
    "kind", [{}, {"frozen": True}, {"ligand_ratio": 0.8}], ids=["held", "frozen", "saturated"]
)
@pytest.mark.parametrize("thickness", [0.0, 0.1], ids=["membrane", "shell"])
@pytest.mark.parametrize("model", BODIES)
def test_tangent_against_dense_differences(model, thickness, kind):
    x, balance = spread(model, thickness, **kind)
    K = tangent(balance, x, PRESSURE, allocate(x))
    # the dense ones extrapolated to fourth order: h^4 and round-off are both far below the h^2 of the sparse ones
    coarse, fine = dense(balance, x, 2e-5), dense(balance, x, 1e-5)
    exact = (4.0 * fine - coarse) / 3.0
    assert K.format == "csr" and K.shape == (x.size, x.size)
    difference = np.abs(K.toarray() - exact).max() / np.abs(exact).max()
    print(f"{model}, thickness {thickness}: largest difference {difference:.1e} of the largest entry")
    assert difference < 1e-8  # forces of round-off 1e-16, over steps of 1e-6
    d = x.shape[1]
    assert not np.any(exact[np.kron(neighbours(balance.body).toarray() == 0.0, np.ones((d, d))) > 0.0])


@pytest.mark.parametrize("thickness", [0.0, 0.1], ids=["membrane", "shell"])
@pytest.mark.parametrize("model", BODIES)
def test_tangent_is_symmetric_where_there_is_a_potential(model, thickness):
    def asymmetry(**kind):
        x, balance = spread(model, thickness, **kind)
        K = tangent(balance, x, PRESSURE, allocate(x)).toarray()[np.ix_(free(x), free(x))]
        return np.abs(K - K.T).max() / np.abs(K).max()

    assert asymmetry() < 1e-8
    assert asymmetry(frozen=True) > 1e-4 and asymmetry(ligand_ratio=0.8) > 1e-4  # the load follows the area


@pytest.mark.parametrize("model", BODIES)
def test_tangent_is_the_second_derivative_of_the_potential(model):
    x, balance = spread(model, 0.1)
    direction, scratch = shaken(0.0 * x, 1.0, 3), allocate(x)
    h = 1e-4
    low, mid, high = (
        incremental_potential(balance, x + s * h * direction, PRESSURE, scratch) for s in (-1, 0, 1)
    )
    K = tangent(balance, x, PRESSURE, scratch)
    v = direction.ravel()
    assert v @ (K @ v) == pytest.approx((high - 2 * mid + low) / h**2, rel=1e-5)  # h^2, and 1e-16 / h^2 of it


@pytest.mark.parametrize("thickness", [0.0, 0.1], ids=["membrane", "shell"])
def test_banded_tangent_of_a_meridian_is_the_same(thickness):
    x, balance = spread("axisymmetric", thickness)
    band = np.zeros((2 * BANDS + 1, x.size))
    set_tangent(balance, x, PRESSURE, allocate(x), band)
    K = tangent(balance, x, PRESSURE, allocate(x)).toarray()
    banded = np.zeros_like(K)
    for column in range(x.size):
        for row in range(max(0, column - BANDS), min(x.size, column + BANDS + 1)):
            banded[row, column] = band[BANDS + row - column, column]
    assert np.abs(banded - K).max() < 1e-7 * np.abs(K).max()  # its differences are ten times shorter


@pytest.mark.parametrize("thickness", [0.0, 0.1], ids=["membrane", "shell"])
@pytest.mark.parametrize("model", BODIES)
def test_neighbours_are_the_nodes_whose_forces_change(model, thickness):
    x, body = sphere(model, 0.15, 0.2, 1.3, 1.0, "spiral", thickness)
    x = shaken(1.1 * x, 0.01, 0)
    pattern = neighbours(body).toarray() > 0.0
    assert np.array_equal(pattern, pattern.T)
    before, felt = forces(body, x)[0], np.zeros_like(pattern)
    for i in range(len(x)):
        for k in range(x.shape[1]):
            y = x.copy()
            y[i, k] += 1e-3
            felt[:, i] |= np.any(forces(body, y)[0] != before, axis=1)
    assert not np.any(felt & ~pattern)
    assert np.mean(felt[pattern]) > 0.95  # and hardly more: a pole's r is held
    colours = apart(neighbours(body))
    assert all(len(set(colours[row])) == row.sum() for row in pattern)


@pytest.mark.parametrize("model", BODIES)
def test_mass_is_above_the_stiffness_of_drag_and_adhesion(model):
    """Of a node: viscosity A0 of the drag, and T_max N / d_c by which the load falls with the gap."""
    x, balance = spread(model, 0.0)
    without_drag = balance._replace(viscosity=0.0)
    without_adhesion = balance._replace(adhesion=balance.adhesion._replace(traction=0.0))
    full, dragless, loose = np.zeros((3, len(x)))
    for problem, bound in ((balance, full), (without_drag, dragless), (without_adhesion, loose)):
        set_stiffness_bound(problem, x, PRESSURE, bound)
    assert full - dragless == pytest.approx(35.0 * balance.body.reference_area, rel=1e-9)
    assert full - loose == pytest.approx(2.416 * balance.number / 0.4, rel=1e-9)


def test_residuals_are_measured_against_the_traction():
    """Which moves all, however stiff the membrane is; against K where there is none."""
    _, balance = spread("axisymmetric", 0.0)
    assert force_scale(balance) == 2.416
    assert force_scale(balance._replace(adhesion=balance.adhesion._replace(traction=0.0))) == 1.81
