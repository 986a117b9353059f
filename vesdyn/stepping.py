"""Coupling steps: of equal length, or as long as the accuracy wish allows; and when the scene is steady.

The adaptive step compares each new shape with the one seen ahead along the last motion: their root mean
square distance e falls with dt^2, like the error of the second-order scheme, and is kept at

    e <= STEP_ERROR x accuracy x a0,     dt_next = dt (0.8 limit / e)^(1/2), within [0.3, 1.5] dt,

a step that exceeds the limit twice over is taken again, shorter. STEP_ERROR was calibrated on the paper's
cases (README, "Accuracy"). The first steps, which have no past to compare with, are short.
"""
import math

from vesdyn.relaxation import RelaxationError

STEP_ERROR = 0.003  # distance [a0] allowed per unit of accuracy
FIRST_STEP = 2e-3  # of a0^2/D, per unit of accuracy
LONGEST_STEP = 0.05
STEADY = 0.02  # per unit of accuracy: relative change over one a0^2/D that counts as none
_GROWTH, _CUT = 1.5, 0.3
_SHORTEST = 1e-9


def step(sim, stop):
    """Take one coupling step of ``sim`` (`vesdyn.spreading.Spreading`), not beyond ``stop`` [a0^2/D].

    Raises vesdyn.relaxation.RelaxationError where no step, however short, finds a balance.
    """
    if sim.case.time.step == "auto":
        _adaptive_step(sim, stop)
    else:
        left = math.ceil((stop - sim.time) / sim.case.time.step * (1.0 - 1e-9))
        sim.advance(_level(sim.time, stop, left))


def _adaptive_step(sim, stop):
    accuracy = sim.case.accuracy
    limit = STEP_ERROR * accuracy
    wanted = sim.dt_wanted or FIRST_STEP * accuracy
    before = sim.state()
    while True:
        until = _level(sim.time, stop, math.ceil((stop - sim.time) / wanted * (1.0 - 1e-9)))
        dt = until - sim.time
        try:
            sim.advance(until)
        except RelaxationError:
            if dt <= _SHORTEST:
                raise
            sim.restore(before)
            wanted = _CUT * dt
            continue
        if sim.step_error == 0.0:  # still starting
            break
        factor = min(_GROWTH, max(_CUT, math.sqrt(0.8 * limit / sim.step_error)))
        if sim.step_error > 2.0 * limit and dt > _SHORTEST:
            sim.restore(before)
            wanted = factor * dt
            continue
        # a step cut short by a stop says little: do not let it shrink the next one
        wanted = min(LONGEST_STEP, max(factor * dt, wanted if factor >= 1.0 else 0.0))
        break
    sim.dt_wanted = wanted


def _level(time, stop, steps):
    """End of the first of ``steps`` equal steps from ``time`` to ``stop``; the last one meets it exactly."""
    return stop if steps <= 1 else time + (stop - time) / steps


def is_steady(sim):
    """True where neither the membrane nor the receptors move any more, by the accuracy wish."""
    moved, changed = sim.rates()
    return sim.steps > 0 and max(moved, changed) < STEADY * sim.case.accuracy
