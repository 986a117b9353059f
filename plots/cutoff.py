"""Fig. 6 against Fig. 5: does the final area depend on the range d_c of the traction?

A receptor that binds gains T_max d_c / 2, and its Boltzmann factor in the contact is exp(Lambda T_max d_c / 2): for a
range short against the vesicle the final state knows T_max and d_c by their product alone. So a final area that grows
with T_max at one d_c (Fig. 5) must grow with d_c at one T_max, and can be independent of d_c only at one product.

(a) Final areas against the product: Fig. 5's curves, Fig. 6's, and one product at ranges down to a hundredth.
(b) Final areas against d_c on meshes as coarse as d_c, with the paper's step and staggering, read at the kink and as
the area of nodes that touch: does an unresolved range make it not matter?
"""

import figure5
import figure6
import numpy as np
import paper
import study
from study import DARK, GREEN, LIGHT, RED

MIDDLE = "fig4-K1.81"  # of Fig. 6
RANGES = (0.0125, 0.025, 0.05, 0.1, 0.18, 0.3)  # d_c [a0] at one product
EDGES = (0.05, 0.06, 0.07, 0.08, 0.1, 0.115, 0.13)  # of coarse meshes [a0]
COARSE = {"time.step": 0.004, "time.order": 1, "time.end": 1.0, "output.frames": [1.0]}
BODIES = {"axisymmetric": (LIGHT, "^"), "surface": (RED, "s")}


def at_one_product(ranges=RANGES):
    """Histories of the middle case of Fig. 6 at other ``ranges`` and the same T_max d_c."""
    law = paper.wished(MIDDLE, {}).adhesion
    runs = [
        (MIDDLE, {"adhesion.cutoff": d, "adhesion.traction": float(f"{law.traction * law.cutoff / d:.6g}")})
        for d in ranges
    ]
    study.prepare(runs)
    return [study.history(*run) for run in runs]


def touching_area(frame):
    """Area [a0^2] of the nodes of a stored shape that touch the plane, each a share of its elements'."""
    corner = frame["position"][frame["elements"]]
    if corner.shape[1] == 2:  # cones
        area = np.pi * corner[:, :, 0].sum(axis=1) * np.linalg.norm(corner[:, 1] - corner[:, 0], axis=1)
    else:
        area = 0.5 * np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    return float(np.sum(area * (frame["gap"][frame["elements"]] <= 0.0).mean(axis=1)))


def on_coarse_meshes(body, edges=EDGES):
    """Final areas (n_edges, n_ranges, 2) [a0^2] of Fig. 6's cases, bound at the kink and of touching nodes."""
    changes = [
        {"model": body, "mesh": f"{{front_edge: {e}, far_edge: {e}, layout: spiral}}", **COARSE} for e in edges
    ]
    runs = [[(name, change) for name in figure6.CASES] for change in changes]
    study.prepare([run for row in runs for run in row])
    return np.array([
        [(study.history(*run)["binding_area"][-1], touching_area(study.frames(*run)[-1])) for run in row] for row in runs
    ])  # fmt: skip


def draw(out=study.OUT):
    by_traction, by_range = paper.curves(figure5.CASES), paper.curves(figure6.CASES)
    product = [c.value("adhesion.traction") * c.value("adhesion.cutoff") for c in by_traction + by_range]
    one = at_one_product()
    law = paper.wished(MIDDLE, {}).adhesion
    ranges = [c.value("adhesion.cutoff") for c in by_range]
    coarse = {body: on_coarse_meshes(body, EDGES) for body in BODIES}
    study.table(
        f"one product T_max d_c = {law.traction * law.cutoff:g}: areas [a0^2]",
        ["d_c", "A(0.044)", "A(0.128)", "at the end"],
        [
            (d, *(float(study.area_at(h, t)) for t in (0.044, 0.128)), float(h["binding_area"][-1]))
            for d, h in zip(RANGES, one)
        ],
    )
    for body, areas in coarse.items():
        study.table(
            f"{body}, coarse: final areas [a0^2] by d_c, bound at the kink | of touching nodes; largest / smallest",
            ["edge", *(f"{d:g}" for d in ranges), *(f"{d:g}" for d in ranges), "kink", "nodes"],
            [
                (e, *map(float, row.T.ravel()), *map(float, row.max(axis=0) / row.min(axis=0)))
                for e, row in zip(EDGES, areas)
            ],
        )

    def fill(products, meshes):
        for some, marker, color, label in (
            (by_traction, "o", DARK, "Fig. 5: $T_\\mathrm{max}$ varied"),
            (by_range, "s", RED, "Fig. 6: $d_c$ varied"),
        ):
            x = [c.value("adhesion.traction") * c.value("adhesion.cutoff") for c in some]
            products.errorbar(x, [c.final for c in some], [c.final * c.error() for c in some], fmt=marker, color=color,
                              markerfacecolor="white" if marker == "s" else color, label=label)  # fmt: skip
        finals = [h["binding_area"][-1] for h in one]
        products.plot([law.traction * law.cutoff] * len(one), finals, "_", color=GREEN, markersize=9,
                      label=f"$d_c$ = {min(RANGES):g} to {max(RANGES):g}, one product")  # fmt: skip
        products.set(xlabel=r"product $T_\mathrm{max} d_c$ [$kT/a_0^2$]", ylabel="final binding area $A$ [$a_0^2$]")
        products.set(xlim=(0.0, 1.1 * max(product)), ylim=(0.0, 0.8))
        products.legend(loc="lower right")
        meshes.errorbar(
            ranges,
            [c.final for c in by_range],
            [c.final * c.error() for c in by_range],
            fmt="o-",
            color=DARK,
            label="resolved",
        )
        for (body, areas), shift in zip(coarse.items(), (-0.002, 0.002)):
            color, marker = BODIES[body]
            for k, (how, filled) in enumerate((("bound", True), ("touching nodes", False))):
                middle = areas[:, :, k].mean(axis=0)
                reach = abs(np.array([areas[:, :, k].min(axis=0), areas[:, :, k].max(axis=0)]) - middle)
                meshes.errorbar(np.array(ranges) + shift * (1 + 2 * k), middle, reach, fmt=marker, color=color, capsize=2,
                                markerfacecolor=color if filled else "white", linewidth=0.8, label=f"{body}, {how}")  # fmt: skip
        meshes.set(
            xlabel="range $d_c$ of the traction [$a_0$]", ylabel="final binding area $A$ [$a_0^2$]", ylim=(0.0, 1.0)
        )
        meshes.legend(
            loc="lower right", title=f"mean and range of edges {EDGES[0]:g} to {EDGES[-1]:g}", title_fontsize=7
        )

    study.panels(fill, "cutoff", out, size=(7.2, 3.2))


if __name__ == "__main__":
    draw(study.command_line())
