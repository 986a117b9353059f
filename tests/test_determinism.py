"""The same case gives the same bits, whatever number of threads the libraries may use."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

QUICK = Path(__file__).parents[1] / "configs" / "quick.yaml"
THREADS = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@pytest.mark.parametrize("model", ["surface", "axisymmetric"])
def test_one_thread_two_threads_and_twice(tmp_path, model):
    for name, threads in (("one", "1"), ("two", "2"), ("again", "2")):
        subprocess.run(
            [sys.executable, "-m", "vesdyn", "run", QUICK, "--out", tmp_path / name, "--quiet",
             "--set", f"model={model}", "time.end=0.02", "output.frames=[0.02]"],
            check=True,
            env=os.environ | dict.fromkeys(THREADS, threads),
        )  # fmt: skip
    for other in ("two", "again"):
        for file in ("history.csv", "frames.h5"):
            assert (tmp_path / "one" / file).read_bytes() == (tmp_path / other / file).read_bytes()


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
