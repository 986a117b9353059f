"""The run directory: bit-exact, readable after a kill, and refusing what is not its own."""

import xml.etree.ElementTree as ElementTree

import h5py
import numpy as np
import pytest
import yaml

from vesdyn import storage
from vesdyn.case import Case
from vesdyn.case_file import load_case
from vesdyn.storage import RunDirectory, RunDirectoryError

CASE = Case(name="a")
TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])


@pytest.fixture
def directory(tmp_path):
    """A run directory that is claimed for CASE."""
    directory = RunDirectory(tmp_path / "a")
    with directory.claim(CASE):
        yield directory


def write_frame(directory, time):
    rng = np.random.default_rng(1)
    nodes = {"position": rng.random((4, 3)), "density": rng.random(4) + time, "gap": rng.random(4)}
    directory.write_frame(time, TETRAHEDRON, nodes, {"tension_1": rng.random(4)})
    return nodes


# Claiming


def test_claimed_directory_holds_the_case_and_what_computed_it(directory):
    assert load_case(directory.case_file) == CASE
    provenance = yaml.safe_load(directory.case_file.read_text())["provenance"]
    assert provenance.keys() >= {"vesdyn", "commit", "python", "numba", "numpy", "scipy", "warnings"}


def test_warnings_are_stored_with_the_run(tmp_path):
    doubtful = Case(name="a", drag=0)
    with RunDirectory(tmp_path / "a").claim(doubtful) as directory:
        assert directory.origin()["warnings"] == doubtful.warnings() != []


def test_directory_in_use_is_refused(directory):
    assert directory.busy()
    with pytest.raises(RunDirectoryError, match="another process"):
        with RunDirectory(directory.path).claim(CASE):
            pass


def test_directory_is_free_afterwards_even_if_the_run_failed(tmp_path):
    directory = RunDirectory(tmp_path / "a")
    with pytest.raises(BlockingIOError):
        with directory.claim(CASE):
            raise BlockingIOError
    assert not directory.busy()


def test_directory_of_another_case_is_refused_with_the_difference(tmp_path):
    with RunDirectory(tmp_path / "a").claim(CASE):
        pass
    with pytest.raises(RunDirectoryError, match=r"drag: 0.07 there, 0.08 here.*--restart.*--out"):
        with RunDirectory(tmp_path / "a").claim(Case(name="a", drag=0.08)):
            pass


def test_restart_removes_the_earlier_run_but_no_other_file(tmp_path):
    with RunDirectory(tmp_path / "a").claim(CASE) as directory:
        directory.append_history({"time": 0.1})
        directory.write_checkpoint({"time": 0.1})
        directory.write_status("finished")
        write_frame(directory, 0.0)
    (tmp_path / "a" / "notes.txt").write_text("mine")
    other = Case(name="a", drag=0.08)
    with RunDirectory(tmp_path / "a").claim(other, restart=True):
        assert {file.name for file in directory.path.iterdir()} == {"case.yaml", "notes.txt"}
        assert load_case(directory.case_file) == other


@pytest.mark.parametrize("restart", [False, True])
@pytest.mark.parametrize("name", ["thesis.tex", "case.yaml"])
def test_directory_with_files_of_something_else_is_left_alone(tmp_path, name, restart):
    (tmp_path / name).write_text(CASE.to_yaml())
    with pytest.raises(RunDirectoryError, match="no run in it"):
        with RunDirectory(tmp_path).claim(CASE, restart):
            pass
    assert (tmp_path / name).read_text() == CASE.to_yaml()


def test_finished_run_is_not_noted_to_go_on_with_other_versions(tmp_path, monkeypatch):
    with RunDirectory(tmp_path / "a").claim(CASE) as directory:
        directory.write_status("finished")
    monkeypatch.setattr(storage, "provenance", lambda: {"numba": "0.0"})
    with RunDirectory(tmp_path / "a").claim(CASE):
        assert "resumed_with" not in directory.origin()


def test_going_on_with_other_versions_is_warned_of_and_noted_once(tmp_path, monkeypatch):
    with RunDirectory(tmp_path / "a").claim(CASE):
        pass
    now = storage.provenance()
    monkeypatch.setattr(storage, "provenance", lambda: now | {"numba": "0.0"})
    with pytest.warns(UserWarning, match="another numba"):
        with RunDirectory(tmp_path / "a").claim(CASE):
            pass
    with RunDirectory(tmp_path / "a").claim(CASE) as directory:
        assert [entry["numba"] for entry in directory.origin()["resumed_with"]] == ["0.0"]
        assert load_case(directory.case_file) == CASE


# History


def test_history_reads_back_to_the_same_bits(directory):
    rows = [{"time": 0.1 * i, "area": np.float64(np.pi) / i, "iterations": np.int64(i)} for i in range(1, 6)]
    for row in rows:
        directory.append_history(row)
    history = directory.history()
    for column in rows[0]:
        assert history[column].tolist() == [row[column] for row in rows]


def test_last_row_is_the_last_whole_one(directory):
    assert directory.last_row() == {}
    for i in range(200):
        directory.append_history({"time": i / 7, "area": np.pi * i})
        if i in (0, 199):
            assert directory.last_row() == {"time": i / 7, "area": np.pi * i}
    with open(directory.history_file, "a") as file:
        file.write("28.7")
    assert directory.last_row()["time"] == 199 / 7


def test_history_of_other_columns_is_refused(directory):
    directory.append_history({"time": 0.1, "area": 1.0})
    with pytest.raises(RunDirectoryError, match="other columns"):
        directory.append_history({"time": 0.2, "volume": 1.0})


def test_history_without_rows(directory):
    assert directory.history() == {}


def test_half_a_row_is_passed_over_and_dropped(directory):
    for time in (0.1, 0.2):
        directory.append_history({"time": time, "area": 1.0})
    whole = directory.history_file.read_bytes()
    directory.write_checkpoint({"time": 0.2})
    directory.history_file.write_bytes(whole + b"0.3")
    assert directory.history()["time"].tolist() == [0.1, 0.2]
    directory.history_file.write_bytes(whole + b"0.3\n")  # a line of its own, with a number too few
    assert directory.history()["time"].tolist() == [0.1, 0.2]
    RunDirectory(directory.path).restore(CASE)
    assert directory.history_file.read_bytes() == whole


def test_a_status_that_is_not_as_it_was_written_is_none(directory):
    directory.write_status("failed", "it diverged", 1.5)
    written = directory.status_file.read_text()
    assert directory.status()["wall_time"] == 1.5
    directory.status_file.write_text(written.replace("1.5", "2.5"))
    assert directory.status() == {}


# Going on


def test_going_on_drops_what_is_later_than_the_checkpoint(directory):
    for time in (0.0, 0.1, 0.2, 0.3):
        write_frame(directory, time)
        directory.append_history({"time": time})
        if time == 0.2:
            directory.write_checkpoint({"time": time})
    again = RunDirectory(directory.path)
    assert again.restore(CASE) == {"time": 0.2}
    assert again.history()["time"].tolist() == [0.0, 0.1, 0.2]
    assert again.frame_times() == [0.0, 0.1, 0.2]
    assert len(ElementTree.parse(again.xdmf_file).findall(".//Time")) == 3
    write_frame(again, 0.4)
    again.append_history({"time": 0.4})
    assert again.frame_times() == [0.0, 0.1, 0.2, 0.4] and again.last_row() == {"time": 0.4}


def test_without_a_checkpoint_all_begins_anew(directory):
    write_frame(directory, 0.0)
    directory.append_history({"time": 0.1})
    again = RunDirectory(directory.path)
    assert again.restore(CASE) is None
    assert again.frame_times() == [] and again.history() == {}


# Frames


def test_frames_are_stored_bit_for_bit(directory):
    written = {time: write_frame(directory, time) for time in (0.0, 0.008)}
    directory.write_series()
    assert directory.frame_times() == [0.0, 0.008]
    with h5py.File(directory.frames_file) as file:
        assert np.array_equal(file["connectivity"], TETRAHEDRON)
        for name, (time, nodes) in zip(("frame_0000", "frame_0001"), written.items()):
            assert file[name].attrs["time"] == time
            for array, values in nodes.items():
                assert np.array_equal(file[name][array], values)
    for frame, (time, nodes) in zip(directory.frames(), written.items(), strict=True):
        assert frame.time == time and np.array_equal(frame.connectivity, TETRAHEDRON)
        assert frame.nodes.keys() == nodes.keys() and frame.cells.keys() == {"tension_1"}
        assert all(np.array_equal(frame.nodes[name], nodes[name]) for name in nodes)


def test_frame_of_another_mesh_is_refused_and_leaves_the_file_as_it_was(directory):
    write_frame(directory, 0.0)
    with pytest.raises(ValueError, match="connectivity"):
        directory.write_frame(0.1, TETRAHEDRON[:3], {"position": np.zeros((4, 3))}, {})
    assert directory.frame_times() == [0.0]


def test_xdmf_refers_to_arrays_that_exist_with_their_shapes(directory):
    for time in (0.0, 0.008):
        write_frame(directory, time)
    directory.write_series()
    root = ElementTree.parse(directory.xdmf_file).getroot()
    assert [float(t.attrib["Value"]) for t in root.iter("Time")] == [0.0, 0.008]
    centers = {a.attrib["Name"]: a.attrib["Center"] for a in root.iter("Attribute")}
    assert centers == {"density": "Node", "gap": "Node", "tension_1": "Cell"}
    for item in root.iter("DataItem"):
        file, path = item.text.split(":")
        assert file in ("frames/0000.h5", "frames/0001.h5")
        with h5py.File(directory.path / file) as frames:
            assert " ".join(map(str, frames[path].shape)) == item.attrib["Dimensions"]


# Checkpoints

STATE = {
    "x": np.random.default_rng(2).standard_normal((5, 3)),
    "fortran": np.asfortranarray(np.random.default_rng(3).random((2, 3))),
    "held": np.array([True, False]),
    "none": np.zeros((0, 3)),
    "count": np.arange(3, dtype=np.int64),
    "time": 0.1 + 0.2,
    "steps": 7,
}


def test_checkpoint_is_bit_exact(directory):
    directory.write_checkpoint(STATE)
    state = directory.read_checkpoint()
    assert state.keys() == STATE.keys()
    for name, value in STATE.items():
        assert type(state[name]) is type(value)
        if isinstance(value, np.ndarray):
            assert state[name].dtype == value.dtype and state[name].shape == value.shape
        assert np.array_equal(state[name], value)


def test_no_checkpoint_yet(directory):
    assert directory.read_checkpoint() is None


def flip_a_bit(file):
    content = bytearray(file.read_bytes())
    place = content.find(STATE["x"].tobytes())
    content[place] ^= 1
    file.write_bytes(content)


@pytest.mark.parametrize(
    "damage", [flip_a_bit, lambda file: file.write_bytes(file.read_bytes()[:700]), lambda file: file.write_bytes(b"")]
)
def test_damaged_checkpoint_gives_way_to_the_one_before(directory, damage):
    directory.write_checkpoint(STATE | {"steps": 6})
    directory.write_checkpoint(STATE)
    assert directory.read_checkpoint()["steps"] == 7
    damage(directory.checkpoint_file)
    with pytest.warns(UserWarning, match="damaged"):
        assert directory.read_checkpoint()["steps"] == 6
    damage(directory.checkpoint_previous)
    with pytest.warns(UserWarning, match="damaged"), pytest.raises(RunDirectoryError, match="--restart"):
        directory.read_checkpoint()


def test_kill_between_the_two_moves_of_a_checkpoint(directory):
    directory.write_checkpoint(STATE)
    directory.checkpoint_file.rename(directory.checkpoint_previous)
    assert directory.read_checkpoint()["steps"] == 7


def test_unfinished_write_leaves_the_old_file(directory, monkeypatch):
    directory.write_checkpoint(STATE)
    with pytest.raises(TypeError):
        directory.write_checkpoint({"x": object()})
    assert directory.read_checkpoint()["steps"] == 7
    assert not list(directory.path.glob("*.part"))


def test_status(directory):
    assert directory.status() == {}
    directory.write_status("failed", "it diverged: shorten time.step", 1.5)
    assert directory.status() == {"state": "failed", "reason": "it diverged: shorten time.step", "wall_time": 1.5}
