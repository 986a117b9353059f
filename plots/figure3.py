"""Fig. 3: the binding area of the typical case, A(t), and its local exponent: fast, sub-linear, constant."""

import looks

from vesdyn.study import FAMILIES, SNAPSHOTS

EXPONENTS_AT = (0.01, 0.03, 0.1, 0.3)  # times at which the exponent is printed [a0^2/D]


def measure(study):
    """The curve; rows of time, area, exponent and errors."""
    [curve] = study.curves(FAMILIES["figure3"].cases)
    times = [t for t in SNAPSHOTS if t <= curve.end]
    areas = [(t, float(curve.at(t)), float(curve.at(t)) * curve.error()) for t in times]
    exponents = [(t, float(curve.exponent(t)), float(curve.exponent_error(t))) for t in EXPONENTS_AT]
    return {"curve": curve, "areas": areas, "exponents": exponents}


def draw(measured, out=looks.OUT):
    curve, key = measured["curve"], FAMILIES["figure3"].key
    looks.tabulate("Fig. 3", [curve], key)
    looks.table("areas at the times of Fig. 2", ["t", "A", "±"], measured["areas"])
    looks.table("local exponents", ["t", "d ln A / d ln t", "±"], measured["exponents"])

    def fill(areas, exponents):
        looks.draw_areas(areas, [curve], key, until=1.2)
        times, values, _ = zip(*measured["areas"])
        look = {"color": looks.DARK, "markerfacecolor": "white", "clip_on": False, "label": "shapes of Fig. 2"}
        areas.plot(times, values, "o", **look)
        areas.legend(loc="lower right")
        areas.set_ylim(0.0, 0.8)
        looks.draw_exponents(exponents, [curve])

    looks.panels(fill, "figure3", out, size=(7.2, 2.9))


if __name__ == "__main__":
    looks.command_line(measure, draw)
