"""The staggered scheme: receptors move on the membrane, then the membrane moves under its receptors.

One coupling step from t_n to t_(n+1) = t_n + dt:

    look ahead  x_n -> x*_(n+1)                 along the last motion
    receptors   N_n -> N_(n+1) on x*_(n+1)      implicit, `vesdyn.receptors`
    membrane    x_n -> x_(n+1) under N_(n+1)    balance (6), solved by one of METHODS
    ledger      adhesion work, dissipation

Order 2: both rates are backward differences over two steps (BDF2, variable step). Order 1, the scheme of
the paper: backward Euler, and the receptors move on x_n. The start is singular (the front runs as
the square root of time), so the first steps are of order 1 in any case.

The driver knows a body by the functions of `vesdyn.body` only.
"""
import zlib
from typing import NamedTuple

import numpy as np

from vesdyn import adhesion, newton, receptors, relaxation
from vesdyn.balance import CONVERGED, DIVERGED, Balance, Limits, NoBalanceError, allocate
from vesdyn.body import add_elastic_forces, area_facing_away, edge_conductances, elastic_energy
from vesdyn.errors import CaseError
from vesdyn.front import BINDING_GAP, displace_front
from vesdyn.kinds import KINDS
from vesdyn.substrate import gaps, kept_landed, touches

STARTING_STEPS = 4  # of order 1
SHAPE_SHARE, NUMBER_SHARE = 0.25, 0.1  # of their relative differences that count against that of bound receptors
WEAK_BINDING = 4.0  # [kT] of a receptor; above it numbers count for more in proportion: their layer at the front is thin
LEAST_WAY, LEAST_CHANGE = 0.01, 0.001  # of the cutoff, of the numbers: shorter ways from the start count as these
ROUND_OFF = 1e-9  # of the size: a way that is none
METHODS = {"viscous": relaxation.viscous, "kinetic": relaxation.kinetic, "newton": newton.newton}  # solve the balance


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


class State(NamedTuple):
    """Everything that changes in time, as one value: a step makes a new one, and no array of it is ever changed."""

    time: float  # [a0^2/D]
    steps: int  # coupling steps since the motion began, or began anew with a displaced front
    x: np.ndarray  # (n_nodes, d) positions [a0]
    number: np.ndarray  # (n_nodes,) receptors they carry [c_r0 a0^2]
    area: np.ndarray  # (n_nodes,) current nodal areas [a0^2]
    volume: float  # enclosed [a0^3]
    pressure: float  # [kT/a0^3]
    x_before: np.ndarray  # one step earlier
    number_before: np.ndarray
    dt_before: float  # length of that step [a0^2/D]
    dt_wanted: float  # length that the next one should have, by the last (`vesdyn.stepping`)
    adhesion_work: float  # since t = 0 [kT]
    dissipation: float  # since t = 0 [kT]
    iterations: int  # of the last balance
    residual: float  # of the last balance
    step_error: float  # relative difference of the last state from the one seen ahead; 0 while the motion starts
    clipped_edges: int  # negative conductances set to zero in the last step

    @property
    def density(self):
        """Receptor density c (n_nodes,) [c_r0] per current area."""
        return self.number / self.area


def build_body(case):
    """Start positions (n_nodes, d) [a0] and the body of ``case``; raise CaseError where these are not chosen yet."""
    if "auto" in (case.model, case.mesh.front_edge, case.mesh.far_edge) and case.mesh.file is None:
        raise CaseError(f"{case.name}: model or mesh is still auto; let `vesdyn.plan(case)` choose it.")
    return KINDS[case.model].start(case.mesh, case.membrane)


def method_of(case):
    """Name in METHODS of what solves the balance of ``case``: Newton's method on a meridian, where it is faster.

    Raises CaseError where Newton's method is asked for on another body.
    """
    method, has_axis = case.solver.method, KINDS[case.model].KEEPS_AXIS
    if method == "newton" and not has_axis:
        raise CaseError(f"{case.name}: solver.method: newton is for meridians; take relaxation or auto on a surface.")
    return "newton" if method == "newton" or (method == "auto" and has_axis) else case.solver.damping


class Spreading:
    """A scene: a vesicle above its substrate, and the step that carries a `State` of it on.

    ``x_start`` (n_nodes, d) [a0] is the shape at t = 0, ``volume_0`` [a0^3] the enclosed volume that is kept and
    ``number_0`` [c_r0 a0^2] the count of receptors. Raises CaseError where the case leaves its body or mesh open.
    """

    def __init__(self, case):
        self.case = case
        self.x_start, self.body = build_body(case)
        self.adhesion = adhesion.TractionSeparation(
            adhesion.LAWS[case.adhesion.law](case.adhesion),
            case.adhesion.traction,
            case.adhesion.ligand_ratio,
            case.receptors.frozen,
        )
        binding = case.drift_number * case.adhesion.traction * adhesion.integral(self.adhesion.law, 0.0)  # [kT]
        self.number_share = NUMBER_SHARE * max(1.0, binding / WEAK_BINDING)
        self.limits = Limits(case.tolerance, case.solver.max_iterations)
        self.solve = METHODS[method_of(case)]
        self.scratch = allocate(self.x_start)
        self.transport = receptors.transport(len(self.x_start), len(self.body.edges))

        self.lowest = int(np.argmin(gaps(self.x_start)))  # the node in the middle of the contact
        self.mesh_checksum = zlib.crc32(self.x_start.tobytes() + self.body.elements.tobytes())
        area, self.volume_0 = self.measure(self.x_start)
        self.number_start = area * self._initial_density()
        self.number_0 = self.number_start.sum()
        self.elastic_energy_0 = elastic_energy(self.body, self.x_start)

    def _initial_density(self):
        """Density (n_nodes,) [c_r0] at t = 0: 1, or uneven about the axis."""
        amplitude, x = self.case.perturbation.amplitude, self.x_start
        if amplitude == 0.0:
            return np.ones(len(x))
        angle = np.arctan2(x[:, 1], x[:, 0])
        on_axis = np.hypot(x[:, 0], x[:, 1]) < 1e-12
        return 1.0 + np.where(on_axis, 0.0, amplitude * np.cos(self.case.perturbation.mode * angle))

    def start(self):
        """The `State` at t = 0."""
        x, number = self.x_start, self.number_start
        area, volume = self.measure(x)
        return State(
            time=0.0, steps=0, x=x, number=number, area=area, volume=volume, pressure=0.0, x_before=x,
            number_before=number, dt_before=1.0, dt_wanted=0.0, adhesion_work=0.0, dissipation=0.0, iterations=0,
            residual=0.0, step_error=0.0, clipped_edges=0,
        )  # fmt: skip

    def stored(self, state):
        """``state`` as a dict of arrays and numbers, and what tells its mesh apart."""
        return {**state._asdict(), "mesh": self.mesh_checksum}

    def restored(self, stored):
        """The `State` of the dict ``stored``, to go on from with the bits of the run that stored it.

        Raises ValueError where it belongs to another mesh, one made by another version.
        """
        stored = dict(stored)
        if stored.pop("mesh", None) != self.mesh_checksum or set(stored) != set(State._fields):
            raise ValueError("the stored state belongs to another mesh or version than this one")
        return State(**stored)

    def advance(self, state, until, pause=lambda: None):
        """The `State` after one coupling step from ``state`` to time ``until`` [a0^2/D].

        ``pause`` is called every few tenths of a second and may raise to give the step up. Raises NoBalanceError
        where no balance is found.
        """
        dt = until - state.time
        started = state.steps >= STARTING_STEPS
        second_order = self.case.time.order == 2 and started
        rate = bdf2(dt, state.dt_before) if second_order else euler(dt)

        ahead = self._look_ahead(state, dt)  # x*_(n+1)
        ligands = adhesion.ligand_density(self.case.ligands, ahead)
        number, clipped = self._step_receptors(state, ahead if second_order else state.x, ligands, rate, dt)  # N_(n+1)
        solution = self._relax_membrane(state, number, ligands, ahead, rate, pause)  # x_(n+1)
        if area_facing_away(self.body.topology, solution.x, 0.0) > 0.0:
            raise NoBalanceError(f"t = {until:.6g}, step {dt:.3g}: membrane landed on the substrate with its inner side down")
        if self._has_left(state.x, solution.x):
            raise NoBalanceError(
                f"t = {until:.6g}, step {dt:.3g}: the vesicle has left the substrate, no membrane is within the cutoff"
            )
        area, volume = self.measure(solution.x)
        worked, dissipated = self._work(state, number, ligands, solution.x, area, rate)

        return State(
            time=until,
            steps=state.steps + 1,
            x=solution.x,
            number=area if self.adhesion.frozen else number,
            area=area,
            volume=volume,
            pressure=solution.pressure,
            x_before=state.x,
            number_before=state.number,
            dt_before=dt,
            dt_wanted=state.dt_wanted,
            adhesion_work=state.adhesion_work + worked,
            dissipation=state.dissipation + dissipated,
            iterations=solution.iterations,
            residual=solution.residual,
            step_error=self._step_error(state, ahead, number, solution.x, dt) if started else 0.0,
            clipped_edges=clipped,
        )

    def _has_left(self, before, x):
        """Whether membrane was in reach of the substrate ``before`` and none is at ``x`` (n_nodes, d), though it pulls."""
        cutoff = self.case.adhesion.cutoff
        return self.case.adhesion.traction > 0.0 and gaps(before).min() < cutoff <= gaps(x).min()

    def restart(self, state):
        """The `State` whose motion begins anew, its front displaced at random where the ``perturbation`` says so (Fig. 9).

        Time stands still and the nodes keep their receptors. Steps are of order 1 again, since a rate across the
        leap would mean nothing.
        """
        perturbation, x = self.case.perturbation, state.x
        if perturbation.front > 0:
            x = displace_front(x, self.body.edges, perturbation.front, np.random.default_rng(perturbation.seed))
        area, volume = self.measure(x)
        return state._replace(x=x, x_before=x, number_before=state.number, area=area, volume=volume, steps=0)

    def _look_ahead(self, state, dt):
        """Positions after another ``dt`` of the last motion; nodes on the plane stay there."""
        return kept_landed(state.x, state.x + (state.x - state.x_before) * (dt / state.dt_before))

    def _step_receptors(self, state, x, ligands, rate, dt):
        """Numbers (n_nodes,) after the step, moved on the membrane ``x``, and how many conductances were clipped."""
        if self.adhesion.frozen:
            return state.number, state.clipped_edges
        number = rate.past(state.number, state.number_before)
        if number.min() <= 0.0:  # only order 1 keeps any density positive
            rate = euler(dt)
            number = state.number.copy()
        area, _ = self.measure(x)
        clipped = edge_conductances(self.body.topology, x, self.transport.conductance)
        adhesion.set_boltzmann_exponents(self.case.drift_number, self.adhesion, ligands, x, self.transport.exponent)
        found = receptors.step_receptors(
            self.body.edges, area, self.adhesion.ligand_ratio, ligands, rate.step, number, self.transport
        )
        if not found:
            raise NoBalanceError(f"t = {state.time:.6g}, step {rate.step:.3g}: no receptor density was found")
        return number, clipped

    def _relax_membrane(self, state, number, ligands, ahead, rate, pause):
        """The `vesdyn.balance.Solution` of the balance at the end of the step."""
        balance = Balance(
            self.body,
            self.adhesion,
            self.case.drag / rate.step,
            self.volume_0,
            number,
            ligands,
            rate.past(state.x, state.x_before),
        )
        solution = self.solve(balance, (state.x, ahead), state.pressure, self.limits, self.scratch, pause)
        if solution.status == CONVERGED:
            return solution
        where = f"t = {state.time:.6g}, step {rate.step:.3g}: the relaxation"
        if solution.status == DIVERGED:
            raise NoBalanceError(f"{where} diverged after {solution.iterations} iterations")
        raise NoBalanceError(
            f"{where} stalled at a residual of {solution.residual:.2g} (wanted {self.limits.tolerance:.2g}) after"
            f" {solution.iterations} iterations"
        )

    def measure(self, x):
        """Nodal areas (n_nodes,) [a0^2] and enclosed volume [a0^3] at ``x`` (n_nodes, d) [a0]."""
        self.scratch.nodal[:] = 0.0
        volume = add_elastic_forces(self.body, x, self.scratch.nodal)
        return self.scratch.area.copy(), volume

    def _work(self, state, number, ligands, x, area, rate):
        """Work of the adhesion and dissipation [kT] in a step from ``state`` to ``x``."""
        worked = adhesion.adhesion_work(self.adhesion, number, ligands, state.x, state.area, x, area)
        drag = self.case.drag / rate.step * (x - rate.past(state.x, state.x_before))
        return worked, np.sum(self.body.reference_area[:, None] * drag * (x - state.x))

    def _step_error(self, state, ahead, number, x, dt):
        """Relative difference of what was seen ahead from what came: it falls with dt^2, as the error of order 2 does.

        The largest of three: of the receptors in reach of the ligands; of the shape, against the way it has come
        since t = 0; of the receptors on other nodes than was seen, against those that have changed theirs since then: a
        count, so that it does not depend on how many nodes the layer at the front goes past.
        """
        number_ahead = state.number + (state.number - state.number_before) * (dt / state.dt_before)
        seen, came = (adhesion.bound_receptors(self.adhesion, *at) for at in ((number_ahead, ahead), (number, x)))
        moved = max(self.distance(x, self.x_start), LEAST_WAY * self.case.adhesion.cutoff)
        changed = max(np.abs(number - self.number_start).sum(), LEAST_CHANGE * self.number_0)
        return max(
            abs(seen / came - 1.0) if came > 0.0 else 0.0,
            SHAPE_SHARE * self.distance(ahead, x) / moved,
            self.number_share * np.abs(number_ahead - number).sum() / changed,
        )

    def ring_time(self, state):
        """About the time [a0^2/D] in which the fullest of the nodes at the rim of the contact lands; 0 before contact.

        Its share of all bound receptors, times the time that has passed: their number grows with a power of time that
        is below 1 on the whole.
        """
        lower, upper = self.body.edges.T
        down = touches(gaps(state.x))
        rim = down[lower] != down[upper]
        fullest = np.maximum(state.number[lower[rim]], state.number[upper[rim]]).max(initial=0.0)
        bound = adhesion.bound_receptors(self.adhesion, state.number, state.x)
        return state.time * fullest / bound if bound > 0.0 else 0.0

    def distance(self, x, y):
        """Root mean square distance [a0] of two configurations, over the reference area."""
        weight = self.body.reference_area / self.body.reference_area.sum()
        return np.sqrt(np.sum(weight[:, None] * (x - y) ** 2))

    def folded_area(self, state):
        """Area [a0^2] of the membrane that is bound with its inner side down, through other membrane."""
        return area_facing_away(self.body.topology, state.x, BINDING_GAP * self.case.adhesion.cutoff)

    def progress_rates(self, state):
        """How fast the shape and the numbers of receptors move away from the start: d ln(distance) / d ln(time), both.

        1 for a steady motion from rest, 1/2 for a diffusive one, 0 at rest; none counts where nothing has moved.
        """
        ways = (
            (self.distance(state.x_before, state.x), self.distance(state.x, self.x_start), 1.0),
            (
                np.linalg.norm(state.number - state.number_before),
                np.linalg.norm(state.number - self.number_start),
                self.number_0,
            ),
        )
        per_step = state.time / state.dt_before
        return tuple(moved * per_step / way if way > ROUND_OFF * size else 0.0 for moved, way, size in ways)
