"""Calibration: which parameters the paper used, by inference from all its prints (configs/inference/paper.yaml).

What `vesdyn infer` does, with a sampler that knows no emulator beside it, and what is left of drag and mobility at the
thickness and the prestretch of the named parameter sets (configs/base/). Written to docs/: inference.md, the pictures
inference-corner and inference-predictive, and inference-draws.csv, from which the figures take their second band. Runs are kept in runs/inference/paper.
"""

import csv
import shutil

import looks

from vesdyn.inference_file import Inference
from vesdyn.inference_report import carry_out

FILE = looks.ROOT / "configs" / "inference" / "paper.yaml"
RUNS = looks.ROOT / "runs" / "inference"
HELD = {"membrane.thickness": 0.01, "membrane.prestretch": 1.0}
DIRECT = 32  # points that are run instead of emulated
PICTURES = "corner", "predictive"


N_DRAWS = 8  # parameter sets for the second band of the figures


def measure(study, file=FILE, runs=RUNS, held=HELD, n_direct=DIRECT):
    """The folder of the finished inference; the unknowns and ``N_DRAWS`` draws of them from the posterior."""
    inference = Inference(file)
    result = carry_out(inference, runs / inference.name, jobs=study.jobs, held=held, n_direct=n_direct, tell=print)
    draws = inference.values(result.posterior.drawn(N_DRAWS, seed=0))
    return {"folder": runs / inference.name, "unknowns": list(inference.unknowns), "draws": draws.tolist()}


def draw(measured, out=looks.ROOT / "docs"):
    finished = measured["folder"]
    out.mkdir(parents=True, exist_ok=True)
    with open(out / looks.DRAWS.name, "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(measured["unknowns"])
        writer.writerows([f"{value:.5g}" for value in draw] for draw in measured["draws"])
    for name in PICTURES:
        shutil.copy(finished / f"{name}.png", out / f"inference-{name}.png")
    report = (finished / "report.md").read_text()
    pictures = "\n".join(f"![{name}](inference-{name}.png)" for name in PICTURES)
    (out / "inference.md").write_text(f"{report}\n## Pictures\n\n{pictures}\n")
    print(report)


if __name__ == "__main__":
    looks.command_line(measure, draw, looks.ROOT / "docs")
