"""Fig. 4: stiffer membranes spread more slowly and less: A(t) for four moduli K, and what sets the curves apart."""

import paper
import study

CASES = ("fig4-K0.603", "fig4-K1.206", "fig4-K1.81", "fig4-K3.018")
KEY = "membrane.shear_modulus"


def draw(out=study.OUT):
    some = paper.curves(CASES)
    paper.tabulate("Fig. 4", some, KEY)

    def fill(areas, distances):
        paper.draw_areas(areas, some, KEY, until=1.2)
        paper.draw_separations(distances, some, KEY)

    study.panels(fill, "figure4", out, size=(7.2, 3.4))


if __name__ == "__main__":
    draw(study.command_line())
