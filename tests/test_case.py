"""The case: defaults and how they give way, refusals that are sentences, doubts, what decides the numbers."""

import itertools
import pickle

import numpy as np
import pytest

from vesdyn.case import SECTIONS, Case, Membrane, Mesh, continuation_conflicts
from vesdyn.errors import CaseError


def case(**keys):
    """A case with the ``keys``, dotted with a double underscore."""
    return Case(**{"name": "a"} | {key.replace("__", "."): value for key, value in keys.items()})


def refusal(**keys):
    """The sentences with which a case of ``keys`` is refused."""
    with pytest.raises(CaseError) as refused:
        case(**keys)
    return str(refused.value)


def test_defaults_are_the_typical_case():
    case = Case(name="typical")
    assert (case.membrane.shear_modulus, case.membrane.thickness, case.membrane.prestretch) == (1.81, 0.01, 1)
    assert (case.adhesion.traction, case.adhesion.cutoff, case.adhesion.ligand_ratio) == (2.416, 0.1, 8)
    assert (case.receptors.mobility, case.receptors.drift_number, case.receptors.frozen) == (2.1875, 17.5, False)
    assert (case.drag, case.mesh.front_edge, case.mesh.far_edge) == (0.07, 0.015, 0.05)
    assert (case.time.end, case.time.step) == (1.2, 0.001)
    assert case.output.frames == (0.008, 0.044, 0.128, 0.56)
    assert not case.warnings()


def test_case_is_frozen_comparable_and_picklable():
    case = Case(name="a", drag=0.1)
    with pytest.raises(CaseError, match="drag: a case cannot be changed in place"):
        case.drag = 1.0
    with pytest.raises(CaseError, match="cannot be changed in place"):
        case.membrane.shear_modulus = 1.0
    with pytest.raises(CaseError, match="cannot be changed in place"):
        del case.drag
    again = pickle.loads(pickle.dumps(case))
    assert again == case and again.given("drag") and not again.given("mesh")
    assert case != Case(name="a", drag=0.08)
    assert hash(case) == hash(Case(name="a", drag=0.1))


@pytest.mark.parametrize(
    "receptors, drift_number",
    [
        ({}, 8 * 2.1875),
        ({"mobility": 2}, 16),
        ({"drift_number": 12}, 12),
        ({"mobility": 2, "drift_number": 16}, 16),
        ({"mobility": None, "drift_number": 12}, 12),
        ({"mobility": None, "drift_number": None}, 8 * 2.1875),
    ],
)
def test_drift_number_is_resolved(receptors, drift_number):
    case = Case(name="a", receptors=receptors)
    assert case.drift_number == case.receptors.drift_number == drift_number
    assert case.receptors.mobility == drift_number / 8


# In Python the same sentences as on the command line


@pytest.mark.parametrize(
    "keys, sentence",
    [
        ({"adhesion": {"tracton": 1}}, "adhesion.tracton: unknown key, did you mean traction?"),
        ({"adhesion.tracton": 1}, "adhesion.tracton: unknown key, did you mean traction?"),
        ({"drga": 1}, "drga: unknown key, did you mean drag?"),
        ({"thickness": 0}, "thickness: unknown key, did you mean membrane.thickness?"),
        ({"drag": "0.1"}, "drag: '0.1' is not a number; write a plain one such as 0.07, without quotes or units."),
        ({"drag": None}, "drag: null is not a number; write a plain one such as 0.07, without quotes or units."),
        ({"drag.x": 1}, "drag.x: drag holds a value and has no keys in it; see `vesdyn template`."),
        ({"time.end": 1, "time": {"end": 2}}, "time: is given twice; give it once."),
        ({"time.order": True}, "time.order: true is not available; choose 1 or 2."),
        ({"mesh.front_edge": "fine"}, "mesh.front_edge: fine is neither a number nor auto; write one of them, without"
         " quotes or units."),
        ({"mesh.front_edge": [1]}, "mesh.front_edge: [1] is neither a number nor auto; write one of them, without"
         " quotes or units."),
        ({"mesh.front_edge": -1}, "mesh.front_edge: -1 is out of range; it must be greater than 0."),
        ({"mesh.front_edge": 1e-9}, "mesh.front_edge: 1e-09 is out of range; it must be at least 1e-05."),
        ({"drag": 5e-324}, "drag: 5e-324 is out of range; it must be 0 or at least 1e-15."),
        ({"membrane": 3}, "membrane: 3 is not a section with keys; write for instance `{key: value}`, or leave it out."),
        ({"membrane": object()}, "membrane: a value of type object is not a section with keys; write for instance"
         " `{key: value}`, or leave it out."),
        ({"receptors": {"mobility": 2, "drift_number": 12}}, "receptors.drift_number: 12 contradicts mobility x"
         " ligand_ratio = 16; give only one of the two (null leaves one out)."),
        ({"model": "axisymmetric", "perturbation.front": 0.02}, "perturbation.front: an axisymmetric body cannot carry"
         " it; set model to surface or auto, or front to 0."),
        ({"solver.max_iterations": 10**30}, f"solver.max_iterations: {10**30} is out of range; it must be at most 1e+09."),
        ({"perturbation.seed": 10**5000}, "perturbation.seed: a whole number of too many digits is out of range; it"
         " must be at most 9.22337e+18."),
        ({"name": "a\x1b[31m"}, "name: 'a\\x1b[31m' cannot name a directory; use letters, digits and, not first, '.',"
         " '_', '-', '='."),
        ({"output.frames": [0.1] * 1001}, "output.frames: [0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0..."
         " is too long; give at most 1000 values."),
    ],
)  # fmt: skip
def test_python_users_read_the_same_sentences(keys, sentence):
    assert refusal(**keys) == sentence
    with pytest.raises(CaseError) as refused:
        Case(name="a").changed(**keys)
    assert str(refused.value) == sentence


def test_a_case_without_a_name_and_a_wrong_section():
    with pytest.raises(CaseError, match="^name: missing; give it.$"):
        Case()
    with pytest.raises(CaseError, match="^thickness: -1 is out of range; it must be at least 0.$"):
        Membrane(thickness=-1)
    with pytest.raises(CaseError, match="^thicknes: unknown key, did you mean thickness"):
        case().membrane.model_copy(update={"thicknes": 0})


def test_at_most_twenty_sentences():
    lines = refusal(**{f"key{i}": i for i in range(1000)}).splitlines()
    assert len(lines) == 20
    assert lines[-1] == "key0: and 981 more faults; correct these first."


def test_numpy_is_as_good_as_python():
    a = case(drag=np.float32(0.5), output__frames=np.arange(0.1, 0.35, 0.1), perturbation__seed=np.int64(3))
    assert (a.drag, a.output.frames, a.perturbation.seed) == (0.5, (0.1, 0.2, 0.30000000000000004), 3)
    assert type(a.perturbation.seed) is int and type(a.drag) is float


# What was given, and changes


def test_given_tells_keys_that_were_written():
    a = case(mesh__front_edge=0.015, drag=0.07, membrane={})
    assert a.given("mesh.front_edge") and a.given("mesh") and a.given("drag") and a.given("name")
    assert not (a.given("mesh.far_edge") or a.given("membrane") or a.given("time.end") or a.given("accuracy"))
    assert a.given_keys() == {"name": "a", "drag": 0.07, "mesh": {"front_edge": 0.015}}
    with pytest.raises(CaseError, match="^mesh.front: unknown key, did you mean front_edge"):
        a.given("mesh.front")


def test_changed_validates_keeps_the_given_and_wins():
    a = case(receptors__mobility=2, mesh={"front_edge": 0.02, "far_edge": 0.06})
    b = a.changed(receptors={"drift_number": 20}, **{"time.end": 0.5})
    assert (b.drift_number, b.receptors.mobility, b.time.end) == (20, 2.5, 0.5)
    assert b.output.frames == (0.008, 0.044, 0.128)
    assert b.changed(**{"time.end": 1.2}).output.frames == Case(name="a").output.frames
    assert a.changed(**{"adhesion.ligand_ratio": 3}).drift_number == 6
    assert a.changed(mesh=Mesh(far_edge=0.1)).given_keys()["mesh"] == {"far_edge": 0.1}
    assert a.changed() == a and a.changed(mesh={"far_edge": 0.1}).mesh.front_edge == 0.02


def test_model_copy_validates_too():
    with pytest.raises(CaseError, match="^drag: x is not a number"):
        case().model_copy(update={"drag": "x"})
    mesh = case().mesh.model_copy(update={"front_edge": 0.03})
    assert case().model_copy(update={"mesh": mesh}).mesh.front_edge == 0.03


def test_written_frames_that_a_change_leaves_out_are_told():
    with pytest.warns(UserWarning, match="^output.frames: 0.8 is after the end of the run, 0.5, and left out.$"):
        assert case(output__frames=[0.1, 0.8]).changed(**{"time.end": 0.5}).output.frames == (0.1,)


# Nothing unwritten refuses what is written


@pytest.mark.parametrize(
    "keys, key, value",
    [
        ({"time.end": 0.5}, "output.frames", (0.008, 0.044, 0.128)),
        ({"time.end": 0.0005}, "output.frames", ()),
        ({"time.end": 0.0005}, "time.step", 0.0005),
        ({"time.end": 0.1, "perturbation.front": 0.02}, "perturbation.at", 0.05),
        ({"mesh.front_edge": 0.06}, "mesh.far_edge", 0.06),
        ({"mesh.far_edge": 0.01}, "mesh.front_edge", 0.01),
        ({"output.frames": [0.1, 3]}, "time.end", 3),
        ({"time.step": 2}, "time.end", 2),
        ({"perturbation.front": 0.02, "perturbation.at": 2}, "time.end", 2 + 1.2 - 0.14),
        ({"ligands.pattern": "stripes", "ligands.width": 1.5}, "ligands.period", 3),
        ({"ligands.pattern": "squares", "ligands.period": 0.2}, "ligands.width", 0.1),
    ],
)
@pytest.mark.fault("a04")
def test_defaults_give_way(keys, key, value):
    a = case(**keys)
    section, inner = key.split(".")
    assert getattr(getattr(a, section), inner) == value
    assert not a.given(key)


@pytest.mark.fault("n9")
def test_on_a_meridian_edges_and_step_not_given_are_auto():
    keys = ("front_edge", "far_edge")
    a = case(model="axisymmetric")
    assert [getattr(a.mesh, key) for key in keys] == ["auto", "auto"] and a.time.step == "auto"
    assert case(model="auto").mesh.front_edge == "auto" == case(model="auto").time.step
    assert case(model="auto", perturbation__amplitude=0.1).mesh.front_edge == 0.015  # will be a surface
    b = case(model="axisymmetric", mesh__front_edge=0.02, time__step=0.002)
    assert (b.mesh.front_edge, b.mesh.far_edge, b.time.step) == (0.02, "auto", 0.002)


@pytest.mark.parametrize(
    "keys, part",
    [
        ({"time.end": 0.5, "output.frames": [0.1, 0.8]}, "output.frames: 0.8 is after the end of the run, 0.5;"),
        ({"time.end": 0.5, "output.frames": [0.500000005]}, "output.frames: 0.500000005 is after the end"),
        ({"time.end": 0.1, "time.step": 0.2}, "time.step: 0.2 is longer than the whole run, end = 0.1;"),
        ({"perturbation.front": 0.02, "perturbation.at": 0.2, "time.end": 0.2}, "perturbation.at: 0.2 is not before"),
        ({"mesh.front_edge": 0.06, "mesh.far_edge": 0.05}, "mesh.front_edge: 0.06 is longer than far_edge = 0.05;"),
        ({"output.frames": [0.1, 0.1]}, "output.frames: 0.1 after 0.1 does not increase;"),
        ({"output.frames": [1e-12]}, "output.frames: 1e-12 is out of range;"),
        ({"ligands": {"pattern": "stripes", "width": 0.2, "period": 0.2}}, "ligands.width: 0.2 leaves nothing between"),
        ({"solver.method": "newton"}, "solver.method: newton cannot solve the balance of a surface;"),
        ({"perturbation.amplitude": 0.1, "receptors.frozen": True}, "perturbation.amplitude: frozen receptors are"),
        ({"perturbation.amplitude": 0.1, "perturbation.mode": 10**6, "mesh.front_edge": 0.04},
         "perturbation.mode: the mesh has 7.9e-05 nodes a wave"),
        ({"perturbation.amplitude": 0.1, "mesh.front_edge": 0.5, "mesh.far_edge": 0.5},
         "perturbation.amplitude: the mesh has 3.1 nodes a wave of mode 2"),
    ],
)  # fmt: skip
def test_written_contradictions_are_refused(keys, part):
    sentence = refusal(**keys)
    assert sentence.startswith(part) and sentence.endswith(".")


@pytest.mark.fault("a07")
def test_times_within_a_rounding_are_one():
    a = case(time__end=0.3, output__frames=[0.1, 0.2, 0.2 * (1 + 1e-12), 0.30000000000000004])
    assert a.output.frames == (0.1, 0.2, 0.3) and a.marks == (0.1, 0.2, 0.3)
    b = case(perturbation__front=0.02, perturbation__at=0.14, output__frames=[0.14 * (1 + 1e-12)], time__end=1)
    assert b.marks == (0.14, 1)
    assert case(time__end=0.3, time__step=0.30000000000000004).time.step == 0.3


# What is doubtful


@pytest.mark.parametrize(
    "keys, key",
    [
        ({"mesh.front_edge": 0.04}, "adhesion.cutoff"),
        ({"time.step": 0.01}, "time.step"),
        ({"time.step": 1e-7}, "time.step"),
        ({"adhesion.traction": 0.001}, "adhesion.traction"),
        ({"adhesion.ligand_ratio": 0.5}, "adhesion.ligand_ratio"),
        ({"drag": 0}, "drag"),
        ({"membrane.thickness": 0.2}, "membrane.thickness"),
        ({"perturbation.amplitude": 0.1, "perturbation.mode": 30}, "perturbation.mode"),
        # given, and idle
        ({"model": "axisymmetric", "solver.method": "newton", "solver.damping": "kinetic"}, "solver.damping"),
        ({"model": "axisymmetric", "mesh.layout": "rings"}, "mesh.layout"),
        ({"time.stop_when_steady": True}, "time.stop_when_steady"),
        ({"perturbation.mode": 3}, "perturbation.mode"),
        ({"perturbation.seed": 3}, "perturbation.seed"),
        ({"perturbation.at": 0.1}, "perturbation.at"),
        ({"adhesion.well": 0.1}, "adhesion.well"),
        ({"adhesion.barrier": 0.1}, "adhesion.barrier"),
        ({"adhesion.tail": 0.1}, "adhesion.tail"),
        ({"ligands.width": 0.1}, "ligands.width"),
        ({"ligands.elsewhere": 0.1}, "ligands.elsewhere"),
        ({"ligands.blur": 0.1}, "ligands.blur"),
        ({"ligands.period": 0.1}, "ligands.period"),
        ({"ligands.pattern": "disc", "ligands.period": 0.1}, "ligands.period"),
        ({"receptors.frozen": True, "receptors.mobility": 1}, "receptors.mobility"),
        ({"receptors.frozen": True, "receptors.drift_number": 1}, "receptors.drift_number"),
        ({"receptors.frozen": True, "adhesion.ligand_ratio": 2}, "adhesion.ligand_ratio"),
        ({"accuracy": 0.02, "solver.tolerance": 1e-3, "mesh.front_edge": 0.02, "mesh.far_edge": 0.05,
          "time.step": 0.001}, "accuracy"),
    ],
)  # fmt: skip
@pytest.mark.fault("n11")
def test_doubtful_and_idle_keys_are_warned_of(keys, key):
    (doubt,) = case(**keys).warnings()
    assert doubt.startswith(f"{key}: ") and doubt.endswith(".")


@pytest.mark.fault("n4")
def test_a_front_without_traction_is_doubtful():
    doubts = case(perturbation__front=0.1, adhesion__traction=0).warnings()
    assert [doubt.split(":")[0] for doubt in doubts] == ["adhesion.traction", "perturbation.front"]


def test_idle_defaults_are_not_warned_of():
    assert case().warnings() == case(model="axisymmetric").warnings() == case(time__step="auto").warnings() == []
    assert case(time__stop_when_steady=False).warnings() == []


def test_a_given_mesh_and_step_that_miss_the_given_wish_are_told():
    keys = {"mesh.front_edge": 0.02, "time.step": 0.004}
    sentences = case(accuracy="0.1%", **keys).missed_wish(0.07, 0.036)
    assert [sentence.split(":")[0] for sentence in sentences] == ["mesh.front_edge", "time.step"]
    assert "7.0% of the binding area, and accuracy asks for 0.001" in sentences[0]
    assert case(**keys).missed_wish(0.07, 0.036) == []  # a wish by default refuses nothing
    assert case(accuracy=0.1, **keys).missed_wish(0.07, 0.036) == []


# What decides the numbers

OTHER = {  # another value of each key
    "name": "b", "model": "auto", "accuracy": 0.02, "drag": 0.1,
    "membrane.shear_modulus": 1, "membrane.thickness": 0, "membrane.prestretch": 1.1,
    "adhesion.traction": 2, "adhesion.cutoff": 0.2, "adhesion.ligand_ratio": 3, "adhesion.law": "linear",
    "adhesion.well": 0.4, "adhesion.barrier": 0.1, "adhesion.tail": 0.1,
    "ligands.pattern": "squares", "ligands.width": 0.2, "ligands.period": 0.5, "ligands.elsewhere": 0.1,
    "ligands.blur": 0.1, "receptors.mobility": 1, "receptors.drift_number": 4, "receptors.frozen": True,
    "perturbation.mode": 3, "perturbation.amplitude": 0.2, "perturbation.front": 0.01, "perturbation.at": 0.2,
    "perturbation.seed": 1, "perturbation.restart": True, "mesh.front_edge": 0.02, "mesh.far_edge": 0.06, "mesh.layout": "rings",
    "mesh.axes": [2, 1], "mesh.fine_angle": 90, "mesh.difficulty": 2,
    "time.end": 1.3, "time.step": "auto", "time.order": 1, "time.stop_when_steady": False,
    "output.frames": [0.1], "output.checkpoint_minutes": 1, "solver.tolerance": 1e-3, "solver.damping": "kinetic",
    "solver.max_iterations": 100, "solver.method": "newton",
}  # fmt: skip
BUSY = {  # nothing idle in it
    "adhesion.law": "double_well", "ligands.pattern": "stripes", "perturbation.amplitude": 0.1,
    "perturbation.front": 0.02, "time.step": "auto", "time.end": 1.2,
}  # fmt: skip
KEYS = [f"{section}.{key}" if key else section for section in SECTIONS for key in SECTIONS[section] or [""]]
KEYS = [key for key in KEYS if key not in ("mesh.file", "mesh.sha256") and not key.startswith("units.")]  # their own tests
UNDECISIVE = {"name", "output.checkpoint_minutes", "solver.max_iterations"}
IDLE_BY_DEFAULT = {
    "adhesion.well", "adhesion.barrier", "adhesion.tail", "ligands.width", "ligands.period", "ligands.elsewhere",
    "ligands.blur", "perturbation.mode", "perturbation.at", "perturbation.seed", "time.stop_when_steady",
    "adhesion.law",  # OTHER is the default here
}  # fmt: skip


@pytest.mark.parametrize("key", KEYS)
def test_the_hash_is_of_what_decides_the_numbers(key):
    if key == "solver.method":
        meridian = case(model="axisymmetric")
        assert meridian.changed(**{key: "newton"}).hash != meridian.hash
        return
    busy = case(**{k: v for k, v in BUSY.items() if (k, key) != ("perturbation.amplitude", "receptors.frozen")})
    if key == "perturbation.restart":
        busy = busy.changed(**{"perturbation.front": 0.0})
    other = {key: OTHER[key]} | ({"time.step": 0.001} if key == "time.step" else {})
    assert (busy.changed(**other).hash == busy.hash) == (key in UNDECISIVE)
    assert (case(**{key: OTHER[key]} if key != "name" else {}).hash == case().hash) == (
        key in UNDECISIVE | IDLE_BY_DEFAULT
    )


def test_the_hash_does_not_ask_whether_a_value_was_given_nor_how():
    written = Case(**case().resolved())
    assert written == case() and written.hash == case().hash and len(case().hash) == 64
    assert case(receptors__drift_number=16).hash == case(receptors__mobility=2).hash
    assert case(drag=0.0).hash == case(drag=-0.0).hash
    assert case(solver__tolerance=0.04 * 0.01).hash == case().hash


STORED = {"time.end": 0.02, "time.step": 0.001, "output.frames": [0.005, 0.015]}


@pytest.mark.parametrize(
    "stored, wanted, time, key",
    [
        ({}, {}, 0.01, None),
        ({}, {"name": "b", "output.checkpoint_minutes": 1, "solver.max_iterations": 9}, 0.01, None),
        ({}, {"solver.tolerance": 1e-2}, 0.01, None),
        ({}, {"time.end": 1.2}, 0.01, None),
        ({}, {"time.end": 1.2}, 0.02, None),  # finished
        ({}, {"time.end": 0.0305}, 0.02, None),
        ({}, {"time.end": 0.012, "output.frames": [0.005]}, 0.01, None),
        ({}, {"time.end": 0.008, "output.frames": [0.005]}, 0.01, "time.end"),
        ({"time.end": 0.0205}, {"time.end": 1.2}, 0.018, "time.end"),  # its last steps were shortened
        ({"time.end": 0.0205}, {"time.end": 1.2}, 0.015, None),  # and those up to its last frame not
        ({"time.end": 0.0205}, {"time.end": 1.2}, 0.0, None),
        ({"time.step": "auto"}, {"time.end": 1.2}, 0.018, None),
        ({}, {"output.frames": [0.005, 0.012]}, 0.01, None),
        ({}, {"output.frames": [0.005]}, 0.01, None),
        ({}, {"output.frames": [0.005 * (1 + 1e-12), 0.018]}, 0.01, None),
        ({}, {"output.frames": [0.008, 0.015]}, 0.01, "output.frames"),
        ({}, {"output.frames": [0.015]}, 0.01, "output.frames"),
        ({}, {"output.frames": [0.005, 0.015, 0.02], "time.end": 0.03}, 0.02, None),  # the last state is a frame
        ({}, {"drag": 0.1}, 0.01, "drag"),
        ({}, {"mesh.front_edge": 0.02}, 0.01, "mesh.front_edge"),
        ({}, {"time.step": 0.002}, 0.01, "time.step"),
        ({}, {"time.order": 1}, 0.01, "time.order"),
        ({}, {"accuracy": 0.02}, 0.01, None),  # decides the tolerance alone
        ({"time.step": "auto"}, {"accuracy": 0.02}, 0.01, "accuracy"),
        ({}, {"solver.damping": "kinetic"}, 0.01, "solver.damping"),
        ({}, {"receptors.mobility": 1}, 0.01, "receptors.drift_number"),
        ({}, {"perturbation.seed": 3}, 0.01, None),  # idle
        ({}, {"perturbation.front": 0.02, "perturbation.at": 0.018}, 0.01, "perturbation.front"),
        ({"time.step": "auto"}, {"time.stop_when_steady": False}, 0.01, None),
        ({"time.step": "auto", "time.stop_when_steady": False}, {"time.stop_when_steady": True}, 0.01,
         "time.stop_when_steady"),
    ],
)  # fmt: skip
@pytest.mark.fault("a05")
def test_what_may_change_when_a_run_goes_on(stored, wanted, time, key):
    stored, wanted = case(**STORED | stored), case(**STORED | {"time.step": stored.get("time.step", 0.001)} | wanted)
    conflicts = continuation_conflicts(stored, wanted, time)
    assert [conflict.split(":")[0] for conflict in conflicts][:1] == ([key] if key else [])


# Limits


@pytest.mark.fault("n13")
def test_the_limits_leave_finite_numbers():
    least = {"membrane.shear_modulus": 1e-9, "adhesion.traction": 1e-15, "adhesion.cutoff": 1e-6, "drag": 1e-15,
             "adhesion.ligand_ratio": 1e-6, "receptors.drift_number": 1e-15, "mesh.front_edge": 1e-5,
             "time.end": 1e-9, "time.step": 1e-9, "membrane.thickness": 1e-6}  # fmt: skip
    most = {"membrane.shear_modulus": 1e12, "adhesion.traction": 1e12, "adhesion.cutoff": 1, "drag": 1e12,
            "adhesion.ligand_ratio": 1e6, "receptors.drift_number": 1e9, "mesh.front_edge": 0.5,
            "time.end": 1e6, "time.step": 1e6, "membrane.thickness": 0.5, "membrane.prestretch": 10}  # fmt: skip
    for a, b in itertools.product((least, most), repeat=2):
        mixed = {key: (a if i % 2 else b).get(key, most[key]) for i, key in enumerate(most)}
        if mixed["time.step"] > mixed["time.end"]:
            mixed["time.step"] = mixed["time.end"]
        told = " ".join(case(**mixed).warnings())
        assert "nan" not in told and "inf" not in told


@pytest.mark.parametrize(
    ("frames", "times"),
    [
        ({"every": 0.1}, [0.1, 0.2, 0.3]),
        ({"every": 0.14}, [0.14, 0.28]),
        ({"count": 3}, [0.1, 0.2, 0.3]),
        ({"count": 1}, [0.3]),
        ({"every": 0.3}, [0.3]),
    ],
)
def test_frames_by_interval_or_number(frames, times):
    made = case(**{"time.end": 0.3, "output.frames": frames})
    assert list(made.output.frames) == times and made.given_keys()["output"]["frames"] == frames
    assert list(made.changed(**{"time.end": 0.6}).output.frames)[-1] > 0.5  # listed anew


@pytest.mark.parametrize(
    ("frames", "sentence"),
    [
        ({}, "output.frames: is neither a list of times nor {every: 0.01} nor {count: 50}; write one of them."),
        ({"every": 0.1, "count": 2}, "output.frames: is neither"),
        ({"each": 0.1}, "output.frames: is neither"),
        ({"every": 0}, "output.frames.every: 0 is no interval of the run; give one from 0.0003 to 0.3."),
        ({"every": 1e-9}, "output.frames.every: 1e-09 is no interval"),
        ({"every": 0.4}, "output.frames.every: 0.4 is no interval"),
        ({"every": "often"}, "output.frames.every: often is no interval"),
        ({"every": "1 s"}, "output.frames.every: 1 s needs the scales of the scene"),
        ({"count": 0}, "output.frames.count: 0 is not a number of frames; give 1 to 1000."),
        ({"count": True}, "output.frames.count: true is not a number of frames"),
        ({"count": 1001}, "output.frames.count: 1001 is not a number of frames"),
    ],
)
def test_frames_that_are_refused(frames, sentence):
    with pytest.raises(CaseError) as error:
        case(**{"time.end": 0.3, "output.frames": frames})
    assert sentence in str(error.value)


@pytest.mark.parametrize(
    ("key", "value", "sentence"),
    [
        ("membrane.thickness", 1e-9, "1e-09 is out of range; it must be 0 or at least 1e-06."),
        ("drag", 1e-20, "1e-20 is out of range; it must be 0 or at least 1e-15."),
        ("membrane.shear_modulus", 1e13, "out of range; it must be at most 1e+12."),
    ],
)
def test_limits_of_either_side(key, value, sentence):
    with pytest.raises(CaseError) as refused:
        case(**{key: value})
    assert str(refused.value).startswith(f"{key}: ") and sentence in str(refused.value)
