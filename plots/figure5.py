"""Fig. 5: stronger traction spreads faster and farther: A(t) for four T_max, and what sets the curves apart."""

import looks

from vesdyn.study import FAMILIES


def measure(study):
    """The curves of the figure."""
    return study.curves(FAMILIES["figure5"].cases)


def draw(measured, out=looks.OUT):
    looks.draw_family("figure5", measured, FAMILIES["figure5"].key, out)


if __name__ == "__main__":
    looks.command_line(measure, draw)
