"""Fig. 3: the binding area of the typical case, A(t), and its local exponent: fast, sub-linear, constant."""

import paper
import study
from study import DARK

CASE = "typical-auto"
KEY = "membrane.shear_modulus"


def draw(out=study.OUT):
    [curve] = paper.curves([CASE])
    paper.tabulate("Fig. 3", [curve], KEY)
    shown = [t for t in curve.case.output.frames if t <= curve.rows["time"][-1]]

    def fill(areas, slopes):
        paper.draw_areas(areas, [curve], KEY, until=1.2)
        areas.plot(
            shown, curve.at(shown), "o", color=DARK, markerfacecolor="white", clip_on=False, label="shapes of Fig. 2"
        )
        areas.legend(loc="lower right")
        areas.set_ylim(0.0, 0.8)
        paper.draw_slopes(slopes, [curve])

    study.panels(fill, "figure3", out, size=(7.2, 2.9))


if __name__ == "__main__":
    draw(study.command_line())
