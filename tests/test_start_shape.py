"""A start shape of the user's own: a spheroid on both bodies, and a closed mesh from a file."""

import warnings

import numpy as np
import pytest
import trimesh

from vesdyn.case import Case
from vesdyn.case_file import load_case
from vesdyn.diagnostics import Moment
from vesdyn.errors import CaseError
from vesdyn.planning import in_units, needs_planning, plan
from vesdyn.spreading import Spreading
from vesdyn.stepping import march
from vesdyn.storage import RunDirectory

COARSE = {"front_edge": 0.05, "far_edge": 0.1}
BRIEF = {"time": {"end": 0.01, "step": 0.002}, "output": {"frames": ()}}


@pytest.fixture
def cell(tmp_path):
    """A closed mesh of a flattened ball in some unit of length, and a case file beside it."""
    ball = trimesh.creation.icosphere(3, 2.0)
    ball.apply_scale([1.2, 1.2, 0.8])
    (tmp_path / "shapes").mkdir()
    ball.export(tmp_path / "shapes" / "cell.ply")
    (tmp_path / "a.yaml").write_text("name: a\nmodel: auto\nmesh: {file: shapes/cell.ply}\ntime: {end: 0.01, step: 0.002}\n")
    return tmp_path / "shapes" / "cell.ply"


def told(decisions, start):
    (found,) = [text for text in decisions if text.startswith(start)]
    return found


# Spheroids


@pytest.mark.parametrize("axes", [(1.3, 1.0), (1.0, 1.3)])
def test_bodies_agree_on_a_spheroid(axes):
    """The start shape is the stress-free one, and both bodies spread alike; their meshes differ by a few per cent."""
    seen = {}
    for model in ("axisymmetric", "surface"):
        sim = Spreading(Case(name="a", model=model, mesh={"front_edge": 0.025, "far_edge": 0.05, "axes": axes}, **BRIEF))
        assert sim.volume_0 == pytest.approx(np.pi / 6.0, rel=1e-12)
        assert abs(sim.elastic_energy_0) < 1e-12
        *_, state = march(sim)
        seen[model] = Moment(sim, state)
    for name in ("binding_area", "membrane_area", "height", "elastic_energy"):
        assert seen["surface"][name] == pytest.approx(seen["axisymmetric"][name], rel=0.05), name
    height = (axes[1] / axes[0]) ** (2.0 / 3.0)
    assert seen["surface"]["height"] == pytest.approx(height, rel=0.03)


def test_plan_tells_that_a_mesh_is_too_large(monkeypatch):
    monkeypatch.setattr("vesdyn.planning.machine_memory", lambda: 4e3)
    _, decisions = plan(Case(name="a", model="auto", accuracy=0.05, mesh=COARSE, **BRIEF))
    assert "of memory while the mesh is made; this machine has 4 kB, so the run would be refused." in told(decisions, "size:")


def test_flat_side_down_binds_more_at_once():
    """The contact of a spheroid is of curvature radius a^2/b: an oblate one has more membrane near the plane."""
    areas = []
    for axes in ((1.0, 1.3), (1.0, 1.0), (1.3, 1.0)):
        sim = Spreading(Case(name="a", model="axisymmetric", mesh={"front_edge": 0.01, "far_edge": 0.05, "axes": axes}))
        areas.append(Moment(sim, sim.start()).front(0.02)[0])
    # a cap of height d of a sphere of radius R has the area 2 pi R d
    radius = [0.5 * (a / b) ** (4.0 / 3.0) for a, b in ((1.0, 1.3), (1.0, 1.0), (1.3, 1.0))]
    assert areas == pytest.approx([2.0 * np.pi * r * 0.02 for r in radius], rel=0.05)


def test_plan_tells_the_reduced_volume_and_the_size():
    _, decisions = plan(Case(name="a", model="auto", accuracy=0.05, mesh={"axes": [2, 1], **COARSE}, **BRIEF))
    assert "a spheroid of axes 2 : 1, reduced volume 0.872; a0 is the diameter" in told(decisions, "start:")
    assert "nodes, " in told(decisions, "size:") and "steps take very roughly" in told(decisions, "size:")
    assert in_units(1.5e9, {"GB": 1e9, "MB": 1e6}) == "1,500 MB" and in_units(90.0, {"minutes": 60.0, "s": 1.0}) == "90 s"
    _, decisions = plan(Case(name="a", model="auto", accuracy=0.05, mesh=COARSE, **BRIEF))
    assert not any(text.startswith("start:") for text in decisions)


@pytest.mark.parametrize("axes, reason", [([20, 1], "are as 20 to 1"), ([1], "cannot be used|too short|at least"),
                                          ([1, 2, 3], "too long"), ([1, 0], "greater than 0"), (3.0, "not a list")])  # fmt: skip
def test_axes_that_are_no_spheroid_are_refused(axes, reason):
    with pytest.raises(CaseError, match=rf"^mesh\.axes.*({reason})"):
        Case(name="a", mesh={"axes": axes})


# A mesh from a file


def test_mesh_of_a_file_is_found_beside_the_case_and_run_as_a_surface(cell):
    case = load_case(cell.parents[1] / "a.yaml")
    assert case.mesh.file == str(cell) and case.breaks_axis and needs_planning(case)
    case, decisions = plan(case)
    assert case.model == "surface" and not needs_planning(case)
    assert told(decisions, "body:") == "body: surface; the scene is not axisymmetric (mesh.file)."
    assert "reduced volume 0.9" in told(decisions, "start:") and str(cell) in told(decisions, "mesh:")
    sim = Spreading(case)
    assert len(sim.x_start) == 642 and sim.volume_0 == pytest.approx(np.pi / 6.0, rel=1e-12)
    assert sim.x_start[:, 2].min() == 0.0 and abs(sim.elastic_energy_0) < 1e-12
    *_, state = march(sim)
    assert Moment(sim, state)["binding_area"] > 0.0


def test_mesh_file_is_found_from_a_base_and_from_the_working_directory(cell, monkeypatch):
    folder = cell.parents[1] / "elsewhere"
    folder.mkdir()
    (folder / "b.yaml").write_text("name: b\nbase: ../a.yaml\n")
    assert load_case(folder / "b.yaml").mesh.file == str(cell)
    monkeypatch.chdir(cell.parent)
    assert load_case(folder / "b.yaml", ["mesh.file=cell.ply"]).mesh.file == str(cell)
    assert Case(name="c", mesh={"file": "cell.ply"}).mesh.file == str(cell)


def test_content_of_the_mesh_decides_the_case_and_not_its_path(cell, tmp_path):
    one, copy = Case(name="a", mesh={"file": str(cell)}), tmp_path / "copy.ply"
    copy.write_bytes(cell.read_bytes())
    same = Case(name="a", mesh={"file": str(copy)})
    assert one.hash == same.hash and one.mesh.sha256 == same.mesh.sha256
    trimesh.creation.icosphere(2).export(copy)
    other = Case(name="a", mesh={"file": str(copy)})
    assert other.hash != one.hash and other != one
    with pytest.raises(CaseError, match=rf"^mesh\.file: {copy}: is not the file that this case was made with"):
        Spreading(same)


def test_stored_case_can_be_read_without_its_mesh(cell):
    case = Case(name="a", mesh={"file": str(cell)})
    stored = cell.parents[1] / "stored.yaml"
    stored.write_text(case.to_yaml())
    assert case.mesh.sha256 in stored.read_text()
    cell.unlink()
    assert load_case(stored) == case
    assert load_case(stored, ["time.end=0.5"]).mesh.sha256 == case.mesh.sha256
    trimesh.creation.icosphere(2).export(other := cell.parent / "other.ply")
    changed = load_case(stored, [f"mesh.file={other}"])
    assert changed.mesh.sha256 == Case(name="a", mesh={"file": str(other)}).mesh.sha256 != case.mesh.sha256
    with pytest.raises(CaseError, match=rf"^mesh\.file: {cell}: No such file or directory; give"):
        Spreading(case)
    with pytest.raises(CaseError, match=r"a\.yaml: mesh\.file: .*cell\.ply: No such file or directory; give the path"):
        load_case(cell.parents[1] / "a.yaml")


def test_run_stores_the_digest_of_its_mesh(cell, tmp_path):
    from vesdyn.run import run_case

    outcome = run_case(plan(load_case(cell.parents[1] / "a.yaml")).case, tmp_path / "run", progress=False)
    assert outcome.state == "finished"
    directory = RunDirectory(tmp_path / "run")
    assert load_case(directory.case_file).mesh.sha256 in directory.case_file.read_text()


def test_meridian_takes_no_triangles(cell):
    with pytest.raises(CaseError, match=r"^mesh\.file: an axisymmetric body has no triangles; set model to surface or auto\."):
        Case(name="a", model="axisymmetric", mesh={"file": str(cell)})


def test_edges_given_beside_a_file_are_told_to_decide_nothing(cell):
    case = Case(name="a", mesh={"file": str(cell), "front_edge": 0.02, "axes": [2, 1]})
    doubts = "\n".join(case.warnings())
    for key in ("mesh.front_edge", "mesh.axes"):
        assert f"{key}: is given and decides nothing here, since the mesh is that of mesh.file." in doubts
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert not any("mesh" in doubt for doubt in Case(name="a", mesh={"file": str(cell)}).warnings())


def test_digest_without_a_file_is_refused():
    with pytest.raises(CaseError, match=r"^mesh\.sha256: is that of a file, and mesh\.file is not given; leave it out\."):
        Case(name="a", mesh={"sha256": "0" * 64})
