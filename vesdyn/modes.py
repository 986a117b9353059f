"""Azimuthal modes of an axisymmetric state: which of them grow, and how fast.

A meridian is turned into a triangulated surface of n equal sectors (`vesdyn.meshing.revolved`). Its stiffness is then
block-circulant: the forces that answer the displacement of one node of each ring give, by a Fourier transform over
the sectors, the stiffness K_m against all displacements u(s) exp(i m phi) at once. With numbers of receptors held
on their nodes and drag alone to slow it down, mode m behaves as

    drag A0 u' = -K_m u,     growth rate  sigma_m = -(smallest eigenvalue of K_m against A0) / drag.

Wrinkles of a membrane under the hoop tension T_2 < 0: sigma = (|T_2| k^2 - B k^4) / drag, fastest at
k^2 = |T_2| / (2 B), so a wavelength of 2 pi (2 B / |T_2|)^(1/2); without bending the shortest wave of the mesh wins.
"""
import numpy as np
import scipy.linalg

from vesdyn.adhesion import ligand_density
from vesdyn.balance import Balance, allocate, set_forces
from vesdyn.meshing import revolved
from vesdyn.substrate import is_held
from vesdyn.surface import build_surface

_NUDGE = 1e-6  # displacement [a0] of the central differences


class Modes:
    """Stiffness of the azimuthal modes of ``state`` of the axisymmetric ``sim`` (`vesdyn.spreading`).

    A ring moves along r, phi and z; its forces answer
    the motion of the two rings on either side at most. What the poles do is left out, so m = 0 and 1 are not right.
    """

    def __init__(self, sim, state, n_sectors):
        rest = sim.x_start
        self.n_sectors, self.rings, self.drag = n_sectors, len(rest) - 2, sim.case.drag
        membrane = sim.case.membrane
        vertices, faces, node = revolved(rest, n_sectors, staggered=True)
        body = build_surface(vertices, faces, membrane.shear_modulus, membrane.prestretch, membrane.thickness)
        self._x = revolved(state.x, n_sectors, staggered=True)[0]
        number = (state.number / np.bincount(node))[node]  # a ring shares its receptors out
        self._pressure = state.pressure
        ligands = ligand_density(sim.case.ligands, self._x)
        self._balance = Balance(body, sim.adhesion, 0.0, sim.volume_0, number, ligands, self._x)
        self._scratch = allocate(self._x)
        self.area = body.reference_area[1:-1:n_sectors]  # (n_rings,) of one node [a0^2]
        self._frame = self._frames()
        axial = self._forces(self._x)[:, 0, 2]
        self.held = np.array([is_held(z, f) for z, f in zip(self._x[1:-1:n_sectors, 2], axial)])  # by the plane
        self._answer = self._answers()

    def _frames(self):
        """Unit vectors (n_rings, n_sectors, 3, 3) along r, phi and z at each node."""
        self._angle = np.arctan2(self._x[1:-1, 1], self._x[1:-1, 0]).reshape(self.rings, self.n_sectors)
        frame = np.zeros((*self._angle.shape, 3, 3))
        frame[..., 0, 0] = frame[..., 1, 1] = np.cos(self._angle)
        frame[..., 0, 1], frame[..., 1, 0] = np.sin(self._angle), -np.sin(self._angle)
        frame[..., 2, 2] = 1.0
        return frame

    def _forces(self, x):
        """Forces (n_rings, n_sectors, 3) [kT/a0] along r, phi and z."""
        set_forces(self._balance, x, self._scratch)
        force = (self._scratch.nodal[:, :3] + self._pressure * self._scratch.nodal[:, 3:6])[1:-1]
        return np.einsum("rjac,rjc->rja", self._frame, force.reshape(*self._angle.shape, 3))

    def _answers(self):
        """Stiffness (n_rings, 5, n_sectors, 3, 3): forces on rings i - 2 ... i + 2 if ring i's first node moves."""
        answer = np.zeros((self.rings, 5, self.n_sectors, 3, 3))
        first = 1 + np.arange(self.rings) * self.n_sectors
        for start in range(5):  # every fifth ring at once: no force feels two of them
            moved = np.arange(start, self.rings, 5)
            for b in range(3):
                nudge = _NUDGE * self._frame[moved, 0, b]
                sides = []
                for sign in (1.0, -1.0):
                    x = self._x.copy()
                    x[first[moved]] += sign * nudge
                    sides.append(self._forces(x))
                stiffness = (sides[1] - sides[0]) / (2.0 * _NUDGE)
                for i in moved:
                    for ring in range(max(0, i - 2), min(self.rings, i + 3)):
                        answer[i, ring - i + 2, :, :, b] = stiffness[ring]
        return answer

    def growth_rates(self, modes):
        """Growth rate sigma_m (n_modes,) [D/a0^2] of the fastest shape of each of the ``modes``; negative: decay."""
        spectrum = np.fft.fft(self._answer, axis=2)
        return np.array([self._growth_rate(m, spectrum[:, :, m % self.n_sectors]) for m in modes])

    def _growth_rate(self, m, K):
        phase = np.exp(1j * m * self._angle[:, 0])
        band = np.zeros((9, 3 * self.rings), dtype=complex)  # lower form: band[row - column, column]
        for i in range(self.rings):
            for ring in range(i, min(self.rings, i + 3)):
                block = K[i, ring - i + 2] * phase[i] / phase[ring] / np.sqrt(self.area[i] * self.area[ring])
                for a in range(3):
                    for b in range(3):
                        row, column = 3 * ring + a, 3 * i + b
                        fixed = (a == 2 and self.held[ring]) or (b == 2 and self.held[i])
                        if row >= column and not fixed:
                            band[row - column, column] = block[a, b]
        band[0, 2::3][self.held] = np.abs(band[0]).max()  # out of the way
        lowest = scipy.linalg.eig_banded(band, lower=True, eigvals_only=True, select="i", select_range=(0, 0))[0]
        return -lowest / self.drag
