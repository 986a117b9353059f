"""Fig. 6: A(t) for three ranges of the traction, at one T_max, as printed, and at one product T_max d_c.

The product is what a receptor gains by binding fully, twice over (`plots/cutoff.py`).
"""

import paper
import study

CASES = ("fig6-dc0.06", "fig4-K1.81", "fig6-dc0.18")
KEY = "adhesion.cutoff"


def at_one_product():
    """The curves with the traction changed so that T_max d_c is that of the middle one."""
    shorter, law, longer = (paper.wished(name, {}).adhesion for name in CASES)
    other = [
        {"adhesion.traction": float(f"{law.traction * law.cutoff / d:.6g}")} for d in (shorter.cutoff, longer.cutoff)
    ]
    return paper.curves(CASES, [other[0], {}, other[1]])


def draw(out=study.OUT):
    both = paper.curves(CASES), at_one_product()
    for some, what in zip(both, ("one T_max", "one T_max d_c")):
        paper.tabulate(f"Fig. 6, {what}", some, KEY)

    def fill(*axes):
        for ax, some, what in zip(axes, both, (r"one $T_\mathrm{max}$", r"one product $T_\mathrm{max} d_c$")):
            paper.draw_areas(ax, some, KEY, until=1.2)
            ax.set_ylim(0.0, 0.75)
            ax.text(0.03, 0.97, what, transform=ax.transAxes, va="top")

    study.panels(fill, "figure6", out, size=(7.2, 3.0))


if __name__ == "__main__":
    draw(study.command_line())
