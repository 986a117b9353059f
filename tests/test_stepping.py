"""Coupling steps of equal length that meet every stop, and adaptive ones that keep to the accuracy wish."""

import numpy as np
import pytest

from vesdyn.balance import NoBalanceError
from vesdyn.budget import STEP_ERROR
from vesdyn.case import Case
from vesdyn.diagnostics import Moment
from vesdyn.spreading import STARTING_STEPS, Spreading, State
from vesdyn.stepping import FoldError, is_steady, march
from vesdyn.substrate import gaps, touches


class Clock:
    """Stands in for Spreading: time alone."""

    def __init__(self, case):
        self.case = case

    def start(self):
        return State(*[0.0] * len(State._fields))

    def advance(self, state, until, pause):
        return state._replace(time=until)

    def folded_area(self, state):
        return 0.0


def levels(end, length, frames=()):
    case = Case(name="x", time={"end": end, "step": length}, output={"frames": frames})
    return np.array([state.time for state in march(Clock(case))])


def test_frames_on_the_grid_change_nothing():
    times = levels(1.2, 0.002, (0.008, 0.044, 0.128, 0.56))
    assert len(times) == 600
    assert np.max(np.abs(times - 0.002 * np.arange(1, 601))) < 1e-12  # round-off of 600 sums
    assert {0.008, 0.044, 0.128, 0.56, 1.2} <= set(times)


def test_frames_off_the_grid_are_met_exactly_by_shorter_steps():
    times = levels(0.01, 0.002, (0.003, 0.0095))
    steps = np.diff(times, prepend=0.0)
    assert {0.003, 0.0095, 0.01} <= set(times)
    assert np.all(steps > 0) and np.all(steps < 0.002 * (1 + 1e-9))
    assert len(times) == 2 + 4 + 1


@pytest.mark.parametrize("length", [0.001, 0.0005, 1 / 3000, 0.0025])
def test_round_off_adds_no_step(length):
    assert len(levels(600 * length, length, (7 * length, 300 * length))) == 600


def adaptive(accuracy, end):
    return Case(
        name="x",
        model="axisymmetric",
        mesh={"front_edge": 0.01, "far_edge": 0.05},
        time={"step": "auto", "end": end},
        output={"frames": ()},
        accuracy=accuracy,
        solver={"tolerance": 1e-4},
    )


def test_adaptive_steps_grow_from_the_singular_start_and_shrink_with_the_wish():
    taken = {}
    for accuracy in (0.04, 0.01):
        lengths = [state.dt_before for state in march(Spreading(adaptive(accuracy, 0.05)))]
        assert lengths[0] < 0.05 * max(lengths)
        taken[accuracy] = len(lengths)
    assert taken[0.01] > 1.3 * taken[0.04]


def test_scene_becomes_steady_and_not_before_the_area_has_settled():
    sim = Spreading(adaptive(0.02, 4.0))
    moments = [Moment(sim, state) for state in march(sim)]
    time, area = np.array([(m.time, m["binding_area"]) for m in moments]).T
    assert is_steady(sim, moments[-1].state) and 0.5 < time[-1] < 4.0
    assert abs(np.interp(time[-1] - 0.2, time, area) / area[-1] - 1.0) < 0.01  # the wish is 2 %


def test_a_ring_that_snaps_down_takes_a_few_steps():
    """Short range, soft membrane: receptors jump as each ring lands, which held the step to a thirtieth of a ring."""
    case = Case(
        name="snapping", model="axisymmetric", accuracy=0.02, drag=6.38, receptors={"drift_number": 4.99},
        membrane={"shear_modulus": 0.134, "thickness": 0.00521}, mesh={"front_edge": 0.0015, "far_edge": 0.05},
        adhesion={"traction": 297.0, "cutoff": 0.00297, "ligand_ratio": 2.75}, time={"step": "auto", "end": 0.006},
        output={"frames": ()},
    )  # fmt: skip
    states = [state for state in march(Spreading(case)) if state.time > 0.002]
    rings = touches(gaps(states[-1].x)).sum() - touches(gaps(states[0].x)).sum()
    assert rings > 10 and len(states) < 8 * rings


# The rules of the adaptive step, on a scene that is time alone


class Scene(Clock):
    """The step error is ``error(dt)``; steps above ``longest`` have no balance; from t = 0.5 on ``folded`` is folded."""

    def __init__(self, frames=(), end=1.0, error=lambda dt: 1e-12, longest=np.inf, folded=0.0):
        self.case = Case(name="x", model="axisymmetric", time={"end": end, "step": "auto", "stop_when_steady": False},
                         output={"frames": frames})  # fmt: skip
        self.error, self.longest, self.folded, self.tried = error, longest, folded, []

    def advance(self, state, until, pause):
        dt = until - state.time
        self.tried.append(dt)
        self.reached = state.time
        if dt > self.longest:
            raise NoBalanceError("it stalls")
        return state._replace(time=until, steps=state.steps + 1, dt_before=dt, step_error=self.error(dt))

    def ring_time(self, state):
        return 0.0

    def folded_area(self, state):
        return self.folded if state.time > 0.5 else 0.0


LIMIT = STEP_ERROR * Case(name="x").accuracy


def test_a_step_too_long_is_taken_again():
    """A scene in which short steps suddenly err much, as where a front snaps in."""
    sim = Scene()
    sim.error = lambda dt: LIMIT * (dt / (0.02 if sim.reached < 0.3 else 0.002)) ** 2
    states = list(march(sim))
    started = [state for state in states if state.steps > STARTING_STEPS]
    assert max(state.step_error for state in started) <= 2.0 * LIMIT
    assert len(sim.tried) > len(states)
    assert max(state.dt_before for state in states) > 0.01  # and not for being always short


def test_a_step_without_a_balance_is_taken_shorter():
    sim = Scene(longest=0.01)
    lengths = [state.dt_before for state in march(sim)]
    assert max(lengths) <= 0.01 < max(sim.tried) and sum(lengths) == pytest.approx(1.0)


def test_where_no_step_has_a_balance_the_advice_is_not_to_shorten_one_that_is_auto():
    with pytest.raises(NoBalanceError, match="^it stalls; shorter steps did not help, raise solver.max_iterations"):
        list(march(Scene(longest=0.0)))


def test_a_step_cut_short_by_a_mark_does_not_shorten_the_next():
    free, cut = ([state.dt_before for state in march(Scene(frames))] for frames in ((), (0.3001, 0.3002)))
    assert len(cut) <= len(free) + 4


def test_steps_grow_with_the_time_that_has_passed_and_no_faster():
    states = list(march(Scene()))
    lengths, times = np.array([(state.dt_before, state.time) for state in states]).T
    grown = times > 10.0 * lengths[0]
    assert np.all(lengths[grown] <= 0.2 * (times - lengths)[grown] * (1.0 + 1e-9))
    assert lengths.max() > 0.05


def test_marks_are_met():
    assert {0.1, 0.3001, 1.0} <= {state.time for state in march(Scene((0.1, 0.3001)))}


def test_folds_are_looked_for_after_every_step():
    states = []
    with pytest.raises(FoldError, match=r"^t = 0\.\d+: the membrane has folded over itself"):
        for state in march(Scene(folded=0.01)):
            states.append(state)
    assert 0.3 < states[-1].time <= 0.5


@pytest.mark.parametrize("rates, steady", [((0.0, 0.0), True), ((1.0, 0.0), False), ((0.0, 1.0), False), ((9e-4, 9e-4), True)])
def test_a_scene_is_steady_where_neither_shape_nor_receptors_move(rates, steady):
    """A tenth of the wish, 1 %, is the rate that counts as rest."""
    sim = Scene()
    sim.progress_rates = lambda state: rates
    state = sim.start()._replace(steps=7)
    assert is_steady(sim, state) == steady
    assert not is_steady(sim, sim.start())
