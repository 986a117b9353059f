"""Fig. 5: stronger traction spreads faster and farther: A(t) for four T_max, and what sets the curves apart."""

import paper
import study

CASES = ("fig5-T0.302", "fig5-T0.604", "fig4-K1.81", "typical-auto")
KEY = "adhesion.traction"


def draw(out=study.OUT):
    paper.draw_family(5, CASES, KEY, out)


if __name__ == "__main__":
    draw(study.command_line())
