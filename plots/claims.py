"""The paper's claims, one by one: what it says, what is computed here with its error, and a verdict.

    holds               every part of the claim, by more than the errors
    holds in part       some parts
    not reproduced      none

Verdicts follow from the numbers, whatever these are when the runs are computed anew. Each claim is also put to runs
in which one thing that the paper leaves unstated is changed (UNSTATED); their errors are taken to be those of the
unchanged runs. Printed, and written to docs/claims.md.
"""

from typing import NamedTuple

import looks
import numpy as np

from vesdyn.front import modulation
from vesdyn.study import (
    FAMILIES,
    NODES,
    ON_MERIDIAN,
    SNAPSHOTS,
    at_one_product,
    common_times,
    density_range,
    displaced_fronts,
    front_shapes,
    goes_one_way,
    holds_from,
    left_of_displacement,
    with_drift_number_held,
)

TABLE = looks.ROOT / "docs" / "claims.md"
UNSTATED = (  # changes of a case
    {"drag": 0.05},
    {"drag": 0.1},
    {"receptors.mobility": 1.75},
    {"receptors.mobility": 2.625},
    {"membrane.thickness": 0.0},
    {"membrane.thickness": 0.005},
    {"membrane.thickness": 0.02},
)
PLAIN = {"drag": "η", "receptors.mobility": "M̂", "membrane.thickness": "h"}
SETTLED = 0.02  # of the final area: less than that to go counts as final
INSIGNIFICANT = 0.05  # relative change of the final area that would be
WEAK = 0.1
DISCERNIBLE = 0.02  # difference of local exponents, which a run at its own wish has to about 0.01
STABILITY = (
    (0.302, 1.51, 0.416),
    (0.603, 2.416, 0.332),
    (1.81, 3.02, 0.312),
    (1.81, 2.416, None),
)  # K, T_max, unstable from r
WATCHED = 0.004, 0.04  # after the displacement [a0^2/D]: one step, and ten
EXPONENT_AT = 0.1  # time at which exponents are compared [a0^2/D]
DISPLACED_AT = (0.144, 0.24, 0.696)  # times of Fig. 9 b to d
FRONTS_AT = tuple(float(f"{t:.4g}") for t in np.geomspace(0.002, 1.0, 55))
GROWN = 3.0  # times between the two: what counts as unstable


class Found(NamedTuple):
    """What a claim comes to: the numbers in words, and its parts, name: whether it holds."""

    numbers: str
    parts: dict

    @property
    def verdict(self):
        held = sum(self.parts.values())
        return "holds" if held == len(self.parts) else "holds in part" if held else "not reproduced"


def pm(value, error, digits=3):
    return f"{value:.{digits}f} ± {error:.{digits}f}"


def finals(some):
    return ", ".join(pm(c.final, c.final * c.error()) for c in some)


def ordered(some):
    """Whether each curve stays above the one before it, by more than their errors, at all t >= 0.01."""
    return all(holds_from(low, high) <= common_times([low, high])[0] for low, high in zip(some, some[1:]))


def spread(some):
    areas = [curve.final for curve in some]
    return max(areas) / min(areas) - 1.0


# The claims ----------------------------------------------------------------------------------------------


def snapshots(curve):
    (low, low_error), (high, high_error) = density_range(curve)
    reached = float(curve.at(SNAPSHOTS[-1])) / curve.final
    return Found(
        f"density {pm(low, low_error)} to {pm(high, high_error)}; A(0.560) is {reached:.1%} of the final area",
        {
            "0.4": abs(low - 0.4) < 0.05 + low_error,
            "4.0": abs(high - 4.0) < 0.2 + high_error,
            "final at 0.560": reached > 1 - SETTLED,
        },
    )


def typical(curve):
    t = np.array([0.0, 0.008, 0.044, 0.128, 0.56])
    area = np.append(0.0, curve.at(t[1:]))
    rate = np.diff(area) / np.diff(t)
    exponent = curve.exponent(np.geomspace(0.01, 0.3, 50))
    return Found(
        f"A = {', '.join(f'{a:.3f}' for a in area[1:])} at the times of Fig. 2, {finals([curve])}"
        f" at the end; exponent {exponent.max():.2f} at most; 99 % at t = {curve.time_of(0.99):.2f}",
        {"ever slower": bool(np.all(np.diff(rate) < 0)), "sub-linear": exponent.max() < 1,
         "constant": curve.time_of(1 - SETTLED) < 1.2, "below 0.8": curve.final < 0.8},
    )  # fmt: skip


def stiffer(*some):
    return Found(
        f"final A = {finals(some)}", {"slower": ordered(some[::-1]), "smaller": some[0].final > some[-1].final}
    )


def stronger(*some):
    gain = some[-1].final / some[-2].final - 1.0
    return Found(
        f"final A = {finals(some)}; from T = 1.51 to 2.416 {gain:+.0%}",
        {"faster, larger": ordered(some), "saturates": gain < INSIGNIFICANT + some[-1].error() + some[-2].error()},
    )


def farther(*some):
    half, error = [c.time_of(0.5) for c in some], [c.time_error(0.5) for c in some]
    return Found(
        f"final A = {finals(some)}, {spread(some):.1%} apart; half of it at t ="
        f" {', '.join(map(pm, half, error, [4] * len(some)))}",
        {"faster": half[0] - half[-1] > error[0] + error[-1], "final hardly": spread(some) < WEAK},
    )


def more_ligands(*some):
    times, errors = [c.time_of(0.95) for c in some], [c.time_error(0.95) for c in some]
    later = [b - a > ea + eb for a, b, ea, eb in zip(times, times[1:], errors, errors[1:])]
    exponents = [float(c.exponent(EXPONENT_AT)) for c in some]
    return Found(
        f"95 % of the final area at t = {', '.join(pm(t, e) for t, e in zip(times, errors))};"
        f" exponent at {EXPONENT_AT:g}: {', '.join(f'{e:.2f}' for e in exponents)}",
        {"ends first to last": times[-1] - times[0] > errors[0] + errors[-1], "every neighbour": all(later),
         "larger exponent": exponents[-1] - exponents[0] > DISCERNIBLE},
    )  # fmt: skip


def front_shape(study, changes):
    t, coarse, error, *_ = front_shapes(study, "typical-auto", FRONTS_AT, changes=changes)
    first, last = int(np.argmin(abs(t - 0.008))), len(t) - 1
    return Found(
        f"radius of curvature {pm(coarse[first, 0], error[first, 0], 4)} at t = 0.008,"
        f" {pm(coarse[last, 0], error[last, 0], 4)}"
        f" at the end; angle {np.degrees(coarse[first, 1]):.1f}° to {np.degrees(coarse[last, 1]):.1f}°",
        {"radius falls": goes_one_way(t, coarse[:, 0], error[:, 0].max(), -1),
         "angle rises": goes_one_way(t, coarse[:, 1], error[:, 1].max(), +1)},
    )  # fmt: skip


def front_radius(curve):
    r, error = float(curve.at(0.14, "contact_radius")), curve.error("contact_radius")
    return Found(f"r(0.140) = {pm(r, r * error)}", {"0.416": abs(r - 0.416) < 0.003 + r * error})


def modulated_front(study):
    coarse, symmetric = (displaced_fronts(study, name, DISPLACED_AT)[0] for name in ("fig9-coarse", "fig9-rings"))
    first, later = DISPLACED_AT[:2]

    def off(fronts, t):
        return left_of_displacement(*fronts["contact"][t])

    rim = [modulation(radius) for radius in coarse[NODES][first]]
    return Found(
        f"rim of touching nodes on the coarse mesh {rim[0]:.1%} displaced, {rim[1]:.1%} not displaced;"
        " what the displacement"
        f" leaves: {off(coarse, first):.2%} after a step, {off(coarse, later):.2%} at t = 0.240; symmetric mesh"
        f" {off(symmetric, first):.2%}, {off(symmetric, later):.2%}",
        {"due to the displacement": rim[0] > 2 * rim[1],
         "grows": off(symmetric, later) > off(symmetric, first)},
    )  # fmt: skip


def growth(study, shear_modulus, traction, radius):
    """What is left of a displacement at front ``radius`` [a0] after one step, of r, and its growth until ten."""
    material = {"membrane.shear_modulus": shear_modulus, "adhesion.traction": traction}
    rows = study.history("typical-auto", material)
    at = float(f"{np.interp(radius, rows['contact_radius'], rows['time']):.4g}")
    times = [round(at + wait, 6) for wait in WATCHED]
    changes = {**material, "perturbation.at": at, "time.end": times[-1], "output.frames": times}
    fronts = displaced_fronts(study, "fig9-rings", times, changes)[0]["above"]
    first, last = (left_of_displacement(*pair) for pair in fronts.values())
    return first, last / first


def stability(study):
    radii = [radius for *_, radius in STABILITY if radius]
    found = [(K, T, radius, *growth(study, K, T, radius or min(radii))) for K, T, radius in STABILITY]
    return Found(
        "; ".join(f"K = {K:g}, T = {T:g}: {left:.3%} of 2 % is left after a step, times {factor:.2g} after nine more"
                  for K, T, _, left, factor in found),
        {f"K = {K:g}, T = {T:g}": factor > GROWN for K, T, radius, _, factor in found if radius},
    )  # fmt: skip


class Claim(NamedTuple):
    """A claim: the paper's words, ``find(*curves)`` that judges it, and its curves."""

    name: str
    says: str
    find: object
    curves: object = None  # a function that makes them
    holding: str = ""  # a key that cannot be changed in them


CLAIMS = (
    Claim(
        "F2",
        "snapshots at 0.008, 0.044, 0.128 and 0.560 (final); density 0.4 to 4.0",
        snapshots,
        lambda study: study.curves(FAMILIES["figure2"].cases),
    ),
    Claim(
        "F3",
        "fast, then sub-linear, then constant; A below 0.8",
        typical,
        lambda study: study.curves(FAMILIES["figure3"].cases),
    ),
    Claim("F4", "stiffer: slower and smaller", stiffer, lambda study: study.curves(FAMILIES["figure4"].cases)),
    Claim(
        "F5",
        "stronger: faster and larger; beyond T_max = 1.51 insignificant",
        stronger,
        lambda study: study.curves(FAMILIES["figure5"].cases),
    ),
    Claim(
        "F6",
        "longer range: slightly faster; final area only weakly dependent",
        farther,
        lambda study: study.curves(FAMILIES["figure6"].cases),
    ),
    Claim("F6, one T_max d_c", "the same, read as one adhesion energy", farther, at_one_product),
    Claim(
        "F7, mobility held",
        "more ligands: closer to linear A(t)",
        more_ligands,
        lambda study: study.curves(FAMILIES["figure7"].cases),
    ),
    Claim("F7, drift number held", "the same", more_ligands, with_drift_number_held, "receptors.mobility"),
    Claim("F9, base", "r = 0.416 at t = 0.140", front_radius, lambda study: study.curves(["fig9-base"], ON_MERIDIAN)),
)
WITHOUT_CURVES = (
    Claim("F8", "front's radius of curvature falls, spreading angle rises", lambda study: front_shape(study, {})),
    Claim("F9, front", "a random displacement of 2 % leaves modulations that multiply and stay", modulated_front),
    Claim(
        "S", "unstable: (K, T_max) = (0.302, 1.51), (0.603, 2.416), (1.81, 3.02); stable: (1.81, 2.416)", stability
    ),
)


def said(changes):
    return ", ".join(f"{PLAIN[key]} = {value:g}" for key, value in changes.items())


def sensitivity(study, claim, base, some):
    """What the verdict and the final areas become with each of UNSTATED, in words."""
    words, moved = [], {}
    for changes in (changes for changes in UNSTATED if claim.holding not in changes):
        others = study.varied(some, changes)
        found = claim.find(*others)
        lost = [part for part in base.parts if base.parts[part] and not found.parts[part]]
        won = [part for part in base.parts if found.parts[part] and not base.parts[part]]
        if lost or won:
            words.append(
                f"{said(changes)}: "
                + "; ".join([f"not “{part}”" for part in lost] + [f"“{part}” too" for part in won])
            )
        key, value = next(iter(changes.items()))
        shift = np.mean([other.final / curve.final - 1.0 for other, curve in zip(others, some)])
        moved.setdefault(key, []).append(f"{shift:+.1%} at {value:g}")
    areas = "; ".join(f"{PLAIN[key]} {', '.join(parts)}" for key, parts in moved.items())
    return ("; ".join(words) or "verdict the same") + f". Final areas: {areas}"


def measure(study):
    """The unchanged typical case, and rows of name, what the paper says, what is computed, verdict, sensitivity."""
    rows = []
    for claim in CLAIMS + WITHOUT_CURVES:
        some = claim.curves(study) if claim.curves else []
        found = claim.find(*some) if some else claim.find(study)
        failed = [part for part, is_so in found.parts.items() if not is_so]
        verdict = found.verdict + (f" (not “{'”, “'.join(failed)}”)" if found.verdict == "holds in part" else "")
        rows.append(
            (claim.name, claim.says, found.numbers, verdict, sensitivity(study, claim, found, some) if some else "-")
        )
        print(*rows[-1], sep="\n    ", flush=True)
    return study.case("typical-auto"), rows


def draw(measured, out=TABLE.parent):
    case, rows = measured
    lines = [
        "# The paper's claims",
        "",
        f"Computed by `python plots/claims.py` with drag {case.drag:g}, mobility {case.receptors.mobility:g},"
        f" thickness {case.membrane.thickness:g} and an accuracy wish of {case.accuracy:.0%}; errors are those of"
        " mesh, step and tolerance (`vesdyn/study.py`). Units: length a0, time a0²/D, energy kT, density c_r0.",
        "",
        "| claim | the paper says | computed | verdict | where the paper is silent |",
        "|---|---|---|---|---|",
        *("| " + " | ".join(cell.replace("|", "/") for cell in row) + " |" for row in rows),
        "",
    ]
    out.mkdir(parents=True, exist_ok=True)
    (out / TABLE.name).write_text("\n".join(lines))
    print(f"\n{TABLE.name}")


if __name__ == "__main__":
    looks.command_line(measure, draw, TABLE.parent)
