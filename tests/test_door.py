"""The door for Python users: one march behind every way in, a row before the first step, two exceptions."""

import csv
import inspect
import typing

import numpy as np
import pytest

import vesdyn
from vesdyn.cli import main
from vesdyn.diagnostics import COLUMNS
from vesdyn.spreading import Spreading

MERIDIAN = {"model": "axisymmetric", "mesh.front_edge": 0.06, "mesh.far_edge": 0.1}
SURFACE = {"model": "surface", "mesh.front_edge": 0.1, "mesh.far_edge": 0.2, "solver.tolerance": 1e-3}
SHORT = {"time.end": 0.02, "output.frames": [0.008], "output.checkpoint_minutes": 0.0}
ADAPTIVE, FIXED = {"time.step": "auto", "accuracy": 0.1}, {"time.step": 0.002}
DISPLACED = {"perturbation.front": 0.05, "perturbation.at": 0.008}
SCENES = {
    "meridian, adaptive": {**MERIDIAN, **ADAPTIVE},
    "meridian, fixed": {**MERIDIAN, **FIXED},
    "surface, adaptive": {**SURFACE, **ADAPTIVE},
    "surface, fixed": {**SURFACE, **FIXED},
    "displaced, adaptive": {**SURFACE, **ADAPTIVE, **DISPLACED},
    "displaced, fixed": {**SURFACE, **FIXED, **DISPLACED},
}

pytestmark = pytest.mark.filterwarnings("ignore:adhesion.cutoff")  # the meshes are coarse
SPREAD = vesdyn.Column(
    "spread", "a0", "rms distance of the nodes from the axis", lambda m: np.sqrt(np.mean(m.x[:, :-1] ** 2))
)


@pytest.fixture(autouse=True)
def no_pictures(monkeypatch):
    monkeypatch.setattr("vesdyn.run._draw", lambda directory: None)


def case_of(scene="meridian, fixed", **changes):
    return vesdyn.Case(name="a", **{**SCENES[scene], **SHORT, **changes})


def stored_rows(directory):
    """Rows of history.csv, as text."""
    with open(directory / "history.csv", newline="") as file:
        return list(csv.DictReader(file))


def same_rows(stored, rows):
    """Whether rows of text and rows of numbers are the same to the last bit."""
    return [list(row) for row in stored] == [list(row) for row in rows] and all(
        float(a[name]).hex() == float(b[name]).hex() for a, b in zip(stored, rows) for name in b
    )


# One march -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scene", SCENES)
def test_simulate_and_run_case_step_to_the_same_bits(scene, tmp_path):
    case = case_of(scene)
    rows = [moment.row() for moment in vesdyn.simulate(case)]
    outcome = vesdyn.run_case(case, tmp_path / "a", progress=False)
    assert outcome.state == "finished" and outcome.steps == len(rows) > 5
    assert same_rows(stored_rows(tmp_path / "a"), rows)
    assert [row["time"] for row in rows][-1] == 0.02 and 0.008 in [row["time"] for row in rows]


@pytest.mark.parametrize("scene", ["displaced, adaptive", "displaced, fixed"])
def test_the_front_is_displaced_in_both(scene):
    def areas(**changes):
        return {m.time: m["contact_radius"] for m in vesdyn.simulate(case_of(scene, **changes))}

    displaced, control = areas(), areas(**{"perturbation.front": 0.0})
    assert displaced[0.008] == control[0.008]  # the row at that time is the one before it
    assert displaced[0.02] != control[0.02]


@pytest.mark.parametrize("when", [0.006, 0.008, 0.012], ids=["before", "at", "after"])
@pytest.mark.parametrize("scene", ["meridian, adaptive", "displaced, fixed"])
def test_on_step_stops_and_the_run_goes_on_to_the_same_bits(scene, when, tmp_path):
    case = case_of(scene)
    vesdyn.run_case(case, tmp_path / "whole", progress=False)
    seen = []

    def on_step(moment):
        seen.append(moment.time)
        return "enough time" if moment.time >= when else None

    outcome = vesdyn.run_case(case, tmp_path / "halves", on_step=on_step, progress=False)
    assert outcome.state == "interrupted" and outcome.reason == "stopped by enough time."
    assert seen == [float(row["time"]) for row in stored_rows(tmp_path / "halves")] and seen[-1] >= when
    assert vesdyn.run_case(case, tmp_path / "halves", progress=False).state == "finished"
    for name in ("history.csv", "frames/0001.h5", "frames/0002.h5"):
        assert (tmp_path / "halves" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()


def test_on_step_sees_every_step_and_may_just_say_true(tmp_path):
    seen = []
    vesdyn.run_case(
        case_of(), tmp_path / "a", on_step=lambda moment: seen.append(moment.row()), progress=False
    )
    assert same_rows(stored_rows(tmp_path / "a"), seen)
    outcome = vesdyn.run_case(
        case_of(), tmp_path / "b", on_step=lambda m: m["binding_area"] > 0.0, progress=False
    )
    assert outcome.reason == "stopped by on_step." and outcome.steps == 1


def test_a_column_of_the_users_own(tmp_path):
    rows = [moment.row() for moment in vesdyn.simulate(case_of(), columns=[SPREAD])]
    vesdyn.run_case(case_of(), tmp_path / "a", columns=[SPREAD], progress=False)
    assert list(rows[0]) == [*(column.name for column in COLUMNS), "spread"]
    assert same_rows(stored_rows(tmp_path / "a"), rows)
    history = vesdyn.open_run(tmp_path / "a").history
    assert list(history["spread"]) == [row["spread"] for row in rows] and np.ptp(history["spread"]) > 0.0
    assert history.units["spread"] == "a0" and history.meanings["spread"] == SPREAD.meaning


def test_what_is_auto_is_planned_in_each(tmp_path):
    case = vesdyn.Case(name="a", model="auto", accuracy=0.2, **{"time.end": 0.004, "output.frames": []})
    planned = vesdyn.plan(case)
    moments = list(vesdyn.simulate(case))
    assert moments[0].sim.case == planned.case and "auto" not in (
        planned.case.model,
        planned.case.mesh.front_edge,
    )
    vesdyn.run_case(case, tmp_path / "a", progress=False)
    run = vesdyn.open_run(tmp_path / "a")
    assert run.case == planned.case
    assert same_rows(stored_rows(tmp_path / "a"), [moment.row() for moment in moments])


@pytest.mark.parametrize("scene", ["meridian, fixed", "surface, fixed"])
def test_there_is_a_row_before_the_first_step(scene):
    sim = Spreading(case_of(scene))
    moment = vesdyn.Moment(sim, sim.start())
    row = moment.row()
    assert list(row) == [column.name for column in COLUMNS]
    assert all(np.isfinite(value) for value in row.values())
    zero = ("time", "volume_error", "receptor_number_error", "adhesion_work", "dissipation", "gap_min")
    assert all(row[name] == 0.0 for name in zero)
    assert row["density_min"] == row["density_max"] == 1.0 and 0.9 < row["height"] < 1.1
    assert row["membrane_area"] == pytest.approx(np.pi, rel=0.05)  # that of the coarse polyhedron


def test_a_run_is_read_while_it_goes_on(tmp_path):
    seen = []

    def on_step(moment):
        run = vesdyn.open_run(tmp_path / "a")
        history = run.history
        seen.append(
            (run.status["state"], len(history["time"]), history["time"][-1] == moment.time, len(run.frames))
        )
        assert run.case == case_of()

    vesdyn.run_case(case_of(), tmp_path / "a", on_step=on_step, progress=False)
    assert [steps for _, steps, *_ in seen] == list(range(1, 11)) and all(last for *_, last, _ in seen)
    assert {state for state, *_ in seen} == {"running"}
    assert [frames for *_, frames in seen] == [1] * 3 + [2] * 6 + [3]
    run = vesdyn.open_run(tmp_path / "a")
    assert run.status["state"] == "finished" and run.times == [0.0, 0.008, 0.02]
    profile = run.profile(0.008)
    assert (
        profile.density.shape == profile.height.shape == (len(run.final.position),)
        and profile.height[0] == 0.0
    )


# Two exceptions ------------------------------------------------------------------------------------------

UNSOLVABLE = {"solver.max_iterations": 3, "solver.tolerance": 1e-9}


def told(call, kind, *arguments, **keys):
    """The sentence with which ``call`` fails."""
    with pytest.raises(kind) as caught:
        call(*arguments, **keys)
    assert type(caught.value) is not Exception and isinstance(
        caught.value, (vesdyn.CaseError, vesdyn.RunError)
    )
    text = str(caught.value)
    assert text.rstrip()[-1] in ".?" and not any(
        word in text for word in ("pydantic", "Traceback", "validation error")
    )
    return text


def files(folder):
    """Inputs that cannot be used, each under its name."""
    (folder / "typo.yaml").write_text("name: a\nadhesion: {tracton: 1}\n")
    (folder / "broken.yaml").write_text("name: [a\n")
    (folder / "open.ply").write_text("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                                     "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
                                     "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")  # fmt: skip
    (folder / "mesh.yaml").write_text("name: a\nmodel: surface\nmesh: {file: open.ply}\n")
    (folder / "gone.yaml").write_text("name: a\nmodel: surface\nmesh: {file: gone.ply}\n")
    (folder / "sweep.yaml").write_text("name: a\nsweep: {drag: [0.1, 0.2]}\n")
    (folder / "newton.yaml").write_text("name: a\nmodel: surface\nsolver: {method: newton}\n")
    return ["typo", "broken", "mesh", "gone", "sweep", "newton", "missing", "typicl"]


@pytest.mark.parametrize("name", ["typo", "broken", "mesh", "gone", "sweep", "newton", "missing", "typicl"])
def test_python_and_the_command_line_fail_with_one_sentence(name, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert name in files(tmp_path)
    path = f"{name}.yaml"

    def run():
        vesdyn.run_case(vesdyn.load_case(path), "out", progress=False)

    sentences = told(run, vesdyn.CaseError)
    assert main(["run", path, "--out", "out"]) == 2
    said = [line for line in capsys.readouterr().err.splitlines() if "warning: " not in line]
    assert said == [f"vesdyn: {line}" for line in sentences.splitlines()]
    assert not (tmp_path / "out" / "history.csv").exists()


def test_typing_errors_in_python_are_told_by_key():
    sentence = told(vesdyn.Case, vesdyn.CaseError, name="a", adhesion={"tracton": 1})
    assert sentence == "adhesion.tracton: unknown key, did you mean traction?"
    assert "did you mean" in told(vesdyn.Case, vesdyn.CaseError, name="a", **{"adhesion.tracton": 1})
    assert "did you mean" in told(vesdyn.load_case, vesdyn.CaseError, "typical", **{"adhesion.tracton": 1})
    assert "drag" in told(vesdyn.Case, vesdyn.CaseError, name="a", drag="much")
    moment = next(vesdyn.simulate(case_of()))
    assert (
        told(moment.__getitem__, vesdyn.CaseError, "bindin_area")
        == "bindin_area: unknown column; did you mean binding_area?"
    )
    assert "there are time, binding_area" in told(moment.__getitem__, vesdyn.CaseError, "qq")


def test_a_scene_that_is_not_planned_says_so():
    for keys in ({"model": "auto"}, {"model": "axisymmetric"}, {"model": "surface", "mesh": "auto"}):
        assert "let `vesdyn.plan(case)` choose it." in told(
            Spreading, vesdyn.CaseError, vesdyn.Case(name="a", **keys)
        )


@pytest.mark.parametrize(
    "call",
    [
        vesdyn.simulate,
        vesdyn.plan,
        lambda case: vesdyn.run_case(case, "x"),
        lambda case: vesdyn.run_batch([case]),
    ],
)
def test_the_name_of_a_case_is_no_case(call, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert told(call, vesdyn.CaseError, "typical").startswith(
        "typical: is no case; make one by vesdyn.load_case("
    )
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "columns, words",
    [
        ([SPREAD, SPREAD], "spread is there already"),
        ([SPREAD._replace(name="time")], "time is there already"),
        ([SPREAD._replace(name="a,b")], "cannot name a column"),
        ([lambda moment: 1.0], "write vesdyn.Column"),
    ],
)
def test_columns_that_cannot_be(columns, words, tmp_path):
    assert words in told(vesdyn.simulate, vesdyn.CaseError, case_of(), columns)
    assert words in told(vesdyn.run_case, vesdyn.CaseError, case_of(), tmp_path / "a", columns=columns)
    assert not (tmp_path / "a").exists()


def test_a_column_that_gives_no_number(tmp_path):
    nothing = SPREAD._replace(value=lambda moment: None)
    assert "spread gives null, which is no number" in told(
        lambda: [moment.row() for moment in vesdyn.simulate(case_of(), [nothing])], vesdyn.CaseError
    )


def test_no_balance_is_a_run_error_and_an_outcome_with_one_sentence(tmp_path, capsys):
    case = case_of("surface, fixed", **UNSOLVABLE)
    sentence = told(list, vesdyn.RunError, vesdyn.simulate(case))
    assert "stalled at a residual" in sentence and "reduce time.step" in sentence
    outcome = vesdyn.run_case(case, tmp_path / "a", progress=False)
    assert outcome.state == "failed" and outcome.reason == sentence
    (tmp_path / "a.yaml").write_text(case.to_yaml())
    assert main(["run", str(tmp_path / "a.yaml"), "--out", str(tmp_path / "b"), "--quiet"]) == 1
    assert capsys.readouterr().err == f"vesdyn: {tmp_path / 'b'}: {sentence}\n"


def test_directories_that_cannot_be_used(tmp_path, capsys):
    vesdyn.run_case(case_of(), tmp_path / "a", progress=False)
    other = case_of(drag=0.1)
    (tmp_path / "other.yaml").write_text(other.to_yaml())
    sentence = told(vesdyn.run_case, vesdyn.RunError, other, tmp_path / "a", progress=False)
    assert "drag: 0.07 there, 0.1 here" in sentence
    assert main(["run", str(tmp_path / "other.yaml"), "--out", str(tmp_path / "a"), "--quiet"]) == 2
    assert capsys.readouterr().err == f"vesdyn: {sentence}\n"
    columns = told(
        vesdyn.run_case,
        vesdyn.RunError,
        case_of(**{"time.end": 0.03}),
        tmp_path / "a",
        columns=[SPREAD],
        progress=False,
    )
    assert "has other columns (spread)" in columns
    for path in (tmp_path / "none", tmp_path / "other.yaml", 3, None):
        told(vesdyn.open_run, vesdyn.RunError, path)
    told(vesdyn.run_case, vesdyn.RunError, other, tmp_path / "other.yaml")
    run = vesdyn.open_run(tmp_path / "a")
    assert "there are 0, 0.008, 0.02" in told(run.frame, vesdyn.CaseError, 0.01)
    (tmp_path / "a" / "history.csv").write_text("time\n1\n")
    told(lambda: run.history, vesdyn.RunError)


def test_whatever_is_exported_says_what_it_is():
    for name in vesdyn.__all__:
        thing = getattr(vesdyn, name)
        assert len(inspect.getdoc(thing).split("\n")[0].split()) <= 25
        if inspect.isfunction(thing):
            hints = typing.get_type_hints(thing)
            needed = {
                p.name for p in inspect.signature(thing).parameters.values() if p.kind is not p.VAR_KEYWORD
            }
            assert hints.keys() == needed | {"return"}, name
    assert set(vesdyn.__all__) <= set(dir(vesdyn))
    with pytest.raises(AttributeError):
        vesdyn.simulat
