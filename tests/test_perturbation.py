"""The displaced front of Fig. 9: where it is displaced, by how much, and that no interruption loses or repeats it."""

import signal

import numpy as np
import pytest

from vesdyn.case import Case
from vesdyn.diagnostics import Moment
from vesdyn.front import displace_front
from vesdyn.planning import plan
from vesdyn.run import run_case
from vesdyn.spreading import Spreading
from vesdyn import stepping
from vesdyn.stepping import march, step
from vesdyn.storage import RunDirectory

pytestmark = pytest.mark.filterwarnings("ignore:adhesion")  # coarse on purpose

SOFT = Case(
    name="soft",
    membrane={"shear_modulus": 0.302},
    adhesion={"traction": 1.51},
    perturbation={"front": 0.02, "at": 0.02, "seed": 3},
    mesh={"front_edge": 0.05, "far_edge": 0.09, "layout": "spiral"},
    time={"end": 0.04, "step": 0.004},
    output={"frames": (0.024, 0.04), "checkpoint_minutes": 0.0},
)


def changed(case, **sections):
    return case.model_copy(
        update={name: getattr(case, name).model_copy(update=keys) for name, keys in sections.items()}
    )


@pytest.fixture(scope="module")
def spread():
    """The `Moment` of the displacement."""
    sim = Spreading(SOFT)
    state = next(state for state in march(sim) if state.time == SOFT.perturbation.at)
    return Moment(sim, state)


def normals(moment, x):
    a, b, c = np.moveaxis(x[moment.sim.body.elements], 1, 0)
    return np.cross(b - a, c - a)


@pytest.mark.parametrize("largest", [0.005, 0.02, 0.2])
def test_rim_of_the_contact_moves_along_its_radius_and_nothing_else(spread, largest):
    x = displace_front(spread.x, spread.sim.body.edges, largest, np.random.default_rng(0))
    moved = np.flatnonzero(np.any(x != spread.x, axis=1))
    on_plane = spread.x[:, 2] == 0.0
    neighbours_above = {i for e in spread.sim.body.edges for i, j in (e, e[::-1]) if on_plane[i] and not on_plane[j]}
    assert set(moved) == neighbours_above and len(moved) > 10
    assert np.all(x[:, 2] == spread.x[:, 2])
    before, after = (np.hypot(y[moved, 0], y[moved, 1]) for y in (spread.x, x))
    assert np.cross(spread.x[moved], x[moved]) == pytest.approx(0.0, abs=1e-16)
    share = after / before - 1.0
    assert np.abs(share).max() <= largest and share.min() < 0.0 < share.max()
    turned = np.einsum("fk,fk->f", normals(spread, x), normals(spread, spread.x))
    assert turned.min() > 0.0


def test_shares_are_uniform_and_follow_the_seed():
    n = 5000
    turn = 2.0 * np.pi * np.arange(n) / n
    ring = np.stack([np.cos(turn), np.sin(turn), np.zeros(n)], axis=1)
    x = np.concatenate([ring, ring + [0.0, 0.0, 1.0]])
    edges = np.stack([np.arange(n), n + np.arange(n)], axis=1)

    def shares(seed):
        return np.hypot(*displace_front(x, edges, 0.02, np.random.default_rng(seed))[:n, :2].T) - 1.0

    assert np.array_equal(shares(1), shares(1)) and not np.array_equal(shares(1), shares(2))
    counts = np.histogram(shares(1), bins=10, range=(-0.02, 0.02))[0]
    assert np.abs(counts / 500.0 - 1.0).max() < 0.2  # four standard deviations of a count of 500


def test_motion_begins_anew_and_receptors_stay(spread):
    sim = Spreading(SOFT)
    displaced = sim.restart(spread.state)
    assert np.array_equal(displaced.number, spread.state.number)
    assert displaced.density.min() > 0.0
    moment = Moment(sim, next(march(sim, spread.state)))
    assert moment.state.steps == 1
    assert abs(moment["volume_error"]) < 1e-10  # the leap is made good within the step
    assert abs(moment["receptor_number_error"]) < 1e-12


@pytest.mark.parametrize("length", [0.004, "auto"])
def test_run_goes_on_smoothly_and_differs_from_its_control_after_the_time_only(tmp_path, length):
    case = changed(SOFT, time={"step": length})
    histories = []
    for name, front in (("perturbed", 0.02), ("control", 0.0)):
        case = changed(case, perturbation={"front": front}, output={"frames": (0.02, 0.04)})
        assert run_case(case, tmp_path / name, progress=False).state == "finished"
        histories.append(RunDirectory(tmp_path / name).history())
    perturbed, control = histories
    before = perturbed["time"] <= 0.02
    assert np.array_equal(perturbed["binding_area"][before], control["binding_area"][control["time"] <= 0.02])
    assert 0.0 < abs(perturbed["binding_area"][-1] / control["binding_area"][-1] - 1.0) < 0.02
    assert np.diff(perturbed["binding_area"]).min() > -0.005


@pytest.mark.parametrize("model", ["surface", "axisymmetric"])
def test_control_begins_anew_with_nothing_displaced(model):
    case = changed(SOFT, perturbation={"front": 0.0, "restart": True}).model_copy(update={"model": model})
    anew, through = (
        [(state.time, state.steps, state.x) for state in march(Spreading(changed(case, perturbation={"restart": restart})))]
        for restart in (True, False)
    )
    after = next(k for k, (time, _, _) in enumerate(anew) if time > case.perturbation.at)
    assert [time for time, _, _ in anew] == [time for time, _, _ in through]
    assert anew[after][1] == 1 and through[after][1] == after + 1  # counts from the beginning of the motion
    assert np.array_equal(anew[after - 1][2], through[after - 1][2])
    assert 0.0 < np.abs(anew[-1][2] - through[-1][2]).max() < 0.01  # a step of order 1 among those of order 2; an edge is 0.05


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    path = tmp_path_factory.mktemp("undisturbed")
    assert run_case(SOFT, path, progress=False).state == "finished"
    return path


@pytest.mark.parametrize("taken", [4, 5, 6], ids=["just before", "at", "just after"])
@pytest.mark.parametrize("how", ["interrupt", "kill"])
def test_interrupted_at_that_time_the_run_has_the_same_bits(tmp_path, monkeypatch, undisturbed, taken, how):
    done = []

    def step_and_stop(*arguments):
        if how == "kill" and len(done) == taken:
            raise MemoryError  # after the displacement, before the next checkpoint
        state = step(*arguments)
        done.append(state.time)
        if how == "interrupt" and len(done) == taken:
            signal.raise_signal(signal.SIGINT)
        return state

    with monkeypatch.context() as patch:
        patch.setattr(stepping, "step", step_and_stop)
        if how == "kill":
            with pytest.raises(MemoryError):
                run_case(SOFT, tmp_path, progress=False)
        else:
            assert run_case(SOFT, tmp_path, progress=False).state == "interrupted"
    assert RunDirectory(tmp_path).history()["time"][-1] == pytest.approx(0.004 * taken)
    assert run_case(SOFT, tmp_path, progress=False).state == "finished"
    for file in ("history.csv", "frames.h5"):
        assert (tmp_path / file).read_bytes() == (undisturbed / file).read_bytes()


def test_steady_scene_waits_for_its_displacement(tmp_path):
    case = changed(SOFT, adhesion={"traction": 0.0}, time={"step": "auto", "end": 0.03}, output={"frames": ()})
    assert run_case(case, tmp_path, progress=False).time > 0.02


def test_auto_takes_a_surface():
    case = changed(SOFT, time={"end": 0.03}, output={"frames": ()}).model_copy(update={"model": "auto"})
    assert plan(case).case.model == "surface"
