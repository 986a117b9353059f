"""The cache of compiled kernels is keyed by what they are compiled from, and by nothing else."""

from pathlib import Path

from vesdyn import _jit, provenance

PACKAGE = Path(_jit.__file__).parent


def names(package=PACKAGE):
    return {file.stem for file in provenance.compiled_modules(package)}


def test_every_kernel_and_what_it_imports_counts_and_pictures_do_not():
    kernels = {file.stem for file in PACKAGE.glob("*.py") if "@njit" in file.read_text()}
    assert kernels <= names()
    assert "meshing" in names()  # imported by a module with kernels
    assert not {"pictures", "storage", "run", "cli", "case"} & names()


def test_a_helper_reached_through_another_module_counts(tmp_path):
    (tmp_path / "law.py").write_text("from vesdyn._jit import njit\nfrom vesdyn import helper\n")
    (tmp_path / "helper.py").write_text("from vesdyn.constant import ONE\n")
    (tmp_path / "constant.py").write_text("ONE = 1.0\n")
    (tmp_path / "picture.py").write_text("from vesdyn import law\n")
    assert names(tmp_path) == {"law", "helper", "constant"}
