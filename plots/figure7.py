"""Fig. 7: A(t) for four ratios of ligands to receptors, with mobility held and with drift number held.

Below, local exponents. A front that captures receptors at density q out of an infinite medium, held back by their
diffusion alone, runs as A = 4 pi alpha^2 t, exponent 1, whatever q (tests/data/README.md): the exponent tells how far
the vesicle's finite supply and the membrane's resistance hold the front back.
"""

import looks

from vesdyn.study import FAMILIES, with_drift_number_held

EXPONENTS_AT = (0.01, 0.03, 0.1, 0.2)  # times [a0^2/D]
RATE_AT = 0.1  # time at which dA/dt is compared [a0^2/D]
WAYS = {"mobility": r"$\hat M$ held, $\Lambda = \hat M q$", "drift number": r"$\Lambda$ held"}


def infinite_medium():
    """Rates dA/dt [a0^2 per a0^2/D] of the diffusion-limited front by ratio q."""
    return {float(row["ligand_ratio"]): float(row["dA_dt"]) for row in looks.data("stefan_front")}


def measure(study):
    """By what is held: curves, their exponents and errors (n_curves, n_times, 2), and rates dA/dt."""
    families = {"mobility": study.curves(FAMILIES["figure7"].cases), "drift number": with_drift_number_held(study)}
    return {
        held: {
            "curves": curves,
            "exponents": [[(float(c.exponent(t)), float(c.exponent_error(t))) for t in EXPONENTS_AT] for c in curves],
            "rates": [float(c.exponent(RATE_AT) * c.at(RATE_AT) / RATE_AT) for c in curves],
        }
        for held, curves in families.items()
    }


def draw(measured, out=looks.OUT):
    key, rate = FAMILIES["figure7"].key, infinite_medium()
    for held, found in measured.items():
        looks.tabulate(f"Fig. 7, {held} held", found["curves"], key)
        looks.table(
            "local exponents, against the front in an infinite medium",
            ["q", *(f"at {t:g}" for t in EXPONENTS_AT), f"dA/dt at {RATE_AT:g}", "infinite medium"],
            [
                (
                    c.value(key),
                    *(f"{e:.3f} ± {error:.3f}" for e, error in exponents),
                    dA_dt,
                    rate.get(c.value(key), float("nan")),
                )
                for c, exponents, dA_dt in zip(*found.values())
            ],
        )

    def fill(*axes):
        for upper, lower, (held, found) in zip(axes[:2], axes[2:], measured.items()):
            looks.draw_areas(upper, found["curves"], key, until=0.8)
            upper.set_ylim(0.0, 0.8)
            upper.text(0.03, 0.97, WAYS[held], transform=upper.transAxes, va="top")
            looks.draw_exponents(lower, found["curves"], key)
            lower.legend(loc="upper left", bbox_to_anchor=(0.0, 0.85), ncols=2)

    looks.panels(fill, "figure7", out, size=(7.2, 5.4), shape=(2, 2))


if __name__ == "__main__":
    looks.command_line(measure, draw)
