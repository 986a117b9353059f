"""What the thickness of the shell changes, and which one the paper's figures speak for.

For each thickness h the drag and the mobility are calibrated anew (`vesdyn.calibration`): every row reproduces
r(0.140) = 0.416 of Fig. 9a and the largest density 4.0 of Fig. 2, and what the paper prints beside them is predicted.
Then the typical case: A(t), the range of densities, the shape of the membrane where it leaves the plane, and whether
the centre of the contact lifts off.
"""

import looks
from looks import DARK, GREEN, LIGHT, RED

from vesdyn.calibration import FRONT_AND_DENSITY, calibrated, jacobian, predicted, runs_with
from vesdyn.study import time_of

ACCURACY = 0.01

LOOKS = {0.0: (LIGHT, ":"), 0.005: (GREEN, "-."), 0.01: (DARK, "-"), 0.02: (RED, "--"), 0.05: ("0.5", (0, (6, 2)))}
SHOWN = 0.128  # time of the shapes [a0^2/D]
ITERATIONS = 3
SETTLED = 0.99  # of the final area


def measure(study, thicknesses=tuple(LOOKS), shown=SHOWN, readings=FRONT_AND_DENSITY, iterations=ITERATIONS):
    """By thickness: drag and mobility, what is predicted with them, history and a shape of the typical case."""
    J = jacobian(study, ACCURACY)
    return {h: measure_one(study, h, J, shown, readings, iterations) for h in thicknesses}


def measure_one(study, thickness, J, shown, readings, iterations):
    """What `measure` tells of one thickness."""
    more = {"membrane.thickness": thickness}
    unknowns = calibrated(study, readings, J, ACCURACY, iterations=iterations, changes=more)
    soft, typical = runs_with(unknowns, ACCURACY, more)
    histories = [study.history(*run) for run in (soft, typical)]
    return {
        "unknowns": unknowns,
        "predictions": predicted(study, unknowns, ACCURACY, more),
        "history": histories[1],
        "shape": next(f["position"] for f in study.frames(*typical) if abs(f["time"] - shown) < 1e-9),
        "settled": time_of(histories[1], SETTLED),
        "lifted": max(float(history["centre_gap"].max()) for history in histories),
        "slackest": float(histories[0]["free_tension_min"].min()),
    }


def draw(measured, out=looks.OUT):
    names = next(iter(measured.values()))["predictions"]
    looks.table(
        "calibrated anew for each thickness: predictions",
        ["h", "eta", "M^", *names, "t(99 % of A)", "largest gap at the centre", "smallest free tension, soft"],
        [
            (h, *map(float, found["unknowns"]), *(value for value, _ in found["predictions"].values()),
             *(found[key] for key in ("settled", "lifted", "slackest")))
            for h, found in measured.items()
        ],
    )  # fmt: skip

    def fill(area, density, shape):
        for h, found in measured.items():
            color, line = LOOKS[h]
            history = found["history"]
            t = history["time"]
            look = {"color": color, "linestyle": line}
            area.plot(t, history["binding_area"], **look, label=f"{h:g}")
            density.semilogx(t[t > 1e-3], history["density_max"][t > 1e-3], **look)
            density.plot(t[t > 1e-3], history["density_min"][t > 1e-3], **look)
            shape.plot(*found["shape"].T, **look)
        area.set(xlabel=looks.TIME, ylabel=looks.AREA, xlim=(0, 0.8), ylim=(0, None))
        area.legend(title="thickness $h$ [$a_0$]", title_fontsize=7, loc="lower right")
        density.axhspan(3.8, 4.2, color="0.9", linewidth=0)
        density.axhspan(0.35, 0.45, color="0.9", linewidth=0)
        density.set(xlabel=looks.TIME, ylabel="density $c$, least and largest [$c_{r0}$]", ylim=(0, None))
        looks.plain(density.xaxis, (0.001, 0.01, 0.1, 1.0))
        shape.set(xlabel="$r$ [$a_0$]", ylabel="$z$ [$a_0$]", xlim=(0.28, 0.52), ylim=(-0.004, 0.2))
        shape.annotate(f"$t$ = {SHOWN:g}", (0.05, 0.9), xycoords="axes fraction")

    looks.panels(fill, "thickness", out, size=(7.2, 2.6), shape=(1, 3))


if __name__ == "__main__":
    looks.command_line(measure, draw)
