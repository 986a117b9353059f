"""The paper's claims, one by one: how probable each is in what all others leave, and what would change that.

The claims on numbers and curves are judged by the inference of configs/inference/paper.yaml (`plots/calibration.py`).
A claim is calibrated where it has set a parameter, else predicted, open or refuted by its probability. What is no
statement on curves is measured at each of the named parameter sets (SETS): the shape of the front, its perturbation,
its stability. Claims that hold whatever the parameters, or that are the calibration itself, count for nothing and are
listed as such. Written to docs/claims.md.
"""

from typing import NamedTuple

import looks
import numpy as np

from vesdyn.front import modulation
from vesdyn.inference import PREDICTED, REFUTED
from vesdyn.inference_file import Inference
from vesdyn.inference_report import carry_out, claims, table
from vesdyn.study import (
    NODES,
    at_one_product,
    displaced_fronts,
    front_shapes,
    goes_one_way,
    left_of_displacement,
)

TABLE = looks.ROOT / "docs" / "claims.md"
FILE = looks.ROOT / "configs" / "inference" / "paper.yaml"
RUNS = looks.ROOT / "runs" / "inference"
SETS = {  # changes of the shipped cases
    "legend (configs/base/paper.yaml)": {},
    "extremes (configs/base/extremes.yaml)": {"drag": 0.07, "receptors.mobility": 2.1875},
}
STABILITY = (
    (0.302, 1.51, 0.416),
    (0.603, 2.416, 0.332),
    (1.81, 3.02, 0.312),
    (1.81, 2.416, None),
)  # K, T_max, unstable from r
WATCHED = 0.004, 0.04  # after the displacement [a0^2/D]: one step, and ten
DISPLACED_AT = (0.144, 0.24, 0.696)  # times of Fig. 9 b to d
FRONTS_AT = tuple(float(f"{t:.4g}") for t in np.geomspace(0.002, 1.0, 55))
GROWN = 3.0  # times between the two: what counts as unstable


class Found(NamedTuple):
    """What a claim comes to at one parameter set: the numbers in words, and its parts, name: whether it holds."""

    numbers: str
    parts: dict


def pm(value, error, digits=3):
    return f"{value:.{digits}f} ± {error:.{digits}f}"


def front_shape(study, changes):
    t, coarse, error, *_ = front_shapes(study, "typical-auto", FRONTS_AT, changes=changes)
    first, last = int(np.argmin(abs(t - 0.008))), len(t) - 1
    return Found(
        f"radius of curvature {pm(coarse[first, 0], error[first, 0], 4)} at t = 0.008,"
        f" {pm(coarse[last, 0], error[last, 0], 4)}"
        f" at the end; angle {np.degrees(coarse[first, 1]):.1f}° to {np.degrees(coarse[last, 1]):.1f}°",
        {"radius falls": goes_one_way(t, coarse[:, 0], error[:, 0].max(), -1),
         "angle rises": goes_one_way(t, coarse[:, 1], error[:, 1].max(), +1)},
    )  # fmt: skip


def modulated_front(study, changes):
    names = "fig9-coarse", "fig9-rings"
    coarse, symmetric = (displaced_fronts(study, name, DISPLACED_AT, changes)[0] for name in names)
    first, later = DISPLACED_AT[:2]

    def off(fronts, t):
        return left_of_displacement(*fronts["contact"][t])

    rim = [modulation(radius) for radius in coarse[NODES][first]]
    return Found(
        f"rim of touching nodes on the coarse mesh {rim[0]:.1%} displaced, {rim[1]:.1%} not displaced; what the"
        f" displacement leaves: {off(coarse, first):.2%} after a step, {off(coarse, later):.2%} at t = 0.240;"
        f" symmetric mesh {off(symmetric, first):.2%}, {off(symmetric, later):.2%}",
        {"due to the displacement": rim[0] > 2 * rim[1],
         "grows": off(symmetric, later) > off(symmetric, first)},
    )  # fmt: skip


def growth(study, changes, shear_modulus, traction, radius):
    """What is left of a displacement at front ``radius`` [a0] after one step, of r, and its growth until ten."""
    scene = {**changes, "membrane.shear_modulus": shear_modulus, "adhesion.traction": traction}
    rows = study.history("typical-auto", scene)
    reached = min(radius, 0.98 * float(rows["contact_radius"].max()))  # a front that stops short is displaced there
    at = float(f"{np.interp(reached, rows['contact_radius'], rows['time']):.4g}")
    times = [round(at + wait, 6) for wait in WATCHED]
    scene |= {"perturbation.at": at, "time.end": times[-1], "output.frames": times}
    fronts = displaced_fronts(study, "fig9-rings", times, scene)[0]["above"]
    first, last = (left_of_displacement(*pair) for pair in fronts.values())
    return first, last / first


def stability(study, changes):
    radii = [radius for *_, radius in STABILITY if radius]
    found = [(K, T, radius, *growth(study, changes, K, T, radius or min(radii))) for K, T, radius in STABILITY]
    return Found(
        "; ".join(f"K = {K:g}, T = {T:g}: {left:.3%} of 2 % is left after a step, times {factor:.2g} after nine more"
                  for K, T, _, left, factor in found),
        {f"K = {K:g}, T = {T:g}": factor > GROWN for K, T, radius, _, factor in found if radius},
    )  # fmt: skip


MEASURED = (  # name, the paper's words, function of a study and a parameter set
    ("F8", "front's radius of curvature falls, spreading angle rises", front_shape),
    ("F9, front", "a random displacement of 2 % leaves modulations that multiply and stay", modulated_front),
    ("S", "unstable: (K, T_max) = (0.302, 1.51), (0.603, 2.416), (1.81, 3.02); stable: (1.81, 2.416)", stability),
)


def measure(study, file=FILE, runs=RUNS, sets=None, measured=MEASURED):
    """The `vesdyn.inference.Result`; rows of what is measured at each set; the finals of Fig. 6 at one product."""
    inference = Inference(file)
    result = carry_out(inference, runs / inference.name, jobs=study.jobs, tell=print)
    rows = []
    for name, says, find in measured:
        found = {which: find(study, changes) for which, changes in (SETS if sets is None else sets).items()}
        for part in next(iter(found.values())).parts:
            held = sum(f.parts[part] for f in found.values())
            numbers = "; ".join(f"{which}: {f.numbers}" for which, f in found.items())
            rows.append([name, says, part, f"{held} of {len(found)}", numbers])
    return {"result": result, "measured": rows, "one product": [c.final for c in at_one_product(study)]}


def draw(measured, out=TABLE.parent):
    areas = measured["one product"]
    nothing = [
        ["F6 at one product T_max d_c", f"final areas {', '.join(f'{a:.3f}' for a in areas)}",
         "an identity of the model for small d_c: adhesion energy and Boltzmann factor know the product only"],
        ["F9, base state: r = 0.416 at t = 0.140", "see F9 front at 0.140", "the calibration of the drag itself"],
    ]  # fmt: skip
    lines = [
        "# The paper's claims",
        "",
        "Written by `python plots/claims.py`. Units: length a0, time a0²/D, energy kT, density c_r0.",
        "",
        "## By inference",
        "",
        *claims(measured["result"]),
        f"Predicted: probability {PREDICTED:g} or more; refuted: {REFUTED:g} or less; open: between them. How the data, their"
        " errors, thresholds and readings are stated: `configs/inference/paper.yaml`; posteriors: [inference](inference.md).",
        "",
        "## Measured at the named parameter sets",
        "",
        *table(["claim", "the paper says", "part", "comes out at", "numbers"], measured["measured"]),
        "",
        "## What counts for nothing",
        "",
        *table(["claim", "computed", "why"], nothing),
        "",
    ]
    out.mkdir(parents=True, exist_ok=True)
    (out / TABLE.name).write_text("\n".join(lines))
    print("\n".join(lines))


if __name__ == "__main__":
    looks.command_line(measure, draw, TABLE.parent)
