"""Fig. 6: A(t) for three ranges of the traction, at one T_max, as printed, and at one product T_max d_c.

The product is what a receptor gains by binding fully, twice over (`plots/cutoff.py`).
"""

import looks

from vesdyn.study import FAMILIES, at_one_product


def measure(study):
    """The curves of the figure, held constant: curves."""
    return {"one T_max": study.curves(FAMILIES["figure6"].cases), "one T_max d_c": at_one_product(study)}


def draw(measured, out=looks.OUT):
    key = FAMILIES["figure6"].key
    for what, curves in measured.items():
        looks.tabulate(f"Fig. 6, {what}", curves, key)
    words = r"one $T_\mathrm{max}$", r"one product $T_\mathrm{max} d_c$"

    def fill(*axes):
        for ax, curves, what in zip(axes, measured.values(), words):
            looks.draw_areas(ax, curves, key, until=1.2)
            ax.set_ylim(0.0, 0.75)
            ax.text(0.03, 0.97, what, transform=ax.transAxes, va="top")

    looks.panels(fill, "figure6", out, size=(7.2, 3.0))


if __name__ == "__main__":
    looks.command_line(measure, draw)
