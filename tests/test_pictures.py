"""The picture of a run: the geometry it is drawn from, and that it shows what is there."""

import matplotlib.image
import numpy as np
import pytest
import trimesh

from vesdyn.body import elastic_energy
from vesdyn.case import Case
from vesdyn.errors import CaseError
from vesdyn.meridian import build_meridian
from vesdyn.meshing import graded_meridian, graded_sphere
from vesdyn.pictures import (
    ABOVE,
    BELOW,
    _read_frames,
    _start_energy,
    project,
    summary,
    vertex_normals,
    visible_faces,
)
from vesdyn.storage import RunDirectory
from vesdyn.surface import build_surface

CASE = Case(name="a", output={"frames": (0.01, 0.02, 0.03, 0.04, 0.05)}, time={"end": 0.05, "step": 0.01})
SPHERE = graded_sphere(0.1, 0.2)
MERIDIAN = graded_meridian(0.05, 0.1)
SEGMENTS = np.stack([np.arange(len(MERIDIAN) - 1), np.arange(1, len(MERIDIAN))], axis=1)


def write_case(path, case=CASE):
    path.mkdir()
    directory = RunDirectory(path)
    directory.case_file.write_text(case.to_yaml())
    return directory


def write_history(directory, n_steps, **columns):
    for i in range(1, n_steps + 1):
        row = {
            "time": 0.01 * i, "binding_area": 0.1 * i**0.5, "volume_error": -1e-13 * (i % 2),
            "receptor_number_error": 0.0, "elastic_energy": 0.01 * i, "adhesion_work": 0.03 * i,
            "dissipation": 0.019 * i, "iterations": 100 + i, "residual": 9e-5,
        }  # fmt: skip
        directory.append_history(row | columns)


def write_frames(directory, x, connectivity, times):
    """Store ``x``, flattened from frame to frame, with a density that rises towards the substrate."""
    for time in times:
        position = x * np.append(np.ones(x.shape[1] - 1), 1.0 - 2.0 * time)
        density = np.exp(1.0 - 2.0 * x[:, -1])
        directory.write_frame(time, connectivity, {"position": position, "density": density}, {})


@pytest.fixture(params=["surface", "meridian"])
def body(request):
    return SPHERE if request.param == "surface" else (MERIDIAN, SEGMENTS)


# Projection


@pytest.mark.parametrize("elevation", [ABOVE, BELOW, 90.0])
def test_projection_is_a_rotation(elevation):
    axes = np.array(project(np.eye(3), elevation))
    assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-15)
    assert np.linalg.det(axes) == pytest.approx(1.0)


def test_above_is_up_and_in_front_is_near():
    _, up, nearness = project(np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]), ABOVE)
    assert up[0] > 0.9 and nearness[1] > 0.9
    assert up[1] < 0.0  # the substrate in front of the contact is lower in the picture


@pytest.mark.parametrize("elevation", [ABOVE, BELOW])
def test_half_a_sphere_is_seen_and_the_nearest_part_of_it_last(elevation):
    x, faces = SPHERE
    right, up, nearness = project(x, elevation)
    seen = visible_faces(x, faces, elevation)
    assert np.all(np.diff(nearness[seen].mean(axis=1)) > -1e-14)  # the sum of three numbers, in two orders
    assert nearness[seen].max() == nearness.max()
    flat = trimesh.Trimesh(np.stack([right, up, 0.0 * up], axis=1), seen, process=False)
    assert flat.area == pytest.approx(np.pi / 4.0, rel=0.03)  # a disc of diameter a0, no part of it covered twice


def test_normals_of_a_sphere_are_radial():
    x, faces = SPHERE
    radial = x - [0.0, 0.0, 0.5 * x[:, 2].max()]
    radial /= np.linalg.norm(radial, axis=1, keepdims=True)
    assert np.sum(vertex_normals(x, faces) * radial, axis=1).min() > 0.99


# Reading a run


@pytest.mark.parametrize("prestretch", [1.0, 1.1])
def test_start_energy_is_that_of_the_bodies(prestretch):
    case = Case(name="a", membrane={"prestretch": prestretch})
    surface = build_surface(*SPHERE, case.membrane.shear_modulus, prestretch)
    meridian = build_meridian(MERIDIAN, case.membrane.shear_modulus, prestretch)
    for x, made in ((SPHERE[0], surface), (MERIDIAN, meridian)):
        energy = _start_energy(case.membrane, x, made.topology)
        assert energy == pytest.approx(elastic_energy(made, x), rel=1e-12, abs=1e-14)


def test_first_shapes_after_the_start_are_shown(tmp_path, body):
    directory = write_case(tmp_path / "a")
    write_frames(directory, *body, [0.0, 0.01, 0.02, 0.03, 0.04, 0.05])
    _, shapes = _read_frames(directory, CASE.membrane)
    assert [shape.time for shape in shapes] == [0.01, 0.02, 0.03, 0.04]
    for shape in shapes:
        assert trimesh.Trimesh(shape.vertices, shape.faces, process=False).volume > 0.0
        assert shape.density == pytest.approx(np.exp(1.0 - 2.0 * shape.vertices[:, 2] / (1.0 - 2.0 * shape.time)))


# Drawing


def colored_share(picture):
    """Share of the pixels of the snapshots, the upper part of ``picture``, that are neither white nor grey."""
    upper = picture[: picture.shape[0] * 6 // 10, : picture.shape[1] * 9 // 10, :3]
    return np.mean(np.ptp(upper, axis=2) > 0.1)


def test_summary_shows_the_vesicles(tmp_path, body):
    directory = write_case(tmp_path / "a")
    write_history(directory, 5)
    write_frames(directory, *body, [0.0, 0.01, 0.02, 0.03, 0.04])
    assert summary(tmp_path / "a") == directory.summary_file
    picture = matplotlib.image.imread(directory.summary_file)
    assert picture.shape == (1200, 1800, 4)
    assert 0.3 < colored_share(picture) < 0.7
    assert {file.name for file in directory.path.iterdir()} == {"case.yaml", "history.csv", "frames", "summary.png"}


def test_same_run_gives_the_same_picture(tmp_path, body):
    directory = write_case(tmp_path / "a")
    write_history(directory, 3)
    write_frames(directory, *body, [0.0, 0.01])
    first = summary(directory.path).read_bytes()
    assert summary(directory.path).read_bytes() == first


@pytest.mark.parametrize("n_frames", [1, 2, 3])
def test_unfinished_run_is_drawn_as_far_as_it_went(tmp_path, n_frames):
    directory = write_case(tmp_path / "a")
    write_history(directory, 1)
    write_frames(directory, *SPHERE, [0.0, 0.01, 0.02][:n_frames])
    picture = matplotlib.image.imread(summary(directory.path))
    assert colored_share(picture) == pytest.approx(0.14 * max(1, n_frames - 1), rel=0.3)


def test_run_without_adhesion_and_without_errors_is_drawn(tmp_path, recwarn):
    directory = write_case(tmp_path / "a")
    write_history(directory, 3, binding_area=0.0, adhesion_work=0.0, volume_error=0.0, residual=0.0, iterations=0)
    write_frames(directory, *SPHERE, [0.0, 0.01])
    assert summary(directory.path).exists()
    assert not recwarn.list


# What cannot be drawn


def test_directory_without_a_case_is_refused(tmp_path):
    with pytest.raises(CaseError, match=r"case\.yaml"):
        summary(tmp_path)


@pytest.mark.parametrize("text", [None, "", "time,binding_area\n"])
def test_run_without_a_step_is_refused(tmp_path, text):
    directory = write_case(tmp_path / "a")
    write_frames(directory, *SPHERE, [0.0])
    if text is not None:
        directory.history_file.write_text(text)
    with pytest.raises(ValueError, match=r"history\.csv: holds no step yet; draw the run after its first step\."):
        summary(directory.path)


@pytest.mark.parametrize("empty", [False, True])
def test_run_without_a_frame_is_refused(tmp_path, empty):
    directory = write_case(tmp_path / "a")
    write_history(directory, 2)
    if empty:
        directory.frames_folder.mkdir()
    with pytest.raises(ValueError, match=r"frames: holds no frame; start the run anew with --restart\."):
        summary(directory.path)
    assert not directory.summary_file.exists()
