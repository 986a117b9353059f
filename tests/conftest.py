"""Puts this directory on the import path, for `measure`; one thread for the linear algebra of a test.

Several workers with several threads each wait for one another: eigenvalues took fifty times as long.
"""
import os

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(threads, "1")
