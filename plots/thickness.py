"""What the thickness of the shell changes, and which one the paper's figures speak for.

For each thickness h the drag and the mobility are calibrated anew (plots/calibration.py): every row reproduces
r(0.140) = 0.416 of Fig. 9a and the largest density 4.0 of Fig. 2, and what the paper prints beside them is predicted.
Then the typical case: A(t), the range of densities, the shape of the membrane where it leaves the plane, and whether
the centre of the contact lifts off.
"""
import calibration
import numpy as np
import study
from study import DARK, GREEN, LIGHT, RED

LOOKS = {0.0: (LIGHT, ":"), 0.005: (GREEN, "-."), 0.01: (DARK, "-"), 0.02: (RED, "--"), 0.05: ("0.5", (0, (6, 2)))}
SHOWN = 0.128  # time of the shapes [a0^2/D]
ITERATIONS = 3


def calibrated(thickness, J):
    """Drag and mobility (2,), the changes that make the two scenes, and what is predicted."""
    more = {"membrane.thickness": thickness}
    unknowns = calibration.solve(J, calibration.ACCURACY, calibration.START, ITERATIONS, more)
    return unknowns, calibration.scenes(unknowns, calibration.ACCURACY, more), calibration.predicted(unknowns, calibration.ACCURACY, more)


def draw(out=study.OUT):
    J = calibration.jacobian(calibration.ACCURACY)
    found = {h: calibrated(h, J) for h in LOOKS}
    rows, typical, shapes = [], {}, {}
    for h, (unknowns, (soft, own), predictions) in found.items():
        history, soft = study.history(*own), study.history(*soft)
        typical[h] = history
        shapes[h] = next(frame["position"].T for frame in study.frames(*own) if abs(frame["time"] - SHOWN) < 1e-9)
        done = float(history["time"][np.argmax(history["binding_area"] > 0.99 * history["binding_area"][-1])])
        lifted = max(float(run["centre_gap"].max()) for run in (history, soft))
        wrinkles = float(soft["free_tension_min"].min())
        rows.append((h, *map(float, unknowns), *(value for value, _ in predictions.values()), done, lifted, wrinkles))
    names = [name for name in next(iter(found.values()))[2]]
    study.table(
        "calibrated anew for each thickness: predictions",
        ["h", "eta", "M^", *names, "t(99 % of A)", "largest gap at the centre", "smallest free tension, soft"],
        rows,
    )

    def fill(area, density, shape):
        for h, (color, line) in LOOKS.items():
            t = typical[h]["time"]
            look = {"color": color, "linestyle": line}
            area.plot(t, typical[h]["binding_area"], **look, label=f"{h:g}")
            density.semilogx(t[t > 1e-3], typical[h]["density_max"][t > 1e-3], **look)
            density.plot(t[t > 1e-3], typical[h]["density_min"][t > 1e-3], **look)
            r, z = shapes[h]
            shape.plot(r, z, **look)
        area.set(xlabel="time $t$ [$a_0^2/D$]", ylabel="binding area $A$ [$a_0^2$]", xlim=(0, 0.8), ylim=(0, None))
        area.legend(title="thickness $h$ [$a_0$]", title_fontsize=7, loc="lower right")
        density.axhspan(3.8, 4.2, color="0.9", linewidth=0)
        density.axhspan(0.35, 0.45, color="0.9", linewidth=0)
        density.set(xlabel="time $t$ [$a_0^2/D$]", ylabel="density $c$, least and largest [$c_{r0}$]", ylim=(0, None))
        study.plain(density.xaxis, (0.001, 0.01, 0.1, 1.0))
        shape.set(xlabel="$r$ [$a_0$]", ylabel="$z$ [$a_0$]", xlim=(0.28, 0.52), ylim=(-0.004, 0.2))
        shape.annotate(f"$t$ = {SHOWN:g}", (0.05, 0.9), xycoords="axes fraction")

    study.panels(fill, "thickness", out, size=(7.2, 2.6), shape=(1, 3))


if __name__ == "__main__":
    draw(study.command_line())
