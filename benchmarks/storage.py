"""What safety costs: the share of a run's time that goes into checksums and syncs, and what the n-th frame costs.

Use: python benchmarks/storage.py [CASE] [--csv FILE]      (default: quick, a shipped case or a file)

With --csv the shares go to a table, for docs/faults.md, and the n-th frame is not tried.
"""

import argparse
import csv
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np

from vesdyn import files, storage
from vesdyn.case_file import load_case
from vesdyn.run import run_case

FRAMES = 1000


class Clock:
    """Adds up the wall time of the calls of the functions that it wraps."""

    def __init__(self):
        self.seconds, self.calls = 0.0, 0

    def around(self, function):
        def timed(*arguments, **options):
            began = time.perf_counter()
            try:
                return function(*arguments, **options)
            finally:
                self.seconds += time.perf_counter() - began
                self.calls += 1

        return timed


def main(name, file=None):
    warnings.simplefilter("ignore")
    case = load_case(name)
    checksums, syncs, checkpoints, frames = Clock(), Clock(), Clock(), Clock()
    files.checksum = checksums.around(files.checksum)
    files.sync, files.sync_directory = syncs.around(files.sync), syncs.around(files.sync_directory)
    directory = storage.RunDirectory
    directory.write_checkpoint = checkpoints.around(directory.write_checkpoint)
    directory.write_frame = frames.around(directory.write_frame)
    with tempfile.TemporaryDirectory() as folder:
        run_case(case, Path(folder) / "warm", progress=False)  # kernels are compiled, libraries imported
        for clock in (checksums, syncs, checkpoints, frames):
            clock.__init__()
        began = time.perf_counter()
        outcome = run_case(case, Path(folder) / "run", progress=False)
        total = time.perf_counter() - began
        print(f"{case.name}: {outcome.steps} steps in {total:.2f} s")
        for what, clock in (("checksums", checksums), ("syncs", syncs), ("checkpoints, all of each", checkpoints),
                            ("frames, all of each", frames)):  # fmt: skip
            print(f"  {what:<26} {clock.calls:5d} calls  {clock.seconds:8.4f} s  {clock.seconds / total:7.2%} of the run")
        if file is not None:
            cost = {
                "case": case.name, "steps": outcome.steps, "frames": frames.calls, "checkpoints": checkpoints.calls,
                "seconds": f"{total:.2g}", "checksums": f"{checksums.seconds / total:.2g}", "syncs": f"{syncs.seconds / total:.2g}",
            }  # fmt: skip
            with open(file, "w", newline="", encoding="utf-8") as out:
                csv.writer(out, lineterminator="\n").writerows([cost.keys(), cost.values()])
            return
        last = directory(Path(folder) / "run").frames()[-1]
        many = directory(Path(folder) / "many")
        costs = []
        for i in range(FRAMES):
            began = time.perf_counter()
            many.write_frame(float(i), last.connectivity, last.nodes, last.cells)
            costs.append(time.perf_counter() - began)
        first, late = np.median(costs[:100]), np.median(costs[-100:])
        print(f"frames: {1e3 * first:.1f} ms for each of the first 100, {1e3 * late:.1f} ms for the last 100 of {FRAMES}")
        began = time.perf_counter()
        many.write_series()
        print(f"series that names them, once a checkpoint: {1e3 * (time.perf_counter() - began):.1f} ms")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("case", nargs="?", default="quick", metavar="CASE")
    parser.add_argument("--csv", type=Path, metavar="FILE")
    arguments = parser.parse_args()
    main(arguments.case, arguments.csv)
