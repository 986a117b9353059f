"""Fig. 4: stiffer membranes spread more slowly and less: A(t) for four moduli K, and what sets the curves apart."""

import looks

from vesdyn.study import FAMILIES


def measure(study):
    """The curves of the figure."""
    return study.curves(FAMILIES["figure4"].cases)


def draw(measured, out=looks.OUT):
    looks.draw_family("figure4", measured, FAMILIES["figure4"].key, out)


if __name__ == "__main__":
    looks.command_line(measure, draw)
