"""The staggered scheme: receptors move on the membrane at rest, then the membrane moves under them.

One coupling step from t_n to t_(n+1) = t_n + dt:

    receptors   c_n -> c_(n+1) on the membrane x_n              (implicit, `vesdyn.receptors`)
    membrane    x_n -> x_(n+1) with the numbers N_(n+1) held     (balance (6), `vesdyn.relaxation`)
    ledger      elastic energy, adhesion work, dissipation

First order in dt. The driver knows a body by the functions of `vesdyn.body` only.
"""
import numpy as np

from vesdyn import receptors, relaxation
from vesdyn.adhesion import Adhesion, adhesion_traction, adhesion_work, set_boltzmann_exponents
from vesdyn.body import area_below, edge_conductances, elastic_energy, principal_tensions
from vesdyn.front import contact_radius
from vesdyn.meridian import build_meridian
from vesdyn.meshing import graded_meridian, graded_sphere
from vesdyn.surface import build_surface

BINDING_GAP = 0.02  # of the cutoff: membrane closer than this counts as bound
_HEAVIER = (1.0, 4.0, 16.0)  # a relaxation that diverged starts again with a larger fictitious mass


def build_body(case):
    """Start positions (n_nodes, d) [a0] and the body of ``case``."""
    mesh, membrane = case.mesh, case.membrane
    if case.model == "axisymmetric":
        x = graded_meridian(mesh.front_edge, mesh.far_edge)
        return x, build_meridian(x, membrane.shear_modulus, membrane.prestretch)
    x, faces = graded_sphere(mesh.front_edge, mesh.far_edge, mesh.layout)
    return x, build_surface(x, faces, membrane.shear_modulus, membrane.prestretch)


class Spreading:
    """A vesicle that spreads: the body, its surroundings, and the state at ``time`` [a0^2/D].

    ``x`` (n_nodes, d) [a0] are the node positions, ``number`` (n_nodes,) [c_r0 a0^2] the receptors they carry.
    """

    _STATE = (
        "time", "steps", "x", "x_before", "dt_before", "number", "pressure",
        "adhesion_work", "dissipation", "iterations", "residual", "clipped_edges",
    )

    def __init__(self, case):
        self.case = case
        self.x, self.body = build_body(case)
        self.adhesion = Adhesion(
            case.adhesion.traction, case.adhesion.cutoff, case.adhesion.ligand_ratio,
            case.receptors.frozen,
        )
        self.controls = relaxation.Controls(
            case.solver.tolerance, case.solver.max_iterations, case.solver.damping == "kinetic"
        )
        self.work = relaxation.workspace(self.x)
        self.transport = receptors.transport(self.x.shape[0], self.body.edges.shape[0])

        self.time, self.steps = 0.0, 0
        self.x_before, self.dt_before = self.x.copy(), 1.0
        self.pressure = self.adhesion_work = self.dissipation = self.residual = 0.0
        self.iterations = self.clipped_edges = 0
        self.number = np.zeros(self.x.shape[0])
        self.volume_0 = 0.0
        self.volume_0 = self._measure()
        self.number[:] = self.work.area  # c = 1
        self.number_0 = self.number.sum()
        self.elastic_energy_0 = elastic_energy(self.body, self.x)

    def advance(self, until):
        """Take one coupling step to time ``until`` [a0^2/D]; raise `RelaxationError` if there is no balance."""
        dt = until - self.time
        if not self.adhesion.frozen:
            self._step_receptors(dt)  # c_n -> c_(n+1) on x_n
        x_old, area_old = self.x, self.work.area.copy()
        self.x = self._relax_membrane(x_old, dt)  # x_n -> x_(n+1) under N_(n+1)
        self._measure()
        self._update_ledger(x_old, area_old, dt)
        if self.adhesion.frozen:
            self.number[:] = self.work.area
        self.x_before, self.dt_before = x_old, dt
        self.time, self.steps = until, self.steps + 1

    def _step_receptors(self, dt):
        self.clipped_edges = edge_conductances(self.body, self.x, self.transport.conductance)
        set_boltzmann_exponents(self.case.drift_number, self.adhesion, self.x, self.transport.exponent)
        status = receptors.step_receptors(
            self.body.edges, self.work.area, self.adhesion.ligand_ratio, dt, self.number, self.transport
        )
        if status != receptors.SOLVED:
            raise relaxation.RelaxationError(
                f"t = {self.time:.6g}, step {dt:.3g}: no receptor density was found; reduce time.step"
            )

    def _relax_membrane(self, x_old, dt):
        balance = self._balance(x_old, self.case.drag / dt)
        for heavier in _HEAVIER:
            x = self._warm_start(balance, dt)
            relaxation.set_fictitious_mass(balance, x, self.pressure, self.work)
            self.work.mass[:] *= heavier
            outcome = relaxation.relax(balance, self.controls, x, self.pressure, self.work)
            if outcome.status == relaxation.CONVERGED:
                break
        if outcome.status != relaxation.CONVERGED:
            raise relaxation.RelaxationError(
                relaxation.explain(outcome, self.controls, self.time, dt)
            )
        self.pressure, self.residual, self.iterations = (
            outcome.pressure, outcome.residual, outcome.iterations,
        )
        return x

    def _balance(self, x_old, viscosity):
        return relaxation.Balance(
            self.body, self.adhesion, viscosity, self.volume_0, self.number, x_old
        )

    def _warm_start(self, balance, dt):
        """Where the relaxation starts: ahead along the last motion, unless that leads uphill."""
        x_old = balance.x_old
        ahead = x_old + (x_old - self.x_before) * (dt / self.dt_before)
        ahead[:, -1] = np.maximum(ahead[:, -1], 0.0)
        still = x_old.copy()
        return min(
            ahead, still,
            key=lambda x: relaxation.incremental_potential(balance, x, self.pressure, self.work),
        )

    def _measure(self):
        """Set nodal areas at ``x``, and return the enclosed volume."""
        self.volume = relaxation.set_forces(self._balance(self.x, 0.0), self.x, self.work)
        return self.volume

    def _update_ledger(self, x_old, area_old, dt):
        self.adhesion_work += adhesion_work(
            self.adhesion, self.number, x_old, area_old, self.x, self.work.area
        )
        moved = np.sum((self.x - x_old) ** 2, axis=1)
        self.dissipation += self.case.drag / dt * np.sum(self.body.reference_area * moved)

    @property
    def density(self):
        """Receptor density c (n_nodes,) [c_r0] per current area."""
        return self.number / self.work.area

    @property
    def tensions(self):
        """Principal tensions (n_elements, 2) [kT/a0^2], larger first."""
        tension = np.zeros((len(self.body.elements), 2))
        principal_tensions(self.body, self.x, tension)
        return tension

    def history_row(self):
        """What is recorded at every coupling step, in the units of the model."""
        density, level = self.density, BINDING_GAP * self.adhesion.cutoff
        return {
            "time": self.time,
            "binding_area": area_below(self.body, self.x, level),
            "contact_radius": contact_radius(self.x, self.body.edges, level),
            "pressure": self.pressure,
            "volume_error": self.volume / self.volume_0 - 1.0,
            "receptor_number_error": 0.0 if self.adhesion.frozen else self.number.sum() / self.number_0 - 1.0,
            "density_min": density.min(),
            "density_max": density.max(),
            "membrane_area": self.work.area.sum(),
            "height": self.x[:, -1].max(),
            "elastic_energy": elastic_energy(self.body, self.x),
            "adhesion_work": self.adhesion_work,
            "dissipation": self.dissipation,
            "iterations": self.iterations,
            "residual": self.residual,
            "gap_min": self.x[:, -1].min(),
            "tension_min": self.tensions.min(),
            "clipped_edges": self.clipped_edges,
        }

    def frame(self):
        """Elements (n_elements, k), nodal arrays and element arrays to store or draw."""
        gap, tension = self.x[:, -1], self.tensions
        nodal = {
            "position": self.x.copy(),
            "density": self.density,
            "gap": gap.copy(),
            "traction": adhesion_traction_of(self.adhesion, gap, self.density),
        }
        return np.asarray(self.body.elements), nodal, {
            "tension_1": tension[:, 0], "tension_2": tension[:, 1],
        }

    def state(self):
        """Everything that changes in time, as arrays and numbers."""
        return {name: np.copy(value) if isinstance(value := getattr(self, name), np.ndarray) else value
                for name in self._STATE}

    def restore(self, state):
        """Continue from ``state`` with the bits of the run that saved it."""
        for name in self._STATE:
            setattr(self, name, state[name])
        self.x, self.x_before, self.number = (
            np.ascontiguousarray(state[name]) for name in ("x", "x_before", "number")
        )
        self._measure()


def adhesion_traction_of(adhesion, gap, density):
    """Traction (n,) [kT/a0^3] at ``gap`` (n,) [a0] and ``density`` (n,) [c_r0]."""
    return np.array([adhesion_traction(adhesion, d, c) for d, c in zip(gap, density)])
