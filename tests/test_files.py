"""What is written reaches the disk before anything stands on it, whole, and whatever fails is told."""

import errno
import os
from pathlib import Path

import pytest

from vesdyn import files, storage
from vesdyn.case import Case
from vesdyn.files import WriteError, replace_file, sync, sync_directory
from vesdyn.storage import RunDirectory

NOTED = ("open", "write", "fsync", "replace")


class Recorder:
    """The module ``os``; `calls` lists (call, name of the file) of those that change what is on the disk."""

    def __init__(self):
        self.calls, self.names = [], {}

    def __getattr__(self, name):
        call = getattr(os, name)
        return (lambda *arguments, **options: self._note(name, call, arguments, options)) if name in NOTED else call

    def _note(self, name, call, arguments, options):
        found = call(*arguments, **options)
        if name == "open":
            self.names[found] = Path(arguments[0]).name
        self.calls.append((name, self.names.get(arguments[0]) or Path(arguments[-1 if name == "replace" else 0]).name))
        return found


@pytest.fixture
def calls(monkeypatch):
    """The calls from here on that change what is on the disk, in their order."""
    recorder = Recorder()
    monkeypatch.setattr(files, "os", recorder)
    monkeypatch.setattr(storage, "os", recorder)
    return recorder.calls


def test_a_file_reaches_the_disk_before_it_takes_its_place(tmp_path, calls):
    replace_file(tmp_path, "a", b"content")
    here = tmp_path.name
    assert calls == [
        ("open", "a.part"), ("write", "a.part"), ("fsync", "a.part"), ("replace", "a"), ("open", here), ("fsync", here),
    ]  # fmt: skip


def test_a_checkpoint_comes_after_all_that_it_stands_on(tmp_path, calls):
    with RunDirectory(tmp_path / "a").claim(Case(name="a")) as directory:
        directory.write_frame(0.0, [[0, 1, 2]], {"position": [[0.0, 0.0, 0.0]] * 3}, {})
        directory.append_history({"time": 0.001, "binding_area": 0.1})
        directory.write_checkpoint({"time": 0.001})
    placed = calls.index(("replace", "checkpoint.h5"))
    last_row = max(i for i, call in enumerate(calls) if call == ("write", "history.csv"))
    assert last_row < calls.index(("fsync", "history.csv")) < placed
    assert all(calls.index(("replace", name)) < placed for name in ("case.yaml", "0000.h5", "frames.xdmf", "frames.h5"))


def test_a_write_may_take_part_of_what_it_is_given(tmp_path, monkeypatch):
    writing = os.write
    monkeypatch.setattr(os, "write", lambda handle, content: writing(handle, bytes(content)[:3]))
    replace_file(tmp_path, "a", b"0123456789")
    assert (tmp_path / "a").read_bytes() == b"0123456789"


@pytest.mark.parametrize("number, told", [(errno.EIO, True), (errno.ENOSPC, True), (errno.EINVAL, False), (errno.ENOTSUP, False)])
def test_errors_of_syncs_are_told_unless_the_file_system_has_none(tmp_path, monkeypatch, number, told):
    def fails(handle):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "fsync", fails)
    with open(tmp_path / "a", "wb") as file:
        for work in (lambda: sync(file.fileno()), lambda: sync_directory(tmp_path)):
            if told:
                with pytest.raises(OSError):
                    work()
            else:
                work()
    if told:
        with pytest.raises(WriteError, match="give the same command again"):
            replace_file(tmp_path, "b", b"content")
        assert not (tmp_path / "b").exists()
    else:
        replace_file(tmp_path, "b", b"content")


def test_a_write_that_fails_leaves_nothing_behind(tmp_path, monkeypatch):
    def full(handle, content):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(files.os, "write", full)
    with pytest.raises(files.WriteError, match="the disk is full"):
        files.replace_file(tmp_path, "a.txt", b"content")
    assert not list(tmp_path.iterdir())
