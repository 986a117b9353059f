"""Calibration: drag eta and mobility M^ from two figures that the paper prints, and what is then a prediction.

How the two equations are solved is told in `vesdyn.calibration`. The uncertainty is that of reading the figures,
through the inverse Jacobian, and that of mesh, step and tolerance, by solving once more at a quarter of the wish.
"""

import looks
import numpy as np
from looks import DARK, RED

from vesdyn.calibration import FRONT_AND_DENSITY, KEYS, START, STEP, calibrated, computed, jacobian, predicted
from vesdyn.study import FINER

ACCURACY = 0.01
ITERATIONS = 3
FACTORS = 1 / (1 + STEP), 1.0, 1 + STEP  # of START, drawn


def measure(study, readings=FRONT_AND_DENSITY, iterations=ITERATIONS):
    """The Jacobian; the unknowns; their relative uncertainty (3, 2) by source; predictions with theirs.

    "around": each number (2, 3) at START and with the unknown it is read for STEP lower and higher.
    """
    J = jacobian(study, ACCURACY)
    unknowns = calibrated(study, readings, J, ACCURACY, START, iterations)
    finer = calibrated(study, readings, J, ACCURACY * FINER, unknowns, min(2, iterations))
    reading = np.linalg.inv(J) * [r.error / r.value for r in readings]  # d ln unknown by each number read
    sources = np.array([*np.exp(reading.T) - 1.0, abs(unknowns / finer - 1.0)])
    base = predicted(study, unknowns, ACCURACY)
    off = [predicted(study, unknowns * (1.0 + part), ACCURACY) for part in sources[:2]]
    off.append(predicted(study, finer, ACCURACY * FINER))
    return {
        "readings": readings,
        "jacobian": J,
        "unknowns": unknowns,
        "sources": sources,
        "predictions": {
            name: (value, float(np.sqrt(sum((o[name][0] - value) ** 2 for o in off))), paper)
            for name, (value, paper) in base.items()
        },
        "around": [[float(computed(study, scaled(k, f), ACCURACY)[k]) for f in FACTORS] for k in range(2)],
    }


def scaled(k, factor):
    """START with the unknown ``k`` multiplied."""
    return np.where(np.arange(2) == k, factor, 1.0) * START


def draw(measured, out=looks.OUT):
    readings, J, unknowns, sources, predictions, around = measured.values()
    names = "eta", "M^"
    looks.table(
        "d ln number / d ln unknown", ["", *names], [(r.name, *map(float, row)) for r, row in zip(readings, J)]
    )
    total = np.sqrt((sources**2).sum(axis=0))
    looks.table(
        "calibrated, and relative uncertainty by source",
        ["", "value", "±", *(f"{r.name} ± {r.error:g}" for r in readings), "mesh, step, tolerance"],
        [(n, float(v), float(v * e), *map(float, abs(s))) for n, v, e, s in zip(names, unknowns, total, sources.T)],
    )
    looks.table(
        "predictions", ["", "computed", "±", "the paper prints"], [(n, *row) for n, row in predictions.items()]
    )

    def fill(drag, mobility):
        for k, ax in enumerate((drag, mobility)):
            _, wanted, error = readings[k]
            ax.axhspan(wanted - error, wanted + error, color="0.88", linewidth=0, label="as read from the paper")
            ax.plot(
                np.multiply(FACTORS, START[k]),
                around[k],
                "o-",
                color=DARK,
                label=f"computed, {looks.SYMBOLS[KEYS[1 - k]]} = {START[1 - k]:g}",
            )
            ax.errorbar(
                unknowns[k],
                wanted,
                xerr=unknowns[k] * total[k],
                fmt="s",
                color=RED,
                capsize=3,
                label="calibrated, both together",
            )
            ax.set_ylabel(("front $r(0.140)$ of Fig. 9a [$a_0$]", "largest density of Fig. 2 [$c_{r0}$]")[k])
            ax.legend()
        drag.set_xlabel(r"drag $\eta$ [$kT D^{-1} a_0^{-2}$]")
        mobility.set_xlabel(r"mobility number $\hat M$")

    looks.panels(fill, "calibration", out, size=(7.2, 2.8))


if __name__ == "__main__":
    looks.command_line(measure, draw)
