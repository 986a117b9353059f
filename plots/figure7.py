"""Fig. 7: A(t) for four ratios of ligands to receptors, with mobility held and with drift number held.

Below, local exponents. A front that captures receptors at density q out of an infinite medium, held back by their
diffusion alone, runs as A = 4 pi alpha^2 t, exponent 1, whatever q (tests/data/README.md): the exponent tells how far
the vesicle's finite supply and the membrane's resistance hold the front back.
"""

import csv

import paper
import study

CASES = ("fig7-q1.5", "fig7-q2", "fig7-q3", "typical-auto")
KEY = "adhesion.ligand_ratio"
EXPONENT_AT = 0.1  # time [a0^2/D] at which exponents are compared


def held(what):
    """The curves with the ``mobility`` held, as in configs/, or the ``drift_number`` of the largest ratio."""
    if what == "mobility":
        return paper.curves(CASES)
    change = {"receptors": f"{{drift_number: {paper.wished(CASES[-1], {}).drift_number:g}}}"}
    return paper.curves(CASES, [change] * (len(CASES) - 1) + [{}])


def infinite_medium():
    """Rates dA/dt [a0^2 per a0^2/D] of the diffusion-limited front by ratio q."""
    with open(study.ROOT / "tests" / "data" / "stefan_front.csv", newline="") as file:
        return {float(row["ligand_ratio"]): float(row["dA_dt"]) for row in csv.DictReader(file)}


def draw(out=study.OUT):
    ways = {"mobility": r"$\hat M$ held, $\Lambda = \hat M q$", "drift_number": r"$\Lambda$ held"}
    every = {what: held(what) for what in ways}
    rate = infinite_medium()
    for what, some in every.items():
        paper.tabulate(f"Fig. 7, {what} held", some, KEY)
        study.table(
            "against the front in an infinite medium",
            ["q", *(f"exponent at {t:g}" for t in (0.01, 0.03, 0.1, 0.2)), "dA/dt at 0.1", "infinite medium"],
            [
                (c.value(KEY), *(float(c.slope(t)) for t in (0.01, 0.03, 0.1, 0.2)),
                 float(c.slope(0.1) * c.at(0.1) / 0.1), rate.get(c.value(KEY), float("nan")))
                for c in some
            ],
        )  # fmt: skip

    def fill(*axes):
        for upper, lower, (what, text) in zip(axes[:2], axes[2:], ways.items()):
            paper.draw_areas(upper, every[what], KEY, until=0.8)
            upper.set_ylim(0.0, 0.8)
            upper.text(0.03, 0.97, text, transform=upper.transAxes, va="top")
            paper.draw_slopes(lower, every[what], KEY)
            lower.legend(loc="upper left", bbox_to_anchor=(0.0, 0.85), ncols=2)

    study.panels(fill, "figure7", out, size=(7.2, 5.4), shape=(2, 2))


if __name__ == "__main__":
    draw(study.command_line())
