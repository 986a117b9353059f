"""Counts what was tried, and tells it in the end of `make faults`."""

import csv
from collections import Counter
from pathlib import Path

import pytest
from stand_in import put_in_place

TRIED = pytest.StashKey()


@pytest.fixture
def tried(request):
    """A counter: ``tried["damages"] += 1`` for each that was tried."""
    return request.config.stash.setdefault(TRIED, Counter())


@pytest.fixture
def physics(monkeypatch):
    """The stand-in for the physics; set its ``before_step``."""
    return put_in_place(monkeypatch)


def pytest_addoption(parser):
    parser.addoption("--tried", type=Path, metavar="FILE", help="write there what was tried, and how often (make faults)")


def pytest_terminal_summary(terminalreporter, config):
    counts = config.stash.get(TRIED, {})
    if counts:
        failures = len(terminalreporter.stats.get("failed", ())) + len(terminalreporter.stats.get("error", ()))
        terminalreporter.section("faults tried")
        for what, number in sorted(counts.items()):
            terminalreporter.write_line(f"{number:6d} {what}")
        terminalreporter.write_line(f"{failures:6d} failures")
        if file := config.getoption("--tried", None):
            with open(file, "w", newline="", encoding="utf-8") as out:
                rows = [("what", "number"), *sorted(counts.items()), ("failures", failures)]
                csv.writer(out, lineterminator="\n").writerows(rows)
