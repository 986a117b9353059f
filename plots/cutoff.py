"""Fig. 6 against Fig. 5: does the final area depend on the range d_c of the traction?

A receptor that binds gains T_max d_c / 2, and its Boltzmann factor in the contact is exp(Lambda T_max d_c / 2): for a
range short against the vesicle the final state knows T_max and d_c by their product alone. So a final area that grows
with T_max at one d_c (Fig. 5) must grow with d_c at one T_max, and can be independent of d_c only at one product.

(a) Final areas against the product: Fig. 5's curves, Fig. 6's, and one product at ranges down to a hundredth.
(b) Final areas against d_c on meshes as coarse as d_c, with the paper's step and staggering, read at the kink and as
the area of nodes that touch: does an unresolved range make it not matter?
"""

import looks
import numpy as np
from looks import DARK, GREEN, LIGHT, RED

from vesdyn.body import element_areas
from vesdyn.kinds import topology_of
from vesdyn.study import FAMILIES, area_at

MIDDLE = FAMILIES["figure6"].cases[1]
TIMES = (0.044, 0.128)  # at which areas are printed [a0^2/D]
RANGES = (0.0125, 0.025, 0.05, 0.1, 0.18, 0.3)  # d_c [a0] at one product
EDGES = (0.05, 0.06, 0.07, 0.08, 0.1, 0.115, 0.13)  # of coarse meshes [a0]
COARSE = {"time.step": 0.004, "time.order": 1, "time.end": 1.0, "output.frames": [1.0]}
BODIES = {"axisymmetric": (LIGHT, "^"), "surface": (RED, "s")}


def measure(study, ranges=RANGES, edges=EDGES, coarse=COARSE):
    """Final areas: of Figs. 5 and 6 with product, range and error; at one product by range; on coarse meshes."""
    law = study.case(MIDDLE).adhesion
    one = [
        (MIDDLE, {"adhesion.cutoff": d, "adhesion.traction": float(f"{law.traction * law.cutoff / d:.6g}")})
        for d in ranges
    ]
    study.prepare(one)
    histories = [study.history(*run) for run in one]
    return {
        "Fig. 5": [final_area(curve) for curve in study.curves(FAMILIES["figure5"].cases)],
        "Fig. 6": [final_area(curve) for curve in study.curves(FAMILIES["figure6"].cases)],
        "product": law.traction * law.cutoff,
        "one product": [
            (d, *(float(area_at(h, t)) for t in TIMES), float(h["binding_area"][-1]))
            for d, h in zip(ranges, histories)
        ],
        "edges": edges,
        "coarse": {body: on_coarse_meshes(study, body, edges, coarse) for body in BODIES},
    }


def final_area(curve):
    """Product T_max d_c, range d_c, final area and its error."""
    law = curve.case.adhesion
    return law.traction * law.cutoff, law.cutoff, curve.final, curve.final * curve.error()


def touching_area(frame):
    """Area [a0^2] of the nodes of a stored shape that touch the plane, each a share of its elements'."""
    area = element_areas(topology_of(frame["elements"]), frame["position"])
    return float(np.sum(area * (frame["gap"][frame["elements"]] <= 0.0).mean(axis=1)))


def on_coarse_meshes(study, body, edges, coarse):
    """Final areas (n_edges, n_ranges, 2) [a0^2] of Fig. 6's cases, bound at the kink and of touching nodes."""
    changes = [
        {"model": body, "mesh": {"front_edge": e, "far_edge": e, "layout": "spiral"}, **coarse} for e in edges
    ]
    runs = [[(name, change) for name in FAMILIES["figure6"].cases] for change in changes]
    study.prepare([run for row in runs for run in row])
    bound = [[study.history(*run)["binding_area"][-1] for run in row] for row in runs]
    touching = [[touching_area(study.frames(*run)[-1]) for run in row] for row in runs]
    return np.stack([bound, touching], axis=-1)


def draw(measured, out=looks.OUT):
    product, edges, ranges = measured["product"], measured["edges"], [d for _, d, *_ in measured["Fig. 6"]]
    looks.table(
        f"one product T_max d_c = {product:g}: areas [a0^2]",
        ["d_c", *(f"A({t:g})" for t in TIMES), "at the end"],
        measured["one product"],
    )
    for body, areas in measured["coarse"].items():
        looks.table(
            f"{body}, coarse: final areas [a0^2] by d_c, bound at the kink | of touching nodes; largest / smallest",
            ["edge", *(f"{d:g}" for d in ranges), *(f"{d:g}" for d in ranges), "kink", "nodes"],
            [
                (e, *map(float, row.T.ravel()), *map(float, row.max(axis=0) / row.min(axis=0)))
                for e, row in zip(edges, areas)
            ],
        )

    def fill(products, meshes):
        for figure, marker, color, label in (
            ("Fig. 5", "o", DARK, r"Fig. 5: $T_\mathrm{max}$ varied"),
            ("Fig. 6", "s", RED, "Fig. 6: $d_c$ varied"),
        ):
            x, _, finals, errors = zip(*measured[figure])
            products.errorbar(x, finals, errors, fmt=marker, color=color,
                              markerfacecolor="white" if marker == "s" else color, label=label)  # fmt: skip
        shortest, *_, longest = [d for d, *_ in measured["one product"]]
        finals = [final for *_, final in measured["one product"]]
        products.plot([product] * len(finals), finals, "_", color=GREEN, markersize=9,
                      label=f"$d_c$ = {shortest:g} to {longest:g}, one product")  # fmt: skip
        largest = max(x for x, *_ in measured["Fig. 5"] + measured["Fig. 6"])
        products.set(xlabel=r"product $T_\mathrm{max} d_c$ [$kT/a_0^2$]", ylabel="final binding area $A$ [$a_0^2$]")
        products.set(xlim=(0.0, 1.1 * largest), ylim=(0.0, 0.8))
        products.legend(loc="lower right")
        _, _, finals, errors = zip(*measured["Fig. 6"])
        meshes.errorbar(ranges, finals, errors, fmt="o-", color=DARK, label="resolved")
        for (body, areas), shift in zip(measured["coarse"].items(), (-0.002, 0.002)):
            color, marker = BODIES[body]
            for k, (how, filled) in enumerate((("bound", True), ("touching nodes", False))):
                middle = areas[:, :, k].mean(axis=0)
                reach = abs(np.array([areas[:, :, k].min(axis=0), areas[:, :, k].max(axis=0)]) - middle)
                look = {"color": color, "markerfacecolor": color if filled else "white", "label": f"{body}, {how}"}
                at = np.array(ranges) + shift * (1 + 2 * k)
                meshes.errorbar(at, middle, reach, fmt=marker, capsize=2, linewidth=0.8, **look)
        meshes.set(
            xlabel="range $d_c$ of the traction [$a_0$]", ylabel="final binding area $A$ [$a_0^2$]", ylim=(0.0, 1.0)
        )
        meshes.legend(
            loc="lower right", title=f"mean and range of edges {edges[0]:g} to {edges[-1]:g}", title_fontsize=7
        )

    looks.panels(fill, "cutoff", out, size=(7.2, 3.2))


if __name__ == "__main__":
    looks.command_line(measure, draw)
