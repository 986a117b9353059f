"""Puts this directory on the import path, for `measure`; one thread for the linear algebra of a test.

Several workers with several threads each wait for one another: eigenvalues took fifty times as long. No test waits
for the disk, either: none cuts the power.
"""
import os

import pytest

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(threads, "1")


@pytest.fixture(autouse=True)
def no_waiting_for_the_disk(monkeypatch):
    """Let ``os.fsync`` return at once."""
    monkeypatch.setattr(os, "fsync", lambda handle: None)
