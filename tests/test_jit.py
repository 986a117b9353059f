"""The cache of compiled kernels is keyed by what they are compiled from, and by nothing else."""

import os
import subprocess
import sys
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


FOREIGN = """
from typing import NamedTuple
from vesdyn._jit import njit
from vesdyn.adhesion import Linear, TractionSeparation, adhesion_traction, shape

class Constant(NamedTuple):
    cutoff: float

@shape.register(Constant)
@njit
def constant(law, gap):
    return VALUE

for law in (Constant, Linear):
    print(adhesion_traction(TractionSeparation(law(0.1), 1.0, 8.0, False), 0.025, 1.0, 1.0))
"""


def test_a_law_from_outside_is_never_met_in_an_old_form(tmp_path):
    """The kernels of the package are cached for kinds of the package only: nobody hashes the files of others."""
    script, cache = tmp_path / "own.py", tmp_path / "cache"
    cache.mkdir(mode=0o700)
    for value in ("0.25", "0.5"):
        script.write_text(FOREIGN.replace("VALUE", value))
        done = subprocess.run(
            [sys.executable, "-c", "import own"], capture_output=True, text=True, check=True,
            env={**os.environ, "PYTHONPATH": f"{PACKAGE.parent}:{tmp_path}", "PYTHONDONTWRITEBYTECODE": "1", "NUMBA_CACHE_DIR": str(cache)},
        )  # fmt: skip
        assert done.stdout.split() == [value, "0.75"]
    assert list(cache.rglob("*.nbi"))  # what is ours is kept
