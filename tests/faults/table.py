"""Writes docs/faults.md: each known fault by its id, and the tests that hold it.

Use: python tests/faults/table.py docs/faults.md

The sentences are those of faults.csv beside this file; a test holds a fault if it is marked
``@pytest.mark.fault("a14", ...)``, whatever its file. What was tried stands in tried.csv and what safety costs in
cost.csv, both written by `make faults` before this page.
"""

import ast
import csv
import sys
from collections import defaultdict
from pathlib import Path

HERE = Path(__file__).parent
TESTS = HERE.parent


def marked_tests():
    """Names of the marked tests of each fault, file::function."""
    tests = defaultdict(list)
    for file in sorted(TESTS.rglob("test_*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            for decorator in getattr(node, "decorator_list", ()):
                if ast.unparse(decorator).startswith("pytest.mark.fault("):
                    for argument in decorator.args:
                        tests[argument.value].append(f"{file.relative_to(TESTS)}::{node.name}")
    return tests


def rows_of(name):
    """Rows of the file ``name`` beside this one, as dicts of text; none where there is no such file yet."""
    if not (HERE / name).exists():
        return []
    with open(HERE / name, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def table():
    """The page, as text."""
    tests, faults = marked_tests(), rows_of("faults.csv")
    if strangers := tests.keys() - {fault["id"] for fault in faults}:
        raise SystemExit(f"faults.csv: does not say what {', '.join(sorted(strangers))} is; add a line.")
    lines = [
        "# Faults found by use, and the tests that hold them",
        "",
        "Written by `make faults` from `tests/faults/faults.csv`, the marks of the tests, and what these counted.",
        "",
        "## What was tried",
        "",
        "Each time the run went on to the same bits, or a sentence said what to do; a failure is wrong data, a traceback, a"
        " hang, or a file outside the run's directory.",
        "",
        *(["| tried | number |", "|---|---|"] if rows_of("tried.csv") else ["Not counted yet: `make faults` does."]),
        *(f"| {row['what']} | {int(row['number']):,} |" for row in rows_of("tried.csv")),
        "",
        "## What safety costs",
        "",
        *(f"Of the {row['seconds']} s that the case `{row['case']}` takes ({row['steps']} steps, {row['frames']} frames,"
          f" {row['checkpoints']} checkpoints), checksums take {float(row['checksums']):.2%} and syncs {float(row['syncs']):.2%}."
          for row in rows_of("cost.csv")),
        *([] if rows_of("cost.csv") else ["Not measured yet: `make faults` does."]),
        "",
        "## Each fault",
        "",
        "| id | fault | what happens now | tests |",
        "|---|---|---|---|",
    ]
    for fault in faults:
        held = "<br>".join(f"`{name}`" for name in tests[fault["id"]]) or "none yet"
        lines.append(f"| {fault['id']} | {fault['fault']} | {fault['now']} | {held} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(table(), encoding="utf-8")
