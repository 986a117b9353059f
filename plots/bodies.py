"""Surface against meridian: thanks to bending they agree in tension and in compression.

The same scenes on both bodies, the meridian at an accuracy wish of 0.3 %, the surface at 2 %: the typical case, the
soft case of Fig. 9, and the typical case with a prestretch of 1.05, in tension everywhere.
"""

import looks
import numpy as np
from looks import DARK, GREEN, RED

from vesdyn.study import area_at

SCENES = {
    "typical case": ("typical", {}, DARK, "o", "-"),
    "soft case of Fig. 9": ("fig9-base", {}, RED, "s", "--"),
    "typical, prestretch 1.05": ("typical", {"membrane.prestretch": 1.05}, GREEN, "^", "-."),
}
WISHES = {"axisymmetric": 0.003, "surface": 0.02}
END = 0.696


def measure(study, end=END, wishes=WISHES):
    """Histories by scene: on the meridian and on the surface; rows of what sets them apart."""
    times = [float(t) for t in looks.independent_areas("typical")[0] if t <= end]
    auto = {"mesh": "auto", "time.step": "auto", "time.end": end, "output.frames": times}
    runs = {
        name: [(scene, {**changes, **auto, "model": model, "accuracy": wish}) for model, wish in wishes.items()]
        for name, (scene, changes, *_) in SCENES.items()
    }
    study.prepare([run for pair in runs.values() for run in pair])
    histories = {name: [study.history(*run) for run in pair] for name, pair in runs.items()}
    return {
        "histories": histories,
        "rows": [row for name, pair in histories.items() for row in apart(name, *pair, times)],
    }


def apart(name, meridian, surface, times):
    """Rows of scene, time, relative differences of area and densities, both pressures, smallest free tension."""
    rows = []
    for t in times:
        m, s = ({key: float(np.interp(t, h["time"], h[key])) for key in h} for h in (meridian, surface))
        off = [s[key] / m[key] - 1.0 for key in ("binding_area", "density_min", "density_max")]
        rows.append((name, t, *off, m["pressure"], s["pressure"], m["free_tension_min"]))
    return rows


def draw(measured, out=looks.OUT):
    looks.table(
        "surface / meridian - 1, pressures, smallest tension of the free meridian",
        ["scene", "t", "A", "c min", "c max", "p meridian", "p surface", "tension"],
        measured["rows"],
    )

    def fill(area, pressure):
        for name, (meridian, surface) in measured["histories"].items():
            *_, color, marker, line = SCENES[name]
            t = meridian["time"][meridian["time"] > 0.004]
            s = surface["time"][surface["time"] > 0.004]
            off = np.interp(s, surface["time"], surface["binding_area"]) / area_at(meridian, s) - 1.0
            area.semilogx(
                s, 100 * off, color=color, linestyle=line, marker=marker, markevery=0.08, markersize=3, label=name
            )
            pressure.semilogx(t, np.interp(t, meridian["time"], meridian["pressure"]), color=color, linestyle=line)
            shown = s[:: max(1, len(s) // 14)]
            marks = {"color": color, "marker": marker, "linestyle": "none", "markerfacecolor": "none", "label": name}
            pressure.plot(shown, np.interp(shown, s, surface["pressure"][-len(s) :]), **marks)
        area.axhline(0.0, color="0.7", linewidth=0.6)
        area.set(xlabel=looks.TIME, ylabel="$A$ on the surface / on the meridian $-$ 1 [%]", ylim=(-3.5, 3.5))
        pressure.set(xlabel=looks.TIME, ylabel="pressure $p$ [$kT/a_0^3$]")
        for ax in (area, pressure):
            looks.plain(ax.xaxis, (0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5))
        looks.legend_below(area)
        looks.legend_below(pressure, title="line: meridian, mark: surface")

    looks.panels(fill, "bodies", out, size=(7.2, 3.8))


if __name__ == "__main__":
    looks.command_line(measure, draw, every=looks.INDEPENDENT)
