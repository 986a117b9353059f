"""Calibration: which parameters the paper used, by inference from all its prints (configs/inference/paper.yaml).

What `vesdyn infer` does, with a sampler that knows no emulator beside it, and what is left of drag and mobility at the
thickness and the prestretch of the named parameter sets (configs/base/). Whether unknowns are recovered at all is tried
on synthetic experiments, curves of real runs with noise (configs/inference/own-curves.yaml). Written to docs/:
inference.md, the pictures inference-corner and inference-predictive, and inference-draws.csv, from which the figures take
their second band. Runs are kept in runs/inference/. The claims are judged by `plots/claims.py`.
"""

import csv
import shutil

import looks

from vesdyn.inference_file import Inference
from vesdyn.inference_report import carry_out

FILE = looks.ROOT / "configs" / "inference" / "paper.yaml"
OWN = looks.ROOT / "configs" / "inference" / "own-curves.yaml"
RUNS = looks.ROOT / "runs" / "inference"
HELD = {"membrane.thickness": 0.01, "membrane.prestretch": 1.0}
DIRECT = 6  # points that are run instead of emulated
TRIALS = 20  # synthetic experiments
PICTURES = "corner", "predictive"
N_DRAWS = 6  # parameter sets for the second band of the figures
READ_WITH = """\
- Evidence ratios and intervals hold for the priors, errors, thresholds, slip and model error of `configs/inference/paper.yaml`;
  "Other choices" tells how far they move with these.
- Two data, "F3 uses its axis" and "F6 only slightly faster", were added when a first posterior had been seen, and the priors
  of drag and mobility were widened when a posterior had touched their ends. "Other choices" has a row for each of both.
- Legend and mobility stand on Figs. 5 and 6: "Other choices" has rows without each and without both, where little is left of
  either. What sets a parameter is called calibrated in [claims](claims.md) and is no independent support.
- The shipped drag and mobility (`configs/base/paper.yaml`) lie within the intervals of "With unknowns held".
- Prestretch and thickness end where the model does: 1 is an unstressed sphere, the thinnest shell has next to no bending.
- The evidence of improbable readings is found in two ways from one emulator: nested sampling of all readings, and a scan of the
  prior. A sampler without the emulator has no points near them and cannot tell it.
"""


def measure(study, file=FILE, runs=RUNS, held=HELD, n_direct=DIRECT, own=OWN, n_trials=TRIALS):
    """Folders of the finished inference and of that of the trials; unknowns and ``N_DRAWS`` draws of the posterior."""
    inference, tried = Inference(file), Inference(own)
    result = carry_out(inference, runs / inference.name, jobs=study.jobs, held=held, n_direct=n_direct, with_claims=False, tell=print)
    carry_out(tried, runs / "trials" / tried.name, jobs=study.jobs, n_trials=n_trials, with_claims=False, tell=print)
    draws = inference.values(result.posterior.drawn(N_DRAWS, seed=0))
    return {"folder": runs / inference.name, "trials": runs / "trials" / tried.name, "unknowns": list(inference.unknowns),
            "draws": draws.tolist()}  # fmt: skip


def sections(folder):
    """Opening and sections, by title, of the report in ``folder``."""
    opening, *others = (folder / "report.md").read_text().split("\n## ")
    return opening, {title: body for title, _, body in (other.partition("\n") for other in others)}


def draw(measured, out=looks.ROOT / "docs"):
    out.mkdir(parents=True, exist_ok=True)
    with open(out / looks.DRAWS.name, "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(measured["unknowns"])
        writer.writerows([f"{value:.5g}" for value in draw] for draw in measured["draws"])
    for name in PICTURES:
        shutil.copy(measured["folder"] / f"{name}.png", out / f"inference-{name}.png")
    (opening, own), (_, tried) = sections(measured["folder"]), sections(measured["trials"])
    text = ["# Which parameters did the paper use?\n", "Written by `python plots/calibration.py`. What to read it with:\n", READ_WITH]
    text += [f"![{name}](inference-{name}.png)\n" for name in PICTURES]
    if "Without the emulator" not in own:
        text += ["No sampler without the emulator was run for this page (`DIRECT`, or `vesdyn infer --direct`).\n"]
    text += [opening.partition("\n\n")[2], *(f"\n## {title}\n{body}" for title, body in own.items())]
    text += ["\n## Are unknowns recovered?\n\nSynthetic experiments: two curves each, of runs with unknowns drawn from their priors, with"
             " noise (`vesdyn infer configs/inference/own-curves.yaml --trials`). Told is in how many of them the true unknowns lie in"
             f" regions and intervals of a nominal probability.\n{tried['Trials']}{tried['Time']}"]  # fmt: skip
    (out / "inference.md").write_text("\n".join(text).rstrip() + "\n")
    print("\n".join(text))


if __name__ == "__main__":
    looks.command_line(measure, draw, looks.ROOT / "docs")
