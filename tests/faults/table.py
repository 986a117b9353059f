"""Writes docs/faults.md: each known fault by its id, and the tests that hold it.

Use: python tests/faults/table.py docs/faults.md

The sentences are those of faults.csv beside this file; a test holds a fault if it is marked
``@pytest.mark.fault("a14", ...)``, whatever its file.
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


def table():
    """The page, as text."""
    tests = marked_tests()
    with open(HERE / "faults.csv", newline="", encoding="utf-8") as file:
        faults = list(csv.DictReader(file))
    if strangers := tests.keys() - {fault["id"] for fault in faults}:
        raise SystemExit(f"faults.csv: does not say what {', '.join(sorted(strangers))} is; add a line.")
    lines = [
        "# Faults found by use, and the tests that hold them",
        "",
        "Written by `make faults` from `tests/faults/faults.csv` and the marks of the tests.",
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
