"""Table of two sets of runs, before and after a change: same bits of history.csv, or what differs and by how much.

    python benchmarks/bits.py OLD_RUNS NEW_RUNS

Either is a folder of runs, one a case. For each case: the SHA-256 of its history.csv in both, and `same`, or each column
that differs with its largest difference relative to the largest value in the column, and the first row in which it does.
A column that only one of them has is told. Where the steps are others, rows mean nothing: then the columns in SMOOTH are
compared at equal times from START on, interpolated from step to step, and at the end.
"""

import argparse
import csv
import hashlib
from pathlib import Path

import numpy as np

DIGITS = 12  # of a hash that are shown
SMOOTH = (
    "binding_area",
    "contact_radius",
    "pressure",
    "density_min",
    "density_max",
    "height",
    "elastic_energy",
)
START = 0.01  # [a0^2/D]


def histories(folder):
    """The history.csv of each run in ``folder``, by the name of the run."""
    return {file.parent.name: file for file in sorted(Path(folder).glob("*/history.csv"))}


def columns(file):
    """Columns of a history, name to array of numbers (n_rows,)."""
    with open(file, newline="") as text:
        header, *rows = csv.reader(text)
    values = np.array(rows, dtype=float).reshape(len(rows), len(header))
    return dict(zip(header, values.T))


def digest(file):
    """Start of the SHA-256 of a file."""
    return hashlib.sha256(file.read_bytes()).hexdigest()[:DIGITS]


def compared(old, new):
    """What differs between two histories, a clause each; nothing where they are the same to the last bit."""
    before, after = columns(old), columns(new)
    found = []
    for names, where in ((before.keys() - after.keys(), "before"), (after.keys() - before.keys(), "after")):
        found += [f"{name} only {where}" for name in sorted(names)]
    if not np.array_equal(before["time"], after["time"], equal_nan=True):
        return [*found, *at_equal_times(before, after)]
    for name in before:
        if name in after:
            a, b = before[name], after[name]
            different = np.flatnonzero(~((a == b) | (np.isnan(a) & np.isnan(b))))
            if len(different):
                scale = max(np.max(np.abs(a)), np.max(np.abs(b)))
                size = np.max(np.abs(a[different] - b[different])) / scale
                found.append(f"{name} by {size:.1e} from row {different[0] + 1}")
    return found


def at_equal_times(before, after):
    """What differs between two tables of columns whose steps are others, a clause each."""
    t, other = before["time"], after["time"]
    found = [f"other steps, {len(t)} before and {len(other)} after"]
    use = (t >= START) & (t <= other[-1])
    for name in SMOOTH:
        if name in before and name in after:
            a, b = before[name], after[name]
            change = np.abs(np.interp(t[use], other, b) - a[use]) / max(np.max(np.abs(a)), np.max(np.abs(b)))
            end = abs(b[-1] - a[-1]) / max(abs(a[-1]), abs(b[-1]))
            most = f"by {change.max():.1e} at t = {t[use][change.argmax()]:.3g}, " if len(change) else ""
            found.append(f"{name} {most}by {end:.1e} at the end")
    return found


def table(old, new):
    """Rows of the table: name of the case, hash before, hash after, and what differs."""
    before, after = histories(old), histories(new)
    rows = []
    for name in sorted(before.keys() | after.keys()):
        hashes = [digest(files[name]) if name in files else "-" for files in (before, after)]
        if "-" in hashes:
            told = "only before" if hashes[1] == "-" else "only after"
        elif hashes[0] == hashes[1]:
            told = "same"
        else:
            told = "; ".join(compared(before[name], after[name])) or "same numbers, written otherwise"
        rows.append((name, *hashes, told))
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("old", type=Path, help="folder of the runs before")
    parser.add_argument("new", type=Path, help="folder of the runs after")
    arguments = parser.parse_args()
    rows = table(arguments.old, arguments.new)
    if not rows:
        raise SystemExit(
            f"{arguments.old}, {arguments.new}: hold no runs; give folders with <case>/history.csv in them."
        )
    print("| case | before | after | differs |", "|---|---|---|---|", sep="\n")
    for row in rows:
        print(f"| {' | '.join(row)} |")
    print(f"\n{sum(told == 'same' for *_, told in rows)} of {len(rows)} are the same to the last bit.")


if __name__ == "__main__":
    main()
