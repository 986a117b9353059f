"""Calibration: drag eta and mobility M^ from two figures that the paper prints, and what is then a prediction.

    r(0.140) = 0.416        the front of Fig. 9a, in the soft case       -> drag
    largest density 4.0     the upper end of the contours of Fig. 2      -> mobility

Either number depends on both unknowns, so the two equations are solved together: Newton's method with one Jacobian,
from differences, on meridians. The uncertainty is that of reading the figures, through the inverse Jacobian, and that
of mesh, step and tolerance, by solving once more at a quarter of the accuracy wish.
"""

import numpy as np
import paper
import study
from study import DARK, RED

KEYS = "drag", "receptors.mobility"
START = 0.07, 2.1875
SOFT = {**paper.ON_MERIDIAN, "output.frames": [0.14, 0.696]}  # changes of fig9-base
READ = ("r(0.140), Fig. 9a", 0.416, 0.003), ("largest density, Fig. 2", 4.0, 0.2)  # printed, and how well it is read
LOWEST = 0.4, 0.05  # density, Fig. 2
FIRST, FINAL, FINAL_SOFT = 0.140, 0.560, 0.696  # times of Figs. 9a, 2d, 9d
ACCURACY = 0.01
STEP = 0.1  # relative change of the unknowns for the Jacobian
ITERATIONS = 3


def scenes(unknowns, accuracy, more={}):
    """The soft and the typical case with the ``unknowns``, drag and mobility, and ``more`` changes."""
    changes = {key: float(f"{value:.6g}") for key, value in zip(KEYS, unknowns)} | {"accuracy": accuracy, **more}
    return [("fig9-base", {**SOFT, **changes}), ("typical-auto", changes)]


def curves(unknowns, accuracy, more={}):
    """Histories of the two `scenes`."""
    runs = scenes(unknowns, accuracy, more)
    study.prepare(runs)
    return [study.history(*run) for run in runs]


def printed(unknowns, accuracy, more={}):
    """The two numbers of READ as computed (2,)."""
    soft, typical = curves(unknowns, accuracy, more)
    return np.array([study.value_at(soft, "contact_radius", FIRST), study.value_at(typical, "density_max", FINAL)])


def predicted(unknowns, accuracy, more={}):
    """What the calibration does not use, name: (value, what the paper prints)."""
    soft, typical = curves(unknowns, accuracy, more)
    area = {name: h["binding_area"] for name, h in (("soft", soft), ("typical", typical))}
    return {
        "smallest density, Fig. 2": (float(typical["density_min"].min()), f"{LOWEST[0]:g} ± {LOWEST[1]:g}"),
        f"A({FINAL:g}) / A at the end, Fig. 2d": (
            float(study.area_at(typical, FINAL) / area["typical"][-1]),
            "1 (final)",
        ),
        "A at the end, typical, Fig. 3": (float(area["typical"][-1]), "below 0.8 (axis)"),
        f"A({FINAL_SOFT:g}) / A at the end, Fig. 9d": (
            float(study.area_at(soft, FINAL_SOFT) / area["soft"][-1]),
            "1 (final)",
        ),
        "r at the end, soft, Fig. 9d": (float(soft["contact_radius"][-1]), "-"),
    }


def jacobian(accuracy):
    """d ln(numbers of READ) / d ln(unknowns) (2, 2), by central differences at START."""
    columns = []
    for k in range(2):
        up, down = (
            np.array(START) * np.where(np.arange(2) == k, factor, 1.0) for factor in (1 + STEP, 1 / (1 + STEP))
        )
        columns.append(np.log(printed(up, accuracy) / printed(down, accuracy)) / (2 * np.log(1 + STEP)))
    return np.array(columns).T


def solve(J, accuracy, start, iterations, more={}):
    """Unknowns (2,) at which the numbers of READ are as printed, in scenes with ``more`` changes."""
    wanted, unknowns = np.array([value for _, value, _ in READ]), np.array(start)
    for _ in range(iterations):
        unknowns = unknowns * np.exp(-np.linalg.solve(J, np.log(printed(unknowns, accuracy, more) / wanted)))
    return unknowns


def measure(accuracy):
    """The Jacobian, the unknowns, their parts of uncertainty (3, 2) by source, and the predictions with theirs."""
    J = jacobian(accuracy)
    unknowns = solve(J, accuracy, START, ITERATIONS)
    finer = solve(J, accuracy * paper.FINER, unknowns, 2)
    reading = np.linalg.inv(J) * [spread / value for _, value, spread in READ]  # d ln unknown by each number read
    sources = np.array([*np.exp(reading.T) - 1.0, abs(unknowns / finer - 1.0)])  # relative
    base = predicted(unknowns, accuracy)
    off = [predicted(unknowns * (1.0 + part), accuracy) for part in sources[:2]] + [
        predicted(finer, accuracy * paper.FINER)
    ]
    predictions = {name: (value, np.sqrt(sum((o[name][0] - value) ** 2 for o in off)), paper_says)
                   for name, (value, paper_says) in base.items()}  # fmt: skip
    return J, unknowns, sources, predictions


def draw(out=study.OUT):
    J, unknowns, sources, predictions = measure(ACCURACY)
    names = "eta", "M^"
    study.table(
        "d ln number / d ln unknown", ["", *names], [(what, *map(float, row)) for (what, _, _), row in zip(READ, J)]
    )
    total = np.sqrt((sources**2).sum(axis=0))
    study.table(
        "calibrated, and relative uncertainty by source",
        ["", "value", "±", *(f"{what} ± {spread:g}" for what, _, spread in READ), "mesh, step, tolerance"],
        [(n, float(v), float(v * e), *map(float, abs(s))) for n, v, e, s in zip(names, unknowns, total, sources.T)],
    )
    study.table(
        "predictions",
        ["", "computed", "±", "paper"],
        [(n, float(v), float(e), p) for n, (v, e, p) in predictions.items()],
    )

    def fill(drag, mobility):
        for ax, k, number in ((drag, 0, 0), (mobility, 1, 1)):
            factors = np.array([1 / (1 + STEP), 1.0, 1 + STEP])
            values = [
                printed(np.array(START) * np.where(np.arange(2) == k, f, 1.0), ACCURACY)[number] for f in factors
            ]
            what, wanted, spread = READ[number]
            ax.axhspan(wanted - spread, wanted + spread, color="0.88", linewidth=0, label="as read from the paper")
            ax.plot(
                START[k] * factors,
                values,
                "o-",
                color=DARK,
                label=f"computed, {paper.SYMBOLS[KEYS[1 - k]]} = {START[1 - k]:g}",
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
            ax.set_ylabel(("front $r(0.140)$ of Fig. 9a [$a_0$]", "largest density of Fig. 2 [$c_{r0}$]")[number])
            ax.legend()
        drag.set_xlabel(r"drag $\eta$ [$kT D^{-1} a_0^{-2}$]")
        mobility.set_xlabel(r"mobility number $\hat M$")

    study.panels(fill, "calibration", out, size=(7.2, 2.8))


if __name__ == "__main__":
    draw(study.command_line())
