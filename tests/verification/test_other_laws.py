"""The double well and patterned ligands against solutions made another way.

Statics at frozen density and fixed volume, without drag and bending, K = 1: the axisymmetric membrane equations with
the load q = T_max l(r) f(z) along -z on the free membrane,

    T1' = R l1 [cos(theta) (T2 - T1)/r + q sin(theta)],    theta' = R l1 (p + q cos(theta) - T2 sin(theta)/r) / T1,

integrated from the middle of the contact disc (flat, carried by the plane) and from the top to the edge of the disc,
where r, T1 and z agree, theta = 0 (no kink: the traction is finite) and the volume is V0. The same integration
reproduces the table of the linear law.

Transport: the state without flux on the undeformed sphere that touches the plane, c = C exp(phi), C from the count; the
sphere's area is uniform in z and in the azimuth.
"""

import functools

import numpy as np
import pytest
from measure import adhered, forces, marched, row_of, sphere, static_case, static_state
from scipy.integrate import quad, solve_ivp
from scipy.optimize import fsolve

from vesdyn import adhesion, receptors
from vesdyn.body import edge_conductances
from vesdyn.case import Adhesion, Ligands
from vesdyn.spreading import Spreading

RADIUS, POLE = 0.5, 1e-4
CUTOFF, STRETCH = 0.1, 1.1
WELL = {"law": "double_well", "well": 0.4, "barrier": 0.2, "tail": 0.1}
DISC = {"pattern": "disc", "width": 0.5, "blur": 0.1, "elsewhere": 0.2}


def meridional_stretch(T1, l2):
    """Solve T1 = l1/l2 - (l1 l2)^-3 for l1 by Newton's method."""
    l1 = 1.0
    for _ in range(100):
        step = (l1 / l2 - (l1 * l2) ** -3 - T1) / (1.0 / l2 + 3.0 * l1**-4 * l2**-3)
        l1 = max(l1 - step, 0.3 * l1)
        if abs(step) < 1e-15:
            break
    return l1


def slopes(psi, y, p, load):
    """Derivatives of r, z, T1, theta and the volume below along the reference polar angle ``psi``."""
    r, z, T1, theta, _ = y
    l2 = r / (RADIUS * np.sin(psi))
    l1 = meridional_stretch(T1, l2)
    T2, ds = l2 / l1 - (l1 * l2) ** -3, RADIUS * l1
    q = load(r, z)
    turn = (p + q * np.cos(theta) - T2 * np.sin(theta) / r) / T1 if p is not None else 0.0
    return [
        ds * np.cos(theta), ds * np.sin(theta), ds * (np.cos(theta) * (T2 - T1) / r + q * np.sin(theta)), ds * turn,
        np.pi * r**2 * ds * np.sin(theta),
    ]  # fmt: skip


def shot(unknowns, load):
    """States at the edge of the contact, from the disc and from the top; ``unknowns`` as in `static_solution`."""
    stretch_pole, psi_edge, stretch_top, p, height = unknowns
    tension = 1.0 - np.array([stretch_pole, stretch_top]) ** -6
    r = RADIUS * POLE * stretch_top
    disc = [RADIUS * POLE * stretch_pole, 0.0, tension[0], 0.0, 0.0]
    top = [r, height, tension[1], np.pi - p * r / (2.0 * tension[1]), 0.0]
    how = {"rtol": 1e-9, "atol": 1e-11}
    disc = solve_ivp(slopes, (POLE, psi_edge), disc, args=(None, lambda r, z: 0.0), **how).y[:, -1]
    return disc, solve_ivp(slopes, (np.pi - POLE, psi_edge), top, args=(p, load), **how).y[:, -1]


def static_solution(load, start):
    """Pressure, height and contact radius for the ``load(r, z)``; ``start``: a first guess of the unknowns."""

    def mismatch(unknowns):
        disc, free = shot(unknowns, load)
        return [
            disc[0] - free[0], disc[2] - free[2], free[3], free[1], -free[4] - STRETCH**3 * np.pi / 6.0,
        ]  # fmt: skip

    unknowns = fsolve(mismatch, start, xtol=1e-10)
    assert np.abs(mismatch(unknowns)).max() < 1e-6  # what the kinks of a law leave the integration
    disc, _ = shot(unknowns, load)
    return {"pressure": unknowns[3], "height": unknowns[4], "contact_radius": disc[0]}, unknowns


def load_of(traction, law, ligands):
    """q(r, z) of a law and a pattern, lengths of the prestretched sphere in units of its radius times 2."""
    law, ligands = adhesion.LAWS[law.law](law), ligands

    def load(r, z):
        below = adhesion.ligand_density(ligands, np.array([[r / STRETCH, z]]))[0]
        return traction * below * adhesion.shape(law, z / STRETCH)

    return load


@functools.cache
def path_to(traction, scene):
    """Solution of the linear law of the table, led to another law and pattern in ten steps."""
    law, ligands = SCENES[scene]
    row = row_of("adhesion_cohesive", prestretch=STRETCH, traction=traction)
    start = [1.05, 2.0 * row["contact_radius"] / STRETCH, 1.12, row["pressure"], row["height"]]
    linear = load_of(traction, Adhesion(cutoff=CUTOFF / STRETCH), Ligands())
    other = load_of(traction, law, ligands)
    solution, start = static_solution(linear, start)
    assert solution == pytest.approx({key: row[key] for key in solution}, rel=1e-6)  # digits of the table
    for share in np.linspace(0.1, 1.0, 10):
        solution, start = static_solution(lambda r, z: (1 - share) * linear(r, z) + share * other(r, z), start)
    return solution


SCENES = {
    "double well": (Adhesion(cutoff=CUTOFF / STRETCH, **WELL), Ligands()),
    "disc of ligands": (Adhesion(cutoff=CUTOFF / STRETCH), Ligands(**DISC)),
}


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize(
    "model, edge, error",
    [("axisymmetric", 0.005, 0.004), ("surface", 0.03, 0.04), pytest.param("surface", 0.015, 0.012, marks=pytest.mark.verify)],
)
@pytest.mark.verify
def test_static_state(scene, model, edge, error):
    """Pressure and height to a tenth of the error allowed the contact radius, which the mesh reads worst."""
    traction = 2.0
    law, ligands = SCENES[scene]
    exact = path_to(traction, scene)
    case = static_case(
        model, edge, traction, STRETCH, adhesion=law.model_dump(exclude={"traction", "cutoff"}),
        ligands=ligands.model_dump(), tolerance=1e-5, layout="scalloped", far_edge=2 * edge,
    )  # fmt: skip
    found = static_state(marched(Spreading(case), (1.0, 2.0, 3.0)))  # a step feels the ligands seen ahead
    off = {key: abs(found[key] / exact[key] - 1.0) for key in exact}
    print(f"{scene}, {model}, edge {edge}: {off}")
    assert off["contact_radius"] < error
    assert max(off["pressure"], off["height"]) < error / 2
    plain = adhered(model, 0.03, traction, STRETCH)
    assert abs(plain["contact_radius"] / found["contact_radius"] - 1.0) > 5 * error  # the law does make a difference


def settled(model, edge, law, ligands, drift_number):
    """Density, exponent and area on the undeformed sphere after a long time."""
    x, body = sphere(model, edge, 2.0 * edge, layout="scalloped")
    area = forces(body, x)[2].copy()
    below = adhesion.ligand_density(ligands, x)
    transport = receptors.transport(len(x), len(body.edges))
    edge_conductances(body.topology, x, transport.conductance)
    pull = adhesion.TractionSeparation(adhesion.LAWS[law.law](law), 1.0, 1e9, False)
    adhesion.set_boltzmann_exponents(drift_number, pull, below, x, transport.exponent)
    number = area.copy()
    for dt in (1e-2, 0.1, 1.0, 1e2, 1e4, 1e4):
        assert receptors.step_receptors(body.edges, area, 1e9, below, dt, number, transport)
    return x, number / area, transport.exponent, area


@pytest.mark.parametrize("model", ["axisymmetric", "surface"])
def test_state_without_flux_of_the_double_well(model):
    law = Adhesion(cutoff=0.2, **WELL)
    drift = 40.0
    _, density, exponent, _ = settled(model, 0.04, law, Ligands(), drift)
    shape = adhesion.LAWS["double_well"](law)
    mean = quad(lambda z: np.exp(drift * adhesion.integral(shape, z)), 0.0, 1.0, points=list(shape.knot[1:]), limit=200)[0]
    assert exponent.min() < 0.0 < exponent.max()  # the barrier keeps receptors away
    assert density / np.exp(exponent) == pytest.approx(1.0 / mean, rel=5e-3)  # quadrature of the mesh; nodally exact
    assert np.ptp(density / np.exp(exponent)) * mean < 1e-6  # the solver's 1e-12 of the fullest node


def test_state_without_flux_over_stripes():
    law, stripes, drift = Adhesion(cutoff=0.2), Ligands(pattern="stripes", width=0.2, period=0.4, blur=0.1), 30.0
    x, density, exponent, _ = settled("surface", 0.03, law, stripes, drift)
    z, phi = (np.arange(400) + 0.5) / 400, 2 * np.pi * (np.arange(720) + 0.5) / 720
    z, phi = np.meshgrid(z, phi, indexing="ij")
    r = np.sqrt(z * (1.0 - z))
    points = np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1).reshape(-1, 3)
    near = np.maximum(0.0, 1.0 - points[:, 2] / 0.2)
    exact = np.exp(drift * adhesion.ligand_density(stripes, points) * 0.1 * near**2)
    assert density / np.exp(exponent) == pytest.approx(1.0 / exact.mean(), rel=0.02)
    assert np.ptp(density / np.exp(exponent)) * exact.mean() < 1e-6
    low = x[:, 2] < 0.02
    assert density[low & (np.abs(x[:, 0]) < 0.05)].min() > 3 * density[low & (np.abs(np.abs(x[:, 0]) - 0.2) < 0.03)].max(initial=0.0)
