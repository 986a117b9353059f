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
