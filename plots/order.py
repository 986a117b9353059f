"""Order of the staggered scheme in time, and of the two bodies in the edge length; typical case.

Steps: fixed steps of either order, on one mesh, against the smallest adaptive ones. From t = 0 the start counts: the
front runs as sqrt(t), and the first steps are of order 1. Taken up from the smooth state at t = 0.02, the scheme
alone is seen. Edges: the same small adaptive steps, against a fine meridian.
"""

import looks
import numpy as np
from looks import DARK, GREEN, LIGHT, RED

from vesdyn.diagnostics import Moment
from vesdyn.spreading import Spreading
from vesdyn.stepping import march
from vesdyn.study import area_at, area_error, fitted_order

MESH = {"model": "axisymmetric", "mesh.front_edge": 0.004, "mesh.far_edge": 0.02}
STEPS = (0.004, 0.002, 0.001, 0.0005, 0.00025, 0.000125)
SMALLEST = {"time.step": "auto", "accuracy": 0.0001}
EARLY, LATE = 0.02, 0.2
FITTED_UP_TO = 0.001  # longest step of a fitted order, where there are shorter ones
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
LOOKS = (  # colour, marker and line of the errors by step, in their order
    (LIGHT, "^", ":"), (RED, "s", ":"), (GREEN, "D", "-"), (DARK, "o", "-"), ("0.45", "x", "--"), ("k", "P", "--"),
)  # fmt: skip


def measure(
    study, steps=STEPS, mesh=MESH, smallest=SMALLEST, taken_up_mesh=TAKEN_UP, edges=EDGES, mesh_step=MESH_STEP,
    finest=FINEST, times=(EARLY, LATE, TAKEN_UP_END),
):  # fmt: skip
    """Relative errors of A by step and by edge, each with its fitted order and that one's error.

    "steps": name: errors (n_steps,), (order, error); "edges": body: edges, errors, (order, error).
    """
    early, late, end = times
    by_step = {}
    for order in (1, 2):
        for t, errors in zip((early, late), from_start(study, order, steps, mesh, smallest, (early, late)).T):
            by_step[f"order {order}, from 0, at {t:g}"] = errors
    for order in (1, 2):
        by_step[f"order {order}, from {early:g}, at {end:g}"] = taken_up(
            study, order, steps, taken_up_mesh, smallest, early, end
        )
    short = np.array(steps) <= FITTED_UP_TO
    fitted = short if short.sum() > 1 else np.full(len(steps), True)
    by_edge = {}
    exact = study.history("typical", {**finest, **mesh_step})
    for body, (what, *_) in BODIES.items():
        lengths = edges[body.split(",")[0]]
        runs = [("typical", {**what, "mesh.front_edge": e, "mesh.far_edge": FAR * e, **mesh_step}) for e in lengths]
        study.prepare(runs)
        errors = [float(area_error(study.history(*run), exact)) for run in runs]
        by_edge[body] = lengths, errors, fitted_order(lengths, errors)
    return {
        "lengths": steps,
        "steps": {
            name: (errors, fitted_order(np.array(steps)[fitted], errors[fitted])) for name, errors in by_step.items()
        },
        "edges": by_edge,
    }


def from_start(study, order, steps, mesh, smallest, times):
    """Relative errors (n_steps, n_times) of A at ``times``, the last of which ends the runs."""
    common = {"time.end": times[-1], "output.frames": list(times), "solver.tolerance": 1e-5}
    runs = [("typical", {**mesh, "time.step": dt, "time.order": order, **common}) for dt in steps]
    finest = ("typical", {**mesh, **smallest, **common})
    study.prepare([finest, *runs])
    exact = area_at(study.history(*finest), times)
    return np.array([area_at(study.history(*run), times) / exact - 1.0 for run in runs])


def taken_up(study, order, steps, mesh, smallest, early, end):
    """Relative errors (n_steps,) of A at ``end`` in runs that begin with the state at the ``early`` time."""

    def scene(changes):
        return Spreading(study.planned("typical", {**mesh, "time.end": end, "output.frames": [early], **changes})[0])

    def area(changes, state):
        sim = scene(changes)
        *_, last = march(sim, state._replace(dt_wanted=state.dt_before))
        return Moment(sim, last)["binding_area"]

    key = {
        **mesh,
        **smallest,
        "time.order": order,
        "time.step": "-".join(f"{dt:g}" for dt in steps),
        "from": early,
        "to": end,
    }
    store = study.file("taken-up", key, "txt")
    if not store.exists():
        state = next(state for state in march(scene(smallest)) if state.time == early)
        exact = area(smallest, state)
        np.savetxt(store, [area({"time.step": dt, "time.order": order}, state) / exact - 1.0 for dt in steps])
    return np.loadtxt(store)


def with_error(order):
    """A fitted order with its standard error in words."""
    value, error = order
    return f"{value:.2f}" + (f" ± {error:.2f}" if np.isfinite(error) else "")


def draw(measured, out=looks.OUT):
    steps, by_step, by_edge = measured["lengths"], measured["steps"], measured["edges"]
    looks.table(
        f"relative error of A(t) from the step, and its order over steps up to {FITTED_UP_TO:g}",
        ["", *(f"{dt:g}" for dt in steps), "order"],
        [(name, *map(float, errors), with_error(order)) for name, (errors, order) in by_step.items()],
    )
    looks.table(
        "relative error of A(t) from the mesh, largest over all steps with t >= 0.01",
        ["body", "front edges: errors", "order"],
        [
            (body, "  ".join(f"{e:g}: {m:.4f}" for e, m in zip(lengths, errors)), with_error(order))
            for body, (lengths, errors, order) in by_edge.items()
        ],
    )

    def fill(in_time, in_space):
        for (name, (errors, order)), (color, marker, line) in zip(by_step.items(), LOOKS):
            look = {"color": color, "marker": marker, "linestyle": line, "label": f"{name}: {with_error(order)}"}
            in_time.loglog(steps, np.abs(errors), **look)
        lengths = np.array([max(steps), min(steps)])
        for order, top in ((1, 0.16), (2, 0.016)):
            guide = top * (lengths / lengths[0]) ** order
            in_time.loglog(lengths, guide, color="0.7", linewidth=0.8, zorder=0)
            in_time.annotate(
                f"slope {order}",
                (lengths[0], top),
                textcoords="offset points",
                xytext=(3, -2),
                color="0.35",
                fontsize=7,
            )
        in_time.set(
            xlabel=r"coupling step $\Delta t$ [$a_0^2/D$]",
            ylabel="relative error of $A(t)$",
            xlim=(0.8 * lengths[1], 1.9 * lengths[0]),
        )
        looks.plain(in_time.xaxis, steps[::2])
        looks.legend_below(in_time, "order, begun at $t$, read at $t$: fitted up to 0.001", columns=2)
        for body, (lengths, errors, order) in by_edge.items():
            _, color, marker, line = BODIES[body]
            look = {"color": color, "marker": marker, "linestyle": line, "label": f"{body}: {with_error(order)}"}
            in_space.loglog(lengths, errors, **look)
        in_space.set(xlabel="front edge [$a_0$]", ylabel="largest relative error of $A(t)$, $t \\geq 0.01$")
        looks.plain(in_space.xaxis, (0.0025, 0.005, 0.01, 0.02, 0.03))
        looks.legend_below(in_space, "body: fitted order")
        for ax in (in_time, in_space):
            looks.as_percent(ax.yaxis)

    looks.panels(fill, "order", out, size=(7.2, 4.3))


if __name__ == "__main__":
    looks.command_line(measure, draw, every=looks.INDEPENDENT)
