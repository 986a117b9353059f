"""The table of runs before and after a change tells the same from what differs, and by how much."""

import runpy
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[1] / "benchmarks" / "bits.py"


def write(folder, name, text):
    (folder / name).mkdir(parents=True)
    (folder / name / "history.csv").write_text(text)


def test_each_kind_of_difference_is_told(tmp_path, monkeypatch, capsys):
    old, new = tmp_path / "old", tmp_path / "new"
    both = "time,area\n0.1,1.0\n0.2,2.0\n"
    for folder in (old, new):
        write(folder, "a", both)
    write(old, "b", both)
    write(new, "b", "time,area\n0.1,1.0\n0.2,2.0000002\n")
    write(old, "c", both)
    write(new, "c", "time,area,more\n0.1,1.5,0\n0.2,2.0,0\n")
    write(old, "f", "time,height\n0.1,1.0\n0.2,2.0\n0.3,2.0\n")
    write(new, "f", "time,height\n0.1,1.0\n0.3,1.0\n")
    write(old, "d", "time\n0.10\nnan\n")
    write(new, "d", "time\n0.1\nnan\n")
    write(new, "e", both)
    monkeypatch.setattr(sys, "argv", ["bits.py", str(old), str(new)])
    runpy.run_path(str(SCRIPT), run_name="__main__")
    rows = [
        line.strip("| ").split(" | ")
        for line in capsys.readouterr().out.splitlines()
        if line.startswith("| ")
    ][1:]
    told = {name: (before == after, differs) for name, before, after, differs in rows}
    assert told == {
        "a": (True, "same"),
        "b": (False, "area by 1.0e-07 from row 2"),
        "c": (False, "more only after; area by 2.5e-01 from row 1"),
        "d": (False, "same numbers, written otherwise"),
        "e": (False, "only after"),
        "f": (
            False,
            "other steps, 3 before and 2 after; height by 5.0e-01 at t = 0.2, by 5.0e-01 at the end",
        ),
    }
    monkeypatch.setattr(sys, "argv", ["bits.py", str(tmp_path / "none"), str(tmp_path / "none")])
    with pytest.raises(SystemExit, match="hold no runs"):
        runpy.run_path(str(SCRIPT), run_name="__main__")
