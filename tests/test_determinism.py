"""The same case gives the same bits, whatever number of threads the libraries may use."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

QUICK = Path(__file__).parents[1] / "configs" / "quick.yaml"
THREADS = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


SCRIPT = """
import sys
from pathlib import Path
from vesdyn.case_file import load_case
from vesdyn.run import run_case
for model in ("surface", "axisymmetric"):
    case = load_case(sys.argv[1], ["mesh.front_edge=0.04", "time.end=0.02", "output.frames=[0.02]"], model=model)
    run_case(case, Path(sys.argv[2], model), progress=False, picture=False)
"""


def test_one_thread_and_two_threads_give_the_same_bits(tmp_path):
    """In two processes; the picture is left out, whose bits are compared in tests/test_pictures.py."""
    for threads in ("1", "2"):
        command = [sys.executable, "-c", SCRIPT, QUICK, tmp_path / threads]
        subprocess.run(command, check=True, env=os.environ | dict.fromkeys(THREADS, threads))
    for model in ("surface", "axisymmetric"):
        for file in ("history.csv", "frames.h5", "frames/0001.h5"):
            assert (tmp_path / "1" / model / file).read_bytes() == (tmp_path / "2" / model / file).read_bytes()


def test_interpreted_code_computes_the_same(tmp_path):
    """The kernels mean in plain Python what they mean compiled; only the order of rounding differs."""
    script = (
        "from vesdyn.case import Case; from vesdyn.run import simulate\n"
        "case = Case(name='x', model='axisymmetric', mesh={'front_edge': 0.08, 'far_edge': 0.15},"
        " time={'end': 0.01, 'step': 0.002}, output={'frames': ()}, solver={'tolerance': 1e-3})\n"
        "*_, last = simulate(case)\n"
        "print(last['binding_area'], last['pressure'], last['density_max'])"
    )
    compiled, interpreted = (
        [float(word) for word in subprocess.run(
            [sys.executable, "-c", script], check=True, capture_output=True, text=True,
            env=os.environ | {"NUMBA_DISABLE_JIT": disable},
        ).stdout.split()]
        for disable in ("0", "1")
    )  # fmt: skip
    assert interpreted == pytest.approx(compiled, rel=1e-9)  # round-off, grown over five relaxations
