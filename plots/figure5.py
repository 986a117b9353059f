"""Fig. 5: stronger traction spreads faster and farther: A(t) for four T_max, and what sets the curves apart."""

import paper
import study

CASES = ("fig5-T0.302", "fig5-T0.604", "fig4-K1.81", "typical-auto")
KEY = "adhesion.traction"


def draw(out=study.OUT):
    some = paper.curves(CASES)
    paper.tabulate("Fig. 5", some, KEY)

    def fill(areas, distances):
        paper.draw_areas(areas, some, KEY, until=1.2)
        paper.draw_separations(distances, some, KEY)

    study.panels(fill, "figure5", out, size=(7.2, 3.4))


if __name__ == "__main__":
    draw(study.command_line())
