"""Order of the staggered scheme in time, and of the two bodies in the edge length; typical case.

Steps: fixed steps of either order, on one mesh, against the smallest adaptive ones. From t = 0 the start counts: the
front runs as sqrt(t), and the first steps are of order 1. Taken up from the smooth state at t = 0.02, the scheme
alone is seen. Edges: the same small adaptive steps, against a fine meridian.
"""
import copy

import numpy as np
import study
from study import DARK, GREEN, LIGHT, RED

from vesdyn.spreading import Spreading
from vesdyn.stepping import step

MESH = {"model": "axisymmetric", "mesh.front_edge": 0.004, "mesh.far_edge": 0.02}
STEPS = (0.004, 0.002, 0.001, 0.0005, 0.00025, 0.000125)
SMALLEST = {"time.step": "auto", "accuracy": 0.0001}
EARLY, LATE = 0.02, 0.2
TAKEN_UP = {"model": "axisymmetric", "mesh.front_edge": 0.002, "mesh.far_edge": 0.01, "solver.tolerance": 1e-5}
TAKEN_UP_END = 0.08
EDGES = {"axisymmetric": (0.03, 0.02, 0.0125, 0.008, 0.005, 0.0025), "surface": (0.03, 0.02, 0.0125)}
FAR = 4.0  # far edge / front edge
MESH_STEP = {"time.step": "auto", "accuracy": 0.001, "solver.tolerance": 1e-4, "time.end": LATE}
FINEST = {"model": "axisymmetric", "mesh.front_edge": 0.0012, "mesh.far_edge": 0.0048}
BODIES = {
    "axisymmetric": ({"model": "axisymmetric"}, DARK, "o", "-"),
    "surface, scalloped rows": ({"model": "surface", "mesh.layout": "scalloped"}, RED, "s", "--"),
    "surface, rings": ({"model": "surface", "mesh.layout": "rings"}, LIGHT, "^", ":"),
}


def from_start(order, steps, mesh, smallest):
    """Relative errors (n_steps, 2) of A at the early and the late time."""
    common = {"time.end": LATE, "solver.tolerance": 1e-5}
    exact = study.area_at(study.history("typical", {**mesh, **smallest, **common}), (EARLY, LATE))
    runs = [study.history("typical", {**mesh, "time.step": dt, "time.order": order, **common}) for dt in steps]
    return np.array([study.area_at(rows, (EARLY, LATE)) / exact - 1.0 for rows in runs])


def taken_up(order, steps, mesh, smallest):
    """Relative errors (n_steps,) of A at TAKEN_UP_END in runs that begin with the state at the early time."""

    def new(changes):
        return Spreading(study.case_of("typical", {**mesh, "time.end": TAKEN_UP_END, **changes})[0])

    def area(changes, state):
        sim = new(changes)
        sim.restore(copy.deepcopy(state))
        sim.dt_wanted = state["dt_before"]
        while sim.time < TAKEN_UP_END:
            step(sim, next(t for t in sim.case.marks if t > sim.time))
        return sim.history_row()["binding_area"]

    key = {**mesh, **smallest, "time.order": order, "time.step": "-".join(f"{dt:g}" for dt in steps)}
    store = study.note_file("taken-up", key, "txt")
    if not store.exists():
        sim = new(smallest)
        while sim.time < EARLY:
            step(sim, next(t for t in sim.case.marks if t > sim.time))
        state = copy.deepcopy(sim.state())
        exact = area(smallest, state)
        np.savetxt(store, [area({"time.step": dt, "time.order": order}, state) / exact - 1.0 for dt in steps])
    return np.loadtxt(store)


def main(
    out=study.OUT, steps=STEPS, mesh=MESH, smallest=SMALLEST, taken_up_mesh=TAKEN_UP, edges=EDGES, mesh_step=MESH_STEP,
    finest=FINEST,
):  # fmt: skip
    curves = {}  # name: errors, colour, marker, line
    for order, colors, line in ((1, (LIGHT, RED), ":"), (2, (GREEN, DARK), "-")):
        for t, errors, color, marker in zip((EARLY, LATE), from_start(order, steps, mesh, smallest).T, colors, "^s" if order == 1 else "Do"):
            curves[f"order {order}, from 0, at {t:g}"] = errors, color, marker, line
    for order, marker in ((1, "x"), (2, "P")):
        errors = taken_up(order, steps, taken_up_mesh, smallest)
        curves[f"order {order}, from {EARLY:g}, at {TAKEN_UP_END:g}"] = errors, "0.45" if order == 1 else "k", marker, "--"
    small = np.array(steps) <= 0.001 if min(steps) < 0.0005 else np.full(len(steps), True)
    slopes = {name: float(study.fitted_order(np.array(steps)[small], errors[small])) for name, (errors, *_) in curves.items()}
    study.table(
        "relative error of A(t) from the step, and its slope over steps up to 0.001",
        ["", *(f"{dt:g}" for dt in steps), "slope"],
        [(name, *map(float, errors), slopes[name]) for name, (errors, *_) in curves.items()],
    )

    finest = study.history("typical", {**finest, **mesh_step})
    by_mesh = {}
    for body, (what, *_) in BODIES.items():
        lengths = edges[body.split(",")[0]]
        runs = [study.history("typical", {**what, "mesh.front_edge": e, "mesh.far_edge": FAR * e, **mesh_step}) for e in lengths]
        by_mesh[body] = lengths, [study.area_error(rows, finest) for rows in runs]
    study.table(
        "relative error of A(t) from the mesh, largest over all steps with t >= 0.01",
        ["body", "front edges: errors", "slope"],
        [
            (body, "  ".join(f"{e:g}: {m:.4f}" for e, m in zip(*measured)), float(study.fitted_order(*measured)))
            for body, measured in by_mesh.items()
        ],
    )

    def draw(by_step, by_edge):
        for name, (errors, color, marker, line) in curves.items():
            by_step.loglog(
                steps, np.abs(errors), color=color, marker=marker, linestyle=line, label=f"{name}: {slopes[name]:.2f}"
            )
        lengths = np.array([max(steps), min(steps)])
        for order, top in ((1, 0.16), (2, 0.016)):
            guide = top * (lengths / lengths[0]) ** order
            by_step.loglog(lengths, guide, color="0.7", linewidth=0.8, zorder=0)
            by_step.annotate(f"slope {order}", (lengths[0], top), textcoords="offset points", xytext=(3, -2), color="0.35", fontsize=7)
        by_step.set(xlabel=r"coupling step $\Delta t$ [$a_0^2/D$]", ylabel="relative error of $A(t)$", xlim=(0.8 * lengths[1], 1.9 * lengths[0]))
        study.plain(by_step.xaxis, steps[::2])
        study.legend_below(by_step, "order, begun at $t$, read at $t$: slope up to 0.001", columns=2)
        for body, (lengths, errors) in by_mesh.items():
            _, color, marker, line = BODIES[body]
            by_edge.loglog(
                lengths, errors, color=color, marker=marker, linestyle=line,
                label=f"{body}: {study.fitted_order(lengths, errors):.2f}",
            )  # fmt: skip
        by_edge.set(xlabel="front edge [$a_0$]", ylabel="largest relative error of $A(t)$, $t \\geq 0.01$")
        study.plain(by_edge.xaxis, (0.0025, 0.005, 0.01, 0.02, 0.03))
        study.legend_below(by_edge, "body: fitted slope")
        for ax in (by_step, by_edge):
            study.as_percent(ax.yaxis)

    study.panels(draw, "order", out, size=(7.2, 4.3))


if __name__ == "__main__":
    main(study.command_line())
