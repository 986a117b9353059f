"""Calibration: drag and mobility from two numbers that the paper prints, and what is then a prediction.

    r(0.140) = 0.416        the front of Fig. 9a, in the soft case       -> drag
    largest density 4.0     the upper end of the contours of Fig. 2      -> mobility

Either number depends on both unknowns, so the two equations are solved together: Newton's method in logarithms with
one Jacobian, from differences, on meridians. ``changes`` are made to both cases, a thickness for instance.
"""

from typing import NamedTuple

import numpy as np

from vesdyn.study import ON_MERIDIAN, UNCHANGED, area_at, value_at

KEYS = "drag", "receptors.mobility"
START = 0.07, 2.1875
STEP = 0.1  # relative change of the unknowns for the Jacobian
FIRST, FINAL, FINAL_SOFT = 0.140, 0.560, 0.696  # times of Figs. 9a, 2d, 9d [a0^2/D]


class Reading(NamedTuple):
    """A number that the paper prints, and how well it is read."""

    name: str
    value: float
    error: float


FRONT_AND_DENSITY = Reading("r(0.140), Fig. 9a", 0.416, 0.003), Reading("largest density, Fig. 2", 4.0, 0.2)
LOWEST_DENSITY = Reading("smallest density, Fig. 2", 0.4, 0.05)


def runs_with(unknowns, accuracy, changes=UNCHANGED):
    """The soft and the typical case with the ``unknowns``, drag and mobility: names and changes."""
    values = {key: float(f"{value:.6g}") for key, value in zip(KEYS, unknowns)} | {"accuracy": accuracy, **changes}
    return [
        ("fig9-base", {**ON_MERIDIAN, "output.frames": [FIRST, FINAL_SOFT], **values}),
        ("typical-auto", values),
    ]


def histories_with(study, unknowns, accuracy, changes=UNCHANGED):
    """Histories of the runs of `runs_with`; computed if need be."""
    runs = runs_with(unknowns, accuracy, changes)
    study.prepare(runs)
    return [study.history(*run) for run in runs]


def computed(study, unknowns, accuracy, changes=UNCHANGED):
    """Front radius r(0.140) [a0] and density at the end of Fig. 2 [c_r0]: the two numbers (2,) to be matched."""
    soft, typical = histories_with(study, unknowns, accuracy, changes)
    return np.array([value_at(soft, "contact_radius", FIRST), value_at(typical, "density_max", FINAL)])


def predicted(study, unknowns, accuracy, changes=UNCHANGED):
    """What the calibration does not use, name: (value, what the paper prints)."""
    soft, typical = histories_with(study, unknowns, accuracy, changes)
    final = {name: float(h["binding_area"][-1]) for name, h in (("soft", soft), ("typical", typical))}
    low = LOWEST_DENSITY
    return {
        low.name: (float(typical["density_min"].min()), f"{low.value:g} ± {low.error:g}"),
        f"A({FINAL:g}) / A at the end, Fig. 2d": (float(area_at(typical, FINAL) / final["typical"]), "1 (final)"),
        "A at the end, typical, Fig. 3": (final["typical"], "below 0.8 (axis)"),
        f"A({FINAL_SOFT:g}) / A at the end, Fig. 9d": (float(area_at(soft, FINAL_SOFT) / final["soft"]), "1 (final)"),
        "r at the end, soft, Fig. 9d": (float(soft["contact_radius"][-1]), "-"),
    }


def jacobian(study, accuracy):
    """d ln(numbers) / d ln(unknowns) (2, 2), by central differences at START."""
    columns = []
    for k in range(2):
        up, down = (np.where(np.arange(2) == k, factor, 1.0) * START for factor in (1 + STEP, 1 / (1 + STEP)))
        columns.append(
            np.log(computed(study, up, accuracy) / computed(study, down, accuracy)) / (2 * np.log(1 + STEP))
        )
    return np.array(columns).T


def calibrated(study, readings, J, accuracy, start=START, iterations=3, changes=UNCHANGED):
    """Unknowns (2,) at which the two numbers are as the ``readings`` say; ``J`` is the `jacobian`."""
    wanted, unknowns = np.array([reading.value for reading in readings]), np.array(start)
    for _ in range(iterations):
        unknowns = unknowns * np.exp(
            -np.linalg.solve(J, np.log(computed(study, unknowns, accuracy, changes) / wanted))
        )
    return unknowns
