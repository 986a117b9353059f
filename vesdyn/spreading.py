"""The staggered scheme: receptors move on the membrane, then the membrane moves under its receptors.

One coupling step from t_n to t_(n+1) = t_n + dt:

    look ahead  x_n -> x*_(n+1)                 along the last motion
    receptors   N_n -> N_(n+1) on x*_(n+1)      implicit, `vesdyn.receptors`
    membrane    x_n -> x_(n+1) under N_(n+1)    balance (6), `vesdyn.relaxation`
    ledger      adhesion work, dissipation

Order 2: both rates are backward differences over two steps (BDF2, variable step). Order 1, the scheme of
the paper: backward Euler, and the receptors move on x_n. The start is singular (the front runs as
the square root of time), so the first steps are of order 1 in any case.

The driver knows a body by the functions of `vesdyn.body` only.
"""
import zlib
from typing import NamedTuple

import numpy as np

from vesdyn import receptors, relaxation
from vesdyn.adhesion import Adhesion, adhesion_traction, adhesion_work, set_boltzmann_exponents
from vesdyn.body import (
    area_below,
    edge_conductances,
    elastic_energy,
    principal_tensions,
    set_shares_below,
)
from vesdyn.front import contact_radius, displace_front
from vesdyn.meridian import build_meridian
from vesdyn.meshing import graded_meridian, graded_sphere
from vesdyn.surface import build_surface

BINDING_GAP = 0.02  # of the cutoff: membrane closer than this counts as bound
STARTING_STEPS = 4  # of order 1
_HEAVIER = (1.0, 4.0, 16.0)  # a relaxation that fails starts again with a larger fictitious mass


class BackwardDifference(NamedTuple):
    """Rate at t_(n+1): (v_(n+1) - now v_n - before v_(n-1)) / step."""

    step: float  # [a0^2/D]
    now: float
    before: float

    def past(self, v_n, v_before):
        """What v_(n+1) would be without any rate."""
        return self.now * v_n + self.before * v_before


def euler(dt):
    """Backward Euler, order 1."""
    return BackwardDifference(dt, 1.0, 0.0)


def bdf2(dt, dt_before):
    """Backward difference over two steps of different length, order 2."""
    w = dt / dt_before
    leading = (1.0 + 2.0 * w) / (1.0 + w)
    return BackwardDifference(dt / leading, (1.0 + w) / leading, -w * w / (1.0 + w) / leading)


def build_body(case):
    """Start positions (n_nodes, d) [a0] and the body of ``case``."""
    mesh, membrane = case.mesh, case.membrane
    if case.model == "axisymmetric":
        x = graded_meridian(mesh.front_edge, mesh.far_edge)
        return x, build_meridian(x, membrane.shear_modulus, membrane.prestretch, membrane.thickness)
    x, faces = graded_sphere(mesh.front_edge, mesh.far_edge, mesh.layout)
    return x, build_surface(x, faces, membrane.shear_modulus, membrane.prestretch, membrane.thickness)


class Spreading:
    """A vesicle that spreads: the body, its surroundings, and the state at ``time`` [a0^2/D].

    ``x`` (n_nodes, d) [a0] are the node positions, ``number`` (n_nodes,) [c_r0 a0^2] the receptors they carry;
    ``steps`` counts the coupling steps since the motion began, or began anew with `perturb_front`.
    """

    _STATE = (
        "mesh", "time", "steps", "x", "x_before", "dt_before", "dt_wanted", "number", "number_before", "pressure",
        "adhesion_work", "dissipation", "iterations", "residual", "step_error", "clipped_edges",
    )  # fmt: skip

    def __init__(self, case):
        self.case = case
        self.x, self.body = build_body(case)
        self.adhesion = Adhesion(
            case.adhesion.traction,
            case.adhesion.cutoff,
            case.adhesion.ligand_ratio,
            case.receptors.frozen,
        )
        self.controls = relaxation.Controls(
            case.tolerance, case.solver.max_iterations, case.solver.damping == "kinetic"
        )
        self.work = relaxation.workspace(self.x)
        self.transport = receptors.transport(self.x.shape[0], self.body.edges.shape[0])

        self.lowest = int(np.argmin(self.x[:, -1]))  # the node in the middle of the contact
        self.mesh = zlib.crc32(self.x.tobytes() + self.body.elements.tobytes())  # tells meshes apart
        self.time, self.steps = 0.0, 0
        self.x_before, self.dt_before, self.dt_wanted = self.x.copy(), 1.0, 0.0
        self.pressure = self.adhesion_work = self.dissipation = 0.0
        self.residual = self.step_error = 0.0
        self.iterations = self.clipped_edges = 0
        self.number = np.zeros(self.x.shape[0])
        self.volume_0 = 1.0
        self.volume_0 = self._measure(self.x)
        self.number[:] = self.work.area * self._initial_density()
        self.number_before = self.number.copy()
        self.number_0 = self.number.sum()
        self.elastic_energy_0 = elastic_energy(self.body, self.x)

    def _initial_density(self):
        """Density (n_nodes,) [c_r0] at t = 0: 1, or uneven about the axis."""
        amplitude = self.case.perturbation.amplitude
        if amplitude == 0.0:
            return np.ones(len(self.x))
        angle = np.arctan2(self.x[:, 1], self.x[:, 0])
        on_axis = np.hypot(self.x[:, 0], self.x[:, 1]) < 1e-12
        return 1.0 + np.where(on_axis, 0.0, amplitude * np.cos(self.case.perturbation.mode * angle))

    def advance(self, until):
        """Take one coupling step to time ``until`` [a0^2/D]; raise `RelaxationError` if there is no balance."""
        dt = until - self.time
        x_old, number_old, area_old = self.x, self.number, self.work.area.copy()
        started = self.steps >= STARTING_STEPS
        second_order = self.case.time.order == 2 and started
        rate = bdf2(dt, self.dt_before) if second_order else euler(dt)

        ahead = self._look_ahead(dt)  # x*_(n+1)
        self.number = self._step_receptors(ahead if second_order else x_old, rate, dt)  # N_(n+1)
        self.x = self._relax_membrane(ahead, rate)  # x_(n+1)
        self.volume = self._measure(self.x)
        self._update_ledger(x_old, area_old, rate)

        if self.adhesion.frozen:
            self.number = self.work.area.copy()
        self.step_error = self._distance(ahead, self.x) if started else 0.0
        self.x_before, self.number_before, self.dt_before = x_old, number_old, dt
        self.time, self.steps = until, self.steps + 1

    def perturb_front(self):
        """Displace the contact front at random, as the case's ``perturbation`` says (Fig. 9); time stands still.

        The nodes keep their receptors. The motion starts anew, with steps of order 1, since a rate across
        the leap would mean nothing.
        """
        perturbation = self.case.perturbation
        self.x = displace_front(self.x, self.body.edges, perturbation.front, np.random.default_rng(perturbation.seed))
        self.volume = self._measure(self.x)
        self.x_before, self.number_before = self.x, self.number
        self.steps, self.dt_wanted = 0, 0.0

    def _look_ahead(self, dt):
        """Positions after another ``dt`` of the last motion; nodes on the plane stay there."""
        ahead = self.x + (self.x - self.x_before) * (dt / self.dt_before)
        ahead[:, -1] = np.where(self.x[:, -1] <= 0.0, 0.0, np.maximum(ahead[:, -1], 0.0))
        return ahead

    def _step_receptors(self, x, rate, dt):
        """Numbers (n_nodes,) after the step, moved on the membrane ``x``."""
        if self.adhesion.frozen:
            return self.number
        number = rate.past(self.number, self.number_before)
        if number.min() <= 0.0:  # only order 1 keeps any density positive
            rate = euler(dt)
            number = self.number.copy()
        self._measure(x)
        self.clipped_edges = edge_conductances(self.body, x, self.transport.conductance)
        set_boltzmann_exponents(self.case.drift_number, self.adhesion, x, self.transport.exponent)
        status = receptors.step_receptors(
            self.body.edges,
            self.work.area,
            self.adhesion.ligand_ratio,
            rate.step,
            number,
            self.transport,
        )
        if status != receptors.SOLVED:
            raise relaxation.RelaxationError(
                f"t = {self.time:.6g}, step {rate.step:.3g}: no receptor density was found; reduce time.step"
            )
        return number

    def _relax_membrane(self, ahead, rate):
        """Positions (n_nodes, d) in balance at the end of the step, from the better of two starts."""
        balance = self._balance(
            rate.past(self.x, self.x_before), viscosity=self.case.drag / rate.step
        )
        for heavier in _HEAVIER:
            starts = [self.x.copy(), ahead.copy()] if heavier == 1.0 else [self.x.copy()]
            x = min(
                starts,
                key=lambda s: relaxation.incremental_potential(balance, s, self.pressure, self.work),
            )
            relaxation.set_fictitious_mass(balance, x, self.pressure, self.work)
            self.work.mass[:] *= heavier
            outcome = relaxation.relax(balance, self.controls, x, self.pressure, self.work)
            if outcome.status == relaxation.CONVERGED:
                break
        else:
            raise relaxation.RelaxationError(
                relaxation.explain(outcome, self.controls, self.time, rate.step)
            )
        self.pressure, self.residual, self.iterations = (
            outcome.pressure,
            outcome.residual,
            outcome.iterations,
        )
        return x

    def _balance(self, x_rest, viscosity):
        return relaxation.Balance(
            self.body, self.adhesion, viscosity, self.volume_0, self.number, x_rest
        )

    def _measure(self, x):
        """Set the nodal areas of ``work`` to those at ``x``; return the volume [a0^3]."""
        return relaxation.set_forces(self._balance(x, viscosity=0.0), x, self.work)

    def _update_ledger(self, x_old, area_old, rate):
        self.adhesion_work += adhesion_work(
            self.adhesion, self.number, x_old, area_old, self.x, self.work.area
        )
        drag = self.case.drag / rate.step * (self.x - rate.past(x_old, self.x_before))
        self.dissipation += np.sum(self.body.reference_area[:, None] * drag * (self.x - x_old))

    def _distance(self, x, y):
        """Root mean square distance [a0] of two configurations, over the reference area."""
        weight = self.body.reference_area / self.body.reference_area.sum()
        return np.sqrt(np.sum(weight[:, None] * (x - y) ** 2))

    def rates(self):
        """Speed of the membrane (rms) [a0] and net flux of receptors (rms, of their number) per a0^2/D."""
        moved = self._distance(self.x_before, self.x) / self.dt_before
        change = np.sqrt(np.sum((self.number - self.number_before) ** 2) / np.sum(self.number**2))
        return moved, change / self.dt_before

    @property
    def density(self):
        """Receptor density c (n_nodes,) [c_r0] per current area."""
        return self.number / self.work.area

    @property
    def tensions(self):
        """Principal tensions (n_elements, 2) [kT/a0^2], see `vesdyn.body.principal_tensions`."""
        tension = np.zeros((len(self.body.elements), 2))
        principal_tensions(self.body, self.x, tension)
        return tension

    def front(self, level):
        """Membrane area below ``level`` [a0] and the mean radius of its rim: [a0^2], [a0]."""
        share = np.zeros(len(self.body.edges))
        set_shares_below(self.body, self.x, level, share)
        area = area_below(self.body, self.x, level, share)
        return area, contact_radius(self.x, self.body.edges, share)

    def history_row(self):
        """What is recorded at every coupling step, in the units of the model."""
        density, tension, gap = self.density, self.tensions, self.x[:, -1][self.body.elements]
        free = np.flatnonzero(gap.min(axis=1) > 0.0)
        slackest = free[np.argmin(tension[free].min(axis=1))]
        binding_area, radius = self.front(BINDING_GAP * self.adhesion.cutoff)
        lost = 0.0 if self.adhesion.frozen else self.number.sum() / self.number_0 - 1.0
        return {
            "time": self.time,
            "binding_area": binding_area,
            "contact_radius": radius,
            "pressure": self.pressure,
            "volume_error": self.volume / self.volume_0 - 1.0,
            "receptor_number_error": lost,
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
            "centre_gap": self.x[self.lowest, -1],
            "tension_min": tension.min(),
            "free_tension_min": tension[slackest].min(),
            "free_tension_min_height": gap[slackest].mean(),
            "clipped_edges": self.clipped_edges,
            "step_error": self.step_error,
        }

    def frame(self):
        """Elements (n_elements, k), nodal arrays and element arrays to store or draw."""
        gap, density, tension = self.x[:, -1].copy(), self.density, self.tensions
        traction = np.empty_like(gap)
        for i in range(len(gap)):
            traction[i] = adhesion_traction(self.adhesion, gap[i], density[i])
        nodal = {"position": self.x.copy(), "density": density, "gap": gap, "traction": traction}
        return self.body.elements, nodal, {"tension_1": tension[:, 0], "tension_2": tension[:, 1]}

    def state(self):
        """Everything that changes in time, as arrays and numbers."""
        return {name: getattr(self, name) for name in self._STATE}

    def restore(self, state):
        """Continue from ``state`` with the bits of the run that saved it.

        Raises ValueError where the state belongs to another mesh, one made by another version.
        """
        if state["mesh"] != self.mesh:
            raise ValueError("the stored state belongs to another mesh than this version makes of the case")
        for name in self._STATE:
            setattr(self, name, state[name])
        self.volume = self._measure(self.x)
