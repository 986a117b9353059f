"""The march over time: coupling steps of equal or adapted length, events, and when the scene is steady.

The adaptive step compares each new state with the one seen ahead along the last motion: their relative difference e
(`vesdyn.spreading.State.step_error`) falls with dt^2, like the error of the second-order scheme, and is kept at

    e <= STEP_ERROR x accuracy,     dt_next = dt (0.8 limit / e)^(1/2), within [0.3, 1.5] dt,

a step that exceeds the limit twice over is taken again, shorter, but not than a third of the time in which the next
ring of nodes lands (RING_STEP): what happens within it is the mesh's. The first steps, which have no past to compare with,
are short against the two times of the scene: that in which adhesion works against drag, drag d_c / T_max, and that in
which receptors diffuse over the cutoff, d_c^2 / D. No length or time is absolute, so that scenes which differ in
their units alone take the same steps.
"""
import math

from vesdyn.balance import NoBalanceError
from vesdyn.budget import STEP_ERROR
from vesdyn.spreading import STARTING_STEPS

FIRST_STEP = 0.2  # of the shorter time of the scene, per unit of accuracy
LONGEST_STEP = 0.2  # of the time that has passed
RING_STEP = 0.33  # of the time in which a node lands: how long a step may be in any case
STEADY = 0.1  # per unit of accuracy: d ln(distance from the start) / d ln(time) that counts as rest
_GROWTH, _CUT = 1.5, 0.3
_AIM, _TOO_FAR = 0.8, 2.0  # of the limit: what the next step aims at, and what makes one be taken again
_SHORTEST = 1e-5  # of the first step
_ROUNDING = 1e-9  # of a step: what counts as none


class FoldError(NoBalanceError):
    """The membrane folds over itself at the substrate; the sentence says when."""


def march(sim, state=None, pause=lambda: None):
    """Carry the scene ``sim`` (`vesdyn.spreading.Spreading`) to its end, yielding the `State` after each step.

    ``state`` is where to begin, by default t = 0. Steps meet the marks of the case (frames, the displacement of the
    front, the end); the front is displaced when its time has come; the march ends with the case or once nothing
    moves. ``pause`` is called every few tenths of a second and may raise to give the step in hand up.

    Raises vesdyn.balance.NoBalanceError where no step, however short, finds a balance, and `FoldError` where the
    membrane folds over itself.
    """
    state = sim.start() if state is None else state
    while not is_over(sim, state):
        state = step(sim, _with_event(sim, state), next(t for t in sim.case.marks if t > state.time), pause)
        _check_fold(sim, state)
        yield state


def _check_fold(sim, state):
    """Raise `FoldError` where membrane that faces away from the substrate is bound to it, through other membrane."""
    folded = sim.folded_area(state)
    if folded > 0.0:
        raise FoldError(
            f"t = {state.time:.6g}: the membrane has folded over itself at the substrate ({folded:.2g} a0^2 of it are bound"
            " with the inner side down), and the model has no self-contact; end the run before, or take a stiffer"
            " membrane or a weaker traction"
        )


def is_over(sim, state):
    """True where the time of the case is up, or nothing moves any more nor will be moved."""
    case = sim.case
    if case.perturbation.restarts and state.time <= case.perturbation.at:
        return False
    steady = case.time.step == "auto" and case.time.stop_when_steady and is_steady(sim, state)
    return steady or state.time == case.time.end


def _with_event(sim, state):
    """``state``, its motion begun anew if that is due: no part of the state that was yielded at that time."""
    perturbation = sim.case.perturbation
    return sim.restart(state) if perturbation.restarts and state.time == perturbation.at else state


def step(sim, state, mark, pause=lambda: None):
    """The `State` after one coupling step from ``state``, not beyond ``mark`` [a0^2/D].

    Raises vesdyn.balance.NoBalanceError where no step, however short, finds a balance.
    """
    adaptive = sim.case.time.step == "auto"
    try:
        return (_adaptive_step if adaptive else _fixed_step)(sim, state, mark, pause)
    except NoBalanceError as failure:
        shorter = "shorter steps did not help" if adaptive else "reduce time.step"
        remedy = "raise solver.max_iterations or solver.tolerance, or refine the mesh"
        raise NoBalanceError(f"{failure}; {shorter}, {remedy}.") from None


def _fixed_step(sim, state, mark, pause):
    left = math.ceil((mark - state.time) / sim.case.time.step * (1.0 - _ROUNDING))
    return sim.advance(state, _level(state.time, mark, left), pause)


def _adaptive_step(sim, state, mark, pause):
    accuracy = sim.case.accuracy
    limit = STEP_ERROR * accuracy
    first = FIRST_STEP * accuracy * pace(sim.case)
    wanted = state.dt_wanted if state.steps else first
    is_estimated = state.steps >= STARTING_STEPS
    shortest = RING_STEP * sim.ring_time(state) if is_estimated else 0.0
    while True:
        until = _level(state.time, mark, math.ceil((mark - state.time) / wanted * (1.0 - _ROUNDING)))
        dt = until - state.time
        try:
            new = sim.advance(state, until, pause)
        except NoBalanceError:
            if dt <= _SHORTEST * first:
                raise
            wanted = _CUT * dt
            continue
        if is_estimated and new.step_error > 0.0:
            factor = min(_GROWTH, max(_CUT, math.sqrt(_AIM * limit / new.step_error)))
            if new.step_error > _TOO_FAR * limit and wanted > max(shortest, _SHORTEST * first):
                wanted = max(factor * dt, shortest)
                continue
            # a step cut short by a mark says little: do not let it shrink the next one
            wanted = max(factor * dt, wanted if factor >= 1.0 else 0.0)
            wanted = max(min(wanted, max(LONGEST_STEP * until, first)), shortest)
        return new._replace(dt_wanted=wanted)


def _level(time, mark, steps):
    """End of the first of ``steps`` equal steps from ``time`` to ``mark``; the last one meets it exactly."""
    return mark if steps <= 1 else time + (mark - time) / steps


def pace(case):
    """Time [a0^2/D] in which the scene of ``case`` first moves: that of its drag or that of its receptors."""
    adhesion = case.adhesion
    times = [adhesion.cutoff**2]
    if adhesion.traction > 0.0 and case.drag > 0.0:
        times.append(case.drag * adhesion.cutoff / adhesion.traction)
    return min(times)


def is_steady(sim, state):
    """True where neither the membrane nor the receptors move away from the start any more, by the accuracy wish."""
    return state.steps > 0 and max(sim.progress_rates(state)) < STEADY * sim.case.accuracy
