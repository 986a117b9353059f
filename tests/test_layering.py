"""The plan of the package, docs/house.py: imports from lower rungs only, and a page that is what the sources say."""

import importlib.util
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
_spec = importlib.util.spec_from_file_location("house", ROOT / "docs" / "house.py")
house = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(house)


def test_imports_are_found_in_each_form():
    source = "import vesdyn.case\nfrom vesdyn import run\ndef f():\n    from vesdyn.cli import main"
    assert house.imported_modules(source) == {"case", "run", "cli"}


def test_the_ladder_holds_what_there_is():
    assert sorted(module for names in house.LADDER for module in names) == house.modules()


@pytest.mark.parametrize("module", house.modules())
def test_module_imports_from_lower_rungs_only(module):
    below = set().union(*house.LADDER[: house.rung(module)])
    assert house.imported_modules((house.PACKAGE / f"{module}.py").read_text()) <= below


def test_the_page_is_what_the_script_writes():
    assert house.PAGE.read_text() == house.page(), "run `python docs/house.py`"
    assert house.EXTENDING.read_text() == house.extending(), "run `python docs/house.py`"
    assert "docs/house.md" in (ROOT / "README.md").read_text()


def test_files_that_the_wishes_name_exist():
    assert len(house.WISHES) == 9
    for _, _, after, how in house.WISHES:
        assert all((ROOT / file.removeprefix("+")).is_file() for file in after) and how.endswith(".")


def test_files_that_the_wishes_name_existed_before():
    """Where the history of the sources is at hand."""
    known = (
        shutil.which("git")
        and subprocess.run(["git", "cat-file", "-e", house.BEFORE], cwd=ROOT, capture_output=True).returncode
        == 0
    )
    if not known:
        pytest.skip("no history here")
    listed = subprocess.run(
        ["git", "ls-tree", "-r", "--name-only", house.BEFORE], cwd=ROOT, capture_output=True, text=True
    )
    assert {file.removeprefix("+") for _, before, *_ in house.WISHES for file in before} <= set(
        listed.stdout.split("\n")
    )
