"""Whatever happens to a file of a run, it goes on to the same bits or is refused with a remedy that works."""

import os
import re
import shutil
import subprocess
import warnings
from pathlib import Path

import pytest
from stand_in import assert_same, interrupt_at

from vesdyn import batch, files
from vesdyn.case import Case
from vesdyn.cli import main
from vesdyn.errors import RunError
from vesdyn.provenance import identity
from vesdyn.results import open_run
from vesdyn.run import run_case
from vesdyn.storage import DamagedRunError, RunDirectory, RunDirectoryError

CASE = Case(name="a", time={"end": 0.006, "step": 0.001}, output={"frames": (0.002, 0.004), "checkpoint_minutes": 0.0})
OTHER = Case(name="a", time={"end": 0.006, "step": 0.002}, output={"frames": (0.002, 0.004), "checkpoint_minutes": 0.0})


def cut(file, other):
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])


def empty(file, other):
    file.write_bytes(b"")


def fill_with_nul(file, other):
    file.write_bytes(bytes(file.stat().st_size))


def end_in_nul(file, other):
    file.write_bytes(file.read_bytes() + bytes(600))


def end_in_text(file, other):
    file.write_bytes(file.read_bytes() + b"and: so [ on\n\xff\xfe\x80")


def flip_a_bit(file, other):
    content = bytearray(file.read_bytes())
    content[2 * len(content) // 3] ^= 4
    file.write_bytes(content)


def flip_the_first_bit(file, other):
    content = bytearray(file.read_bytes())
    content[0] ^= 1
    file.write_bytes(content)


def change_a_digit(file, other):
    content = bytearray(file.read_bytes())
    place = next((i for i in range(len(content) // 2, len(content)) if content[i : i + 1] in b"12345678"), 0)
    content[place] ^= 1
    file.write_bytes(content)


def swap(file, other):
    shutil.copyfile(other, file)


def remove(file, other):
    file.unlink()


HARMS = [
    cut, empty, fill_with_nul, end_in_nul, end_in_text, flip_a_bit, flip_the_first_bit, change_a_digit, swap, remove,
]  # fmt: skip
LEFT = ["case.yaml", "status.yaml", "history.csv", "columns.csv", "frames/0000.h5", "frames/0001.h5", "frames.h5",
        "frames.xdmf", "checkpoint.h5", "checkpoint_previous.h5", "summary.png"]  # fmt: skip
FEW_OR_ALL = [13, pytest.param(1, marks=pytest.mark.verify)]  # one in so many; 13 meets nearly each file and each harm


@pytest.fixture
def runs(physics, tmp_path):
    """A finished run, one that was interrupted, and one of another case that has all files."""
    run_case(CASE, tmp_path / "finished")
    physics.before_step = interrupt_at(3)
    run_case(CASE, tmp_path / "interrupted")
    physics.before_step = staticmethod(lambda steps: None)
    run_case(OTHER, tmp_path / "other")
    return tmp_path


def harmed(runs, state, name, harm):
    """A copy of the run in ``state`` with its file ``name`` harmed."""
    path = runs / "harmed"
    shutil.rmtree(path, ignore_errors=True)
    shutil.copytree(runs / state, path)
    harm(path / name, runs / "other" / name)
    return path


def harmed_runs(runs, state, every):
    """Path, name and harm of one in ``every`` of all harms to all files of the run in ``state``."""
    pairs = [(name, harm) for name in LEFT if (runs / state / name).exists() for harm in HARMS]
    for name, harm in pairs[::every]:
        yield harmed(runs, state, name, harm), name, harm


def quietly(function, *arguments, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return function(*arguments, **options)


@pytest.mark.fault("n14", "n15", "n5", "n2")
@pytest.mark.parametrize("every", FEW_OR_ALL)
@pytest.mark.parametrize("state", ["interrupted", "finished"])
def test_run_goes_on_to_the_same_bits_or_says_how_to_begin_anew(runs, tried, state, every):
    for path, name, harm in harmed_runs(runs, state, every):
        tried["damages"] += 1
        try:
            outcome = quietly(run_case, CASE, path)
        except RunDirectoryError as refusal:
            assert "--restart" in str(refusal) and str(path) in str(refusal), (name, harm)
            assert "\n" not in str(refusal)
            outcome = quietly(run_case, CASE, path, restart=True)
        assert outcome.state == "finished", (name, harm)
        assert_same(path, runs / "finished")
        assert not RunDirectory(path).faults()
        assert (path / "summary.png").read_bytes() == b"a picture"
        assert "drag" in (path / "case.yaml").read_text()


@pytest.mark.fault("n14", "n15")
@pytest.mark.parametrize("every", FEW_OR_ALL)
@pytest.mark.parametrize("state", ["interrupted", "finished"])
def test_resume_and_info_speak_in_sentences(runs, tried, capsys, state, every):
    for path, name, harm in harmed_runs(runs, state, every):
        tried["damages"] += 1
        for command in (["info", str(path)], ["resume", str(path), "--quiet"]):
            status = main(command)
            words = capsys.readouterr().err
            assert status in (0, 1, 2), (name, harm)
            assert (status != 0) <= ("--restart" in words or "give" in words), (name, harm, command, words)
            assert all(line.startswith("vesdyn: ") for line in words.splitlines())
            if command[0] == "resume" and status == 0:
                assert_same(path, runs / "finished")


@pytest.mark.fault("n15")
@pytest.mark.parametrize("every", FEW_OR_ALL)
@pytest.mark.parametrize("state", ["interrupted", "finished"])
def test_a_batch_computes_anew_what_cannot_go_on(runs, tried, state, every):
    sign = batch._Sign(runs / "sign")
    sign.stop("")
    for path, name, harm in harmed_runs(runs, state, every):
        if name != "case.yaml" or harm not in (swap, change_a_digit):  # a run of another case is left alone
            tried["damages"] += 1
            outcome, _ = quietly(batch._carry_out, CASE, path, False, sign, identity())
            assert outcome.state == "finished", (name, harm, outcome.reason)
            assert_same(path, runs / "finished")


@pytest.mark.fault("n14")
@pytest.mark.parametrize("tail", [bytes(4096), b"0.5,nan", b"text\n", b"0.1,\xff\xfe\n", b"1,2,3,4,5,6,7,8\n", b"\n\n\n"])
def test_rows_after_the_checkpoint_that_do_not_parse_are_dropped(runs, tail):
    history = runs / "interrupted" / "history.csv"
    history.write_bytes(history.read_bytes() + tail)
    assert main(["info", str(runs / "interrupted")]) == 0
    assert run_case(CASE, runs / "interrupted").state == "finished"
    assert_same(runs / "interrupted", runs / "finished")


@pytest.mark.fault("n5")
def test_one_changed_digit_before_the_checkpoint_is_seen(runs):
    history = runs / "interrupted" / "history.csv"
    change_a_digit(history, None)
    with pytest.raises(DamagedRunError, match="history.csv is damaged; start anew"):
        quietly(run_case, CASE, runs / "interrupted")


@pytest.mark.fault("n5")
def test_swapped_and_damaged_parts_of_a_finished_run_are_seen(runs):
    """What is computed is refused; what follows from it is made anew."""
    for name, harm in (("frames/0001.h5", swap), ("frames/0001.h5", flip_a_bit), ("history.csv", change_a_digit)):
        with pytest.raises(DamagedRunError, match="start anew by"):
            run_case(CASE, harmed(runs, "finished", name, harm))
    for name, harm in (("summary.png", cut), ("frames.xdmf", cut), ("frames.h5", flip_a_bit), ("history.csv", end_in_text)):
        path = harmed(runs, "finished", name, harm)
        with pytest.warns(UserWarning, match=rf"{name} was damaged or gone and is made anew"):
            assert "finished already" in run_case(CASE, path).reason
        assert (path / name).read_bytes() == (runs / "finished" / name).read_bytes()
    path = harmed(runs, "finished", "status.yaml", change_a_digit)
    assert RunDirectory(path).status() == {} and RunDirectory(runs / "finished").status()["state"] == "finished"


@pytest.mark.fault("n2")
def test_a_checkpoint_is_bound_to_its_case(runs, capsys):
    path = runs / "interrupted"
    text = (path / "case.yaml").read_text()
    assert "drag: 0.07" in text
    (path / "case.yaml").write_text(text.replace("drag: 0.07", "drag: 0.09"))
    assert main(["resume", str(path)]) == 2
    words = capsys.readouterr().err
    assert "0.07" in words and "0.09" in words and "put the case back as it was" in words


@pytest.mark.fault("n2")
def test_a_checkpoint_of_another_run_is_refused(runs):
    for name in ("checkpoint.h5", "checkpoint_previous.h5"):
        shutil.copyfile(runs / "other" / name, runs / "interrupted" / name)
    with pytest.raises(DamagedRunError, match="is of another case"):
        quietly(run_case, CASE, runs / "interrupted")


@pytest.mark.fault("n15")
def test_a_file_of_nobody_here_stays(runs):
    path = runs / "interrupted"
    (path / "notes.txt").write_text("mine")
    (path / "frames" / "drawing.svg").write_text("mine")
    for name in ("case.yaml", "checkpoint.h5", "checkpoint_previous.h5"):
        (path / name).write_bytes(b"")
    run_case(CASE, path, restart=True)
    assert (path / "notes.txt").read_text() == (path / "frames" / "drawing.svg").read_text() == "mine"
    assert_same(path, runs / "finished")


@pytest.mark.fault("n15")
@pytest.mark.parametrize("state", ["interrupted", "finished"])
def test_a_folder_in_the_place_of_a_file_is_told_and_left_alone(runs, tried, state):
    for name in (name for name in LEFT if (runs / state / name).exists()):
        path = harmed(runs, state, name, remove)
        (path / name).mkdir()
        (path / name / "thesis.tex").write_text("mine")
        tried["damages"] += 1
        for restart in (False, True):
            try:
                quietly(run_case, CASE, path, restart=restart)
            except RunError as refusal:
                assert str(path) in str(refusal) and "\n" not in str(refusal)
        assert (path / name / "thesis.tex").read_text() == "mine"


@pytest.mark.fault("n15")
def test_a_file_that_cannot_be_read_is_named(runs, monkeypatch):
    reading = Path.read_bytes

    def locked(path):
        if path.name == "0001.h5":
            raise PermissionError(13, "Permission denied", str(path))
        return reading(path)

    monkeypatch.setattr(Path, "read_bytes", locked)
    with pytest.raises(DamagedRunError, match=r"frames/0001.h5 cannot be read \(Permission denied\); allow it, or start"):
        quietly(run_case, CASE, runs / "interrupted")


# While it runs


def put_another_in_place(file):
    content = file.read_bytes()
    file.unlink()
    file.write_bytes(content)


def add_a_line(file):
    with open(file, "ab") as opened:
        opened.write(b"mine\n")


@pytest.mark.fault("n15")
@pytest.mark.parametrize(
    "harm",
    [
        lambda path: shutil.rmtree(path),
        lambda path: path.rename(path.with_name("moved")),
        lambda path: (path.rename(path.with_name("moved")), shutil.copytree(path.with_name("finished"), path)),
        lambda path: (path / "history.csv").unlink(),
        lambda path: put_another_in_place(path / "history.csv"),
        lambda path: add_a_line(path / "history.csv"),
        lambda path: os.truncate(path / "history.csv", 30),
        lambda path: (path / "frames" / "0000.h5").unlink(),
        lambda path: shutil.rmtree(path / "frames"),
        lambda path: flip_a_bit(path / "frames" / "0000.h5", None),
    ],
)
def test_what_is_changed_under_a_run_is_not_said_to_be_finished(runs, physics, tried, harm):
    """A directory of the old name is not begun, and the rest not taken for the whole."""
    path = runs / "going"

    def before_step(steps):
        if steps == 3:
            harm(path)

    physics.before_step = staticmethod(before_step)
    tried["damages"] += 1
    with pytest.raises(RunError) as refusal:
        quietly(run_case, CASE, path)
    physics.before_step = staticmethod(lambda steps: None)
    assert "give the same command again" in str(refusal.value) or "--restart" in str(refusal.value)
    assert RunDirectory(path).status().get("state") != "finished" or "the directory" in str(refusal.value)
    try:
        outcome = quietly(run_case, CASE, path)
    except DamagedRunError:
        outcome = quietly(run_case, CASE, path, restart=True)
    assert outcome.state == "finished"
    assert_same(path, runs / "finished")


@pytest.mark.parametrize("name", ["case.yaml", "columns.csv"])
@pytest.mark.parametrize("text", [None, "name: b\ndrag: 3\nprovenance: {}\n"])
def test_case_and_columns_are_put_back_at_the_end(runs, physics, name, text):
    path = runs / "going"

    def before_step(steps):
        if steps == 3:
            (path / name).unlink() if text is None else (path / name).write_text(text)

    physics.before_step = staticmethod(before_step)
    assert quietly(run_case, CASE, path).state == "finished"
    assert open_run(path).case == CASE and open_run(path).history.units["time"] == "a0^2/D"


# What is read from Python


@pytest.mark.fault("n5", "n15")
@pytest.mark.parametrize("number", range(4))
def test_a_frame_that_is_gone_or_anothers_is_not_passed_over_in_silence(runs, tried, number):
    for harm, other in ((remove, None), (swap, 1 if number != 1 else 2)):
        path = harmed(runs, "finished", f"frames/{number:04d}.h5", remove)
        if harm is swap:
            shutil.copyfile(runs / "finished" / f"frames/{other:04d}.h5", path / f"frames/{number:04d}.h5")
        tried["damages"] += 1
        run = open_run(path)
        for read in (lambda: run.times, lambda: run.frames, lambda: run.final, lambda: run.frame(0.004), lambda: run.profile(0.0)):
            with pytest.raises(DamagedRunError, match="--restart"):
                read()
    shutil.copyfile(runs / "finished" / "frames/0001.h5", path / "frames/0004.h5")
    shutil.copyfile(runs / "finished" / f"frames/{number:04d}.h5", path / f"frames/{number:04d}.h5")
    assert open_run(path).final.time == 0.006 and len(open_run(path).times) == 4  # one too many is none of the run


@pytest.mark.fault("n2")
def test_a_case_that_was_edited_after_the_end_is_not_taken_for_that_of_the_run(runs, capsys):
    path = runs / "finished"
    text = (path / "case.yaml").read_text()
    (path / "case.yaml").write_text(text.replace("drag: 0.07", "drag: 0.09"))
    with pytest.warns(UserWarning, match="changed.*taken from the checkpoint"):
        assert open_run(path).case == CASE
    with pytest.raises(RunDirectoryError, match="drag: 0.07 there, 0.09 here"):
        quietly(run_case, Case(**{**CASE.given_keys(), "drag": 0.09}), path)
    assert main(["resume", str(path), "--quiet"]) == 0
    assert "drag: 0.07" in (path / "case.yaml").read_text()  # put back
    (path / "case.yaml").write_text(text.replace("drag: 0.07", "drag: 0.09"))
    for name in ("checkpoint.h5", "checkpoint_previous.h5"):
        (path / name).unlink()
    with pytest.raises(DamagedRunError, match="was changed after the run had finished; put it back as it was, or start"):
        open_run(path)


@pytest.mark.parametrize(
    "old, new",
    [("marks:", "marks_of_old:"), ("  frames:", "  more: 1\n  frames:"), ("wall_time", "wall"), ("state: finished", "state: done")],
)
def test_a_status_of_another_version_is_none(runs, old, new):
    """Its checksum is right, its keys are not ours: the run goes on from its checkpoint."""
    path = runs / "finished"
    body = (path / "status.yaml").read_text().rpartition("checksum: ")[0]
    assert old in body
    body = body.replace(old, new)
    (path / "status.yaml").write_text(f"{body}checksum: {files.checksum(body.encode())}\n")
    assert RunDirectory(path).status() == {} and not RunDirectory(path).faults()
    assert quietly(run_case, CASE, path).state == "finished"
    assert_same(path, runs / "finished")


@pytest.mark.fault("n2")
@pytest.mark.parametrize(
    "changed", [{"frames": None}, {"frames": "x"}, {"history_size": "x"}, {"history_size": -1}, {"frames": 99}, {"case": ""}]
)
def test_a_checkpoint_of_another_version_is_refused(runs, changed):
    """Its checksum is right, its names are not ours."""
    path = runs / "interrupted"
    for name in ("checkpoint.h5", "checkpoint_previous.h5"):
        state, _, attributes = files.read_image((path / name).read_bytes())
        attributes = {key: value for key, value in {**attributes, **changed}.items() if value is not None}
        (path / name).write_bytes(files.image(state, attributes))
    with pytest.raises(DamagedRunError, match="--restart"):
        quietly(run_case, CASE, path)
    assert quietly(run_case, CASE, path, restart=True).state == "finished"
    assert_same(path, runs / "finished")


@pytest.mark.fault("n12")
@pytest.mark.parametrize("text", ["provenance: !!bool abc", "provenance: !!int ''", "&a [*a]", "provenance: " + "[" * 3000, "x: \0"])
def test_a_case_file_that_is_no_yaml_is_damaged(runs, text):
    (runs / "interrupted" / "case.yaml").write_text(text)
    assert quietly(run_case, CASE, runs / "interrupted").state == "finished"
    assert_same(runs / "interrupted", runs / "finished")


@pytest.mark.fault("n20")
@pytest.mark.parametrize("state", ["interrupted", "finished"])
def test_a_pipe_in_the_place_of_a_file_holds_nobody_up(runs, state):
    for name in (name for name in LEFT if (runs / state / name).exists()):
        path = harmed(runs, state, name, remove)
        os.mkfifo(path / name)
        RunDirectory(path).history(), RunDirectory(path).last_row(), RunDirectory(path).frame_times()
        try:
            outcome = quietly(run_case, CASE, path)
        except RunError as refusal:
            assert str(path) in str(refusal)
            (path / name).unlink()
            outcome = quietly(run_case, CASE, path, restart=True)
        assert outcome.state == "finished"
        assert_same(path, runs / "finished")


# Remedies


@pytest.mark.fault("n15")
@pytest.mark.parametrize("name", ["with space", "it's", "new\nline", "\x1b[31mred", "-x", "caf\udce9", "$(true)"])
def test_the_remedy_works_as_it_is_written(runs, capsys, monkeypatch, name):
    monkeypatch.chdir(runs)
    path = Path(name)
    shutil.copytree("finished", path)
    empty(path / "history.csv", None)
    main(["resume", "--", name])
    (words,) = capsys.readouterr().err.splitlines()
    assert words.isprintable()
    remedy = re.search("`vesdyn (.*)`", words)[1]
    parted = subprocess.run(["bash", "-c", f"printf '%s\\0' {remedy}"], capture_output=True, check=True).stdout
    assert quietly(main, [*map(os.fsdecode, parted.split(b"\0")[:-1]), "--quiet"]) == 0
    assert_same(path, runs / "finished")
