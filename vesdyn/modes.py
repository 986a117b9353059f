"""Azimuthal modes of an axisymmetric state: which of them grow, and how fast.

A meridian is turned into a triangulated surface of n equal sectors (`sectored_surface`). Its stiffness is then
block-circulant: the forces that answer the displacement of one node of each ring give, by a Fourier transform over
the sectors, the stiffness K_m against all displacements u(s) exp(i m phi) at once. With numbers of receptors held
on their nodes and drag alone to slow it down, mode m behaves as

    drag A0 u' = -K_m u,     growth rate  sigma_m = -(smallest eigenvalue of K_m against A0) / drag.

Wrinkles of a membrane under the hoop tension T_2 < 0: sigma = (|T_2| k^2 - B k^4) / drag, fastest at
k^2 = |T_2| / (2 B), so a wavelength of 2 pi (2 B / |T_2|)^(1/2); without bending the shortest wave of the mesh wins.
"""
import numpy as np
import scipy.linalg

from vesdyn import relaxation
from vesdyn.contact import is_held
from vesdyn.surface import build_surface

_NUDGE = 1e-6  # displacement [a0] of the central differences


def sectored_surface(x, n_sectors):
    """Vertices (n_vertices, 3) [a0] and outward faces of the meridian ``x`` (n_nodes, 2) in ``n_sectors``.

    First the lower pole, then ring by ring, then the upper pole; every other ring is turned by half a sector.
    """
    rings = len(x) - 2
    angle = 2.0 * np.pi / n_sectors * (np.arange(n_sectors) + 0.5 * (np.arange(rings) % 2)[:, None])
    r, z = x[1:-1, 0, None], np.broadcast_to(x[1:-1, 1, None], angle.shape)
    ring = np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=-1).reshape(-1, 3)
    vertices = np.concatenate([[[0.0, 0.0, x[0, 1]]], ring, [[0.0, 0.0, x[-1, 1]]]])
    j = np.arange(n_sectors)
    k = (j + 1) % n_sectors
    first, last = 1, 1 + (rings - 1) * n_sectors
    faces = [np.stack([np.zeros_like(j), first + k, first + j], axis=1)]
    for i in range(rings - 1):
        low, high = first + i * n_sectors, first + (i + 1) * n_sectors
        if i % 2 == 0:  # the upper ring is ahead by half a sector
            pairs = [(low + j, low + k, high + j), (low + k, high + k, high + j)]
        else:
            pairs = [(low + j, low + k, high + k), (low + j, high + k, high + j)]
        faces += [np.stack(corners, axis=1) for corners in pairs]
    faces.append(np.stack([np.full_like(j, len(vertices) - 1), last + j, last + k], axis=1))
    return vertices, np.concatenate(faces)


def mode_stiffness(sim, rest, n_sectors):
    """Stiffness of every azimuthal mode of the axisymmetric state of ``sim`` (`vesdyn.spreading.Spreading`).

    ``rest`` (n_nodes, 2) [a0] is the shape the run started from. Returns K (n_sectors, n_rings, 3, n_rings, 3) [kT/a0^2],
    K[m] for mode m, rows and columns as radial, azimuthal and axial displacements of a ring; the reference area
    (n_rings,) [a0^2]; and which axial displacements the plane holds (n_rings,). Modes 0 and 1 leave out what the
    poles do.
    """
    membrane = sim.case.membrane
    vertices, faces = sectored_surface(rest, n_sectors)
    body = build_surface(vertices, faces, membrane.shear_modulus, membrane.prestretch, membrane.thickness)
    x, _ = sectored_surface(sim.x, n_sectors)
    spread = np.repeat(sim.number[1:-1] / n_sectors, n_sectors)
    number = np.concatenate([sim.number[:1], spread, sim.number[-1:]])
    balance = relaxation.Balance(body, sim.adhesion, 0.0, sim.volume_0, number, x)
    work = relaxation.workspace(x)

    def force(y):
        relaxation.set_forces(balance, y, work)
        return (work.nodal[:, :3] + sim.pressure * work.nodal[:, 3:6])[1:-1].reshape(rings, n_sectors, 3)

    rings = len(sim.x) - 2
    angle = np.arctan2(x[1:-1, 1], x[1:-1, 0]).reshape(rings, n_sectors)
    frame = np.zeros((rings, n_sectors, 3, 3))  # radial, azimuthal, axial
    frame[..., 0, 0] = frame[..., 1, 1] = np.cos(angle)
    frame[..., 0, 1], frame[..., 1, 0] = np.sin(angle), -np.sin(angle)
    frame[..., 2, 2] = 1.0

    K = np.empty((n_sectors, rings, 3, rings, 3), dtype=complex)
    turn = np.exp(-1j * np.outer(np.arange(n_sectors), angle[:, 0]))  # (m, ring): phase of the ring's first node
    for i in range(rings):
        for b in range(3):
            nudged = [x.copy(), x.copy()]
            for y, sign in zip(nudged, (1.0, -1.0)):
                y[1 + i * n_sectors] += sign * _NUDGE * frame[i, 0, b]
            answer = (force(nudged[1]) - force(nudged[0])) / (2.0 * _NUDGE)
            local = np.einsum("rjac,rjc->rja", frame, answer)
            K[:, :, :, i, b] = np.fft.fft(local, axis=1).swapaxes(0, 1) * (turn * turn[:, i, None].conj())[..., None]
    at_rest = force(x)[:, 0, 2]
    held = np.array([is_held(x[1 + i * n_sectors, 2], at_rest[i]) for i in range(rings)])
    return K, body.reference_area[1:-1:n_sectors], held


def growth_rates(sim, rest, n_sectors):
    """Growth rate sigma_m (n_sectors // 2 - 1,) [D/a0^2] of the fastest shape of each mode m = 2, 3, ...

    Arguments as of `mode_stiffness`; negative rates are decay. Returns the modes and the rates.
    """
    K, area, held = mode_stiffness(sim, rest, n_sectors)
    free = np.ones((len(area), 3), dtype=bool)
    free[:, 2] = ~held
    free = np.flatnonzero(free)
    scale = 1.0 / np.sqrt(np.repeat(area, 3)[free])
    modes = np.arange(2, n_sectors // 2 + 1)
    rates = []
    for m in modes:
        matrix = K[m].reshape(3 * len(area), -1)[np.ix_(free, free)] * scale[:, None] * scale
        matrix = 0.5 * (matrix + matrix.conj().T)
        lowest = scipy.linalg.eigh(matrix, eigvals_only=True, subset_by_index=(0, 0))[0]
        rates.append(-lowest / sim.case.drag)
    return modes, np.array(rates)
