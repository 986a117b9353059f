"""Surface against meridian: thanks to bending they agree in tension and in compression.

The same scenes on both bodies, the meridian at an accuracy wish of 0.3 %, the surface at 2 %: the typical case, the
soft case of Fig. 9, and the typical case with a prestretch of 1.05, in tension everywhere.
"""
import numpy as np
import study
from study import DARK, GREEN, RED

SCENES = {
    "typical case": ("typical", {}, DARK, "o", "-"),
    "soft case of Fig. 9": ("fig9-base", {}, RED, "s", "--"),
    "typical, prestretch 1.05": ("typical", {"membrane.prestretch": 1.05}, GREEN, "^", "-."),
}
WISHES = {"axisymmetric": 0.003, "surface": 0.02}
END = 0.696


def both(scene, changes, end, wishes):
    """Histories on the meridian and on the surface."""
    return [
        study.history(scene, changes | {"model": model, "mesh": "auto", "time.step": "auto", "accuracy": wish, "time.end": end})
        for model, wish in wishes.items()
    ]


def main(out=study.OUT, end=END, wishes=WISHES):
    curves = {name: both(scene, changes, end, wishes) for name, (scene, changes, *_) in SCENES.items()}
    rows = []
    for name, (meridian, surface) in curves.items():
        for t in (t for t in study.listed("typical")[0] if t <= end):
            at = [{key: np.interp(t, h["time"], h[key]) for key in h} for h in (meridian, surface)]
            off = [float(at[1][key] / at[0][key] - 1.0) for key in ("binding_area", "density_min", "density_max")]
            rows.append((name, float(t), *off, float(at[0]["pressure"]), float(at[1]["pressure"]), float(at[0]["free_tension_min"])))
    study.table(
        "surface / meridian - 1, pressures, smallest tension of the free meridian",
        ["scene", "t", "A", "c min", "c max", "p meridian", "p surface", "tension"],
        rows,
    )

    def draw(area, pressure):
        for name, (meridian, surface) in curves.items():
            *_, color, marker, line = SCENES[name]
            t = meridian["time"][meridian["time"] > 0.004]
            s = surface["time"][surface["time"] > 0.004]
            off = np.interp(s, surface["time"], surface["binding_area"]) / study.area_at(meridian, s) - 1.0
            area.semilogx(s, 100 * off, color=color, linestyle=line, marker=marker, markevery=0.08, markersize=3, label=name)
            pressure.semilogx(t, np.interp(t, meridian["time"], meridian["pressure"]), color=color, linestyle=line)
            shown = s[:: max(1, len(s) // 14)]
            pressure.plot(shown, np.interp(shown, s, surface["pressure"][-len(s) :]), color=color, marker=marker, linestyle="none",
                          markerfacecolor="none", label=name)  # fmt: skip
        area.axhline(0.0, color="0.7", linewidth=0.6)
        area.set(xlabel="time $t$ [$a_0^2/D$]", ylabel="$A$ on the surface / on the meridian $-$ 1 [%]", ylim=(-3.5, 3.5))
        pressure.set(xlabel="time $t$ [$a_0^2/D$]", ylabel="pressure $p$ [$kT/a_0^3$]")
        for ax in (area, pressure):
            study.plain(ax.xaxis, (0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5))
        study.legend_below(area)
        study.legend_below(pressure, title="line: meridian, mark: surface")

    study.panels(draw, "bodies", out, size=(7.2, 3.8))


if __name__ == "__main__":
    main(study.command_line())
