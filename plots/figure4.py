"""Fig. 4: stiffer membranes spread more slowly and less: A(t) for four moduli K, and what sets the curves apart."""

import paper
import study

CASES = ("fig4-K0.603", "fig4-K1.206", "fig4-K1.81", "fig4-K3.018")
KEY = "membrane.shear_modulus"


def draw(out=study.OUT):
    paper.draw_family(4, CASES, KEY, out)


if __name__ == "__main__":
    draw(study.command_line())
